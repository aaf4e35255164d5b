"""Signs of the map in the picture: where they are looked for, which are found, and from how far."""
