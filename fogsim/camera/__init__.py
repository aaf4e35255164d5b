"""Pixels to rays and back, exposure, noise, response and quantisation."""
