"""What SUMO's drivers see, and whom they react to."""
