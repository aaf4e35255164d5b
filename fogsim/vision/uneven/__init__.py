"""Fog that varies along the road, told from a road that sags or crests, and banks far ahead."""
