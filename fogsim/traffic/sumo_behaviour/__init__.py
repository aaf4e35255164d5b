"""How fast SUMO's drivers drive, how near they follow, and what advice moves them to."""
