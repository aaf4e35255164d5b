"""From pixel values to linear luminance, and whether it is daylight."""
