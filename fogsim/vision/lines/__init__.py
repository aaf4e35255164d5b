"""Edges, lines along the road, and the horizon.

`edges` (Canny) and `road_line_kernels` (along single rows) find edges; `vanishing_point`, `road_lines` and `segments`
find lines and where they meet; `road_course` bends, sags and crests.
"""
