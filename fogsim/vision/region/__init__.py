"""The region of the road in the image, and the luminance of its rows."""
