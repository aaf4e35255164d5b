"""Fog by lamplight: the veil of the own head lamps, and the glow of others (gallen2014)."""
