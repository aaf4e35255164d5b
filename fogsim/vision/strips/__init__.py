"""Strips along the road, the sky above it, and the fit of Koschmieder's law to both."""
