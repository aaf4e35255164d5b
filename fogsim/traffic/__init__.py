"""Where every vehicle is, how it moves and how it obeys advice."""
