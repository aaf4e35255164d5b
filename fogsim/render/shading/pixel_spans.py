"""From the triangle ids of pixels to spans of pixels, and a list of the surfaces that are seen."""

from typing import Any

import numpy as np

from fogsim.core.jit import kernel
from fogsim.render.shading.layout import Copies, Numbers, Spans, Wide


@kernel
def find_spans(
    triangle_ids: Numbers, top: int, bottom: int, copies: Copies, rays: Wide, terrain: bool, spans: Spans
) -> tuple[int, int]:
    """Find the spans of some rows.

    Returns numbers of spans and of surfaces. Takes `triangle_ids` (rows, cols) int32, `rays` (3, 3).
    """
    span, surface_of_triangle, triangle_of, copy_of = (
        spans.span,
        spans.surface_of_triangle,
        spans.triangle_id,
        spans.copy,
    )
    first = copies.first
    for copy in range(len(copies.mesh)):
        for own in range(first[copy], first[copy + 1]):
            surface_of_triangle[own] = -2 - copy
    count, surfaces = 0, 2
    columns = np.uint64(triangle_ids.shape[1])
    ends = np.empty(columns, np.int32)
    for v in range(top, bottom):
        begin = np.int32(0)
        for piece in range(_ends(triangle_ids[v], ends)):
            end, triangle_id = ends[piece], triangle_ids[v, begin]
            surface: Any = 0
            if triangle_id >= 0:
                surface = surface_of_triangle[triangle_id]
                if surface < 0:
                    copy_of[surfaces], triangle_of[surfaces] = -2 - surface, triangle_id
                    surface_of_triangle[triangle_id] = surface = surfaces
                    surfaces += 1
                split: Any = end
            else:
                surface, split = _background(v, int(begin), int(end), rays, terrain)
            span[count, 0], span[count, 1], span[count, 2], span[count, 3] = v, begin, split, surface
            count += 1
            if split < end:
                span[count, 0], span[count, 1], span[count, 2], span[count, 3] = v, split, end, 1 - surface
                count += 1
            begin = end
    return count, surfaces


@kernel
def _ends(row: Numbers, ends: Numbers) -> np.uint64:
    """Columns after the last pixel of each span of equal triangle ids in a row; their count.

    Every column is written down, and by the next one again unless a span ends there: a processor that guesses where
    that is loses more than it takes to write.
    """
    last, count = np.uint64(row.shape[0] - 1), np.uint64(0)
    for u in range(last):
        after = u + np.uint64(1)
        ends[count] = np.int32(after)
        count += np.uint64(row[u] != row[after])
    ends[count] = np.int32(last) + np.int32(1)
    return count + np.uint64(1)


@kernel
def _background(v: int, begin: int, end: int, rays: Wide, terrain: bool) -> tuple[int, int]:
    """Whether a span of background begins with sky (0) or terrain (1), and where it changes to the other."""
    slope, rest = rays[2, 0], rays[2, 1] * v + rays[2, 2]
    surface = 1 if terrain and slope * begin + rest < 0.0 else 0
    last = 1 if terrain and slope * (end - 1) + rest < 0.0 else 0
    if surface == last:
        return surface, end
    split = min(max(int(np.ceil(-rest / slope)), begin + 1), end - 1)
    while split > begin + 1 and (slope * (split - 1) + rest < 0.0) == (last == 1):
        split -= 1
    while split < end - 1 and (slope * split + rest < 0.0) != (last == 1):
        split += 1
    return surface, split
