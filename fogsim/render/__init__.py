"""Geometry to linear radiance, distance along the ray and instance ids."""
