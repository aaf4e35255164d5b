"""SUMO's drivers: whom they see, and how fast they go."""
