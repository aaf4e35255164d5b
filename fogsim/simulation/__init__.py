"""Runs: the closed loop and what rides in vehicles, traffic alone, the plug-in, and their recording."""
