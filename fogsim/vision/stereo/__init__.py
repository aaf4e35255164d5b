"""Two pictures side by side: disparities, and how contrast falls with the distance that they tell."""
