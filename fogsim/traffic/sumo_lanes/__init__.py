"""Where SUMO's vehicles are along lanes and routes, and whom they follow."""
