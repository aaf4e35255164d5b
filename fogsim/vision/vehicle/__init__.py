"""The vehicle ahead: where it is in the image, and its contrast."""
