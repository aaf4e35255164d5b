"""Roads by template: the blocks of a scenario file that describe them, and the files that FogSim writes of them."""
