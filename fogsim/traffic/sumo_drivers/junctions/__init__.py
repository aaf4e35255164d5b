"""SUMO's drivers at junctions: which other vehicles, which lights and which pedestrians they see."""
