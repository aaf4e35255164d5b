"""A SUMO simulation: how it is reached, what is read of it, what is set in it."""
