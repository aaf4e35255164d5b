"""Lamps in pictures by night: sources of light, and the halos about them, by falling thresholds."""
