"""Edges, lines along the road, the vanishing point and the horizon."""
