"""SUMO's drivers: which leaders they see, and how fast they drive."""
