"""Fog that varies along the road, estimated from a road that sags or crests, and banks far ahead."""
