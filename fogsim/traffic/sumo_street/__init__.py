"""What is beside the vehicles in a SUMO simulation: traffic lights and persons on foot."""
