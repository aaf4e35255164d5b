"""What is next to the vehicles in a SUMO simulation: traffic lights and persons on foot."""
