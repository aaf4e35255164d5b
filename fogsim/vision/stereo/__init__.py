"""Two images side by side: disparities, and how contrast falls with the distance computed from them."""
