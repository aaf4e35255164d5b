"""Edges, lines along the road, their vanishing point and the horizon.

`edges` (Canny; with Deriche's derivatives in `deriche`) and `row_edges` find edges; `lane_lines`, `gradient_lines`,
`road_lines` and `segments` are four methods' ways from an image to the `VanishingPoint` of `vanishing_point`.
"""
