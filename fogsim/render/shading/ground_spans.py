"""Spans of ground in a row that lie in one plane, and so are textured together."""

import numpy as np

from fogsim.core.jit import kernel
from fogsim.render.shading import layout
from fogsim.render.shading.layout import Picture, Spans, Wide
from fogsim.render.shading.texture import Row

_INSTANCE, _LEAST, _MOST, _DEPTH = layout.INSTANCE, layout.LEAST, layout.MOST, layout.DEPTH
_GAP = 16  # pixels between spans of a row that may show something else
_SAME = 0.005  # difference of depths up to which two planes are taken as one, over the depth


@kernel
def next_coplanar_spans(
    kind: int, spans: Spans, begin: int, count: int, lens: Wide, work: Row, picture: Picture
) -> tuple[int, int]:
    """Find the next spans of a kind that lie in a row and a plane, and set their depths, distances and instance ids.

    Returns number of members, 0 if there are none any more, and the first span that has not been looked at. Takes
    `lens` (3,).
    """
    span, kinds, surface, member, depth = spans.span, spans.kind, spans.surface, work.member, work.depth
    distance, instance = picture.distance, picture.instance
    one, per_focal = np.float32(1.0), np.float32(1.0 / lens[0])
    members, number, first, end = 0, begin, 0, 0
    while number < count:
        k = span[number, 3]
        if kinds[k] != kind:
            number += 1
            continue
        v, start, row = np.uint64(span[number, 0]), span[number, 1], float(span[number, 0])
        rest = surface[k, _DEPTH] * start + surface[k, _DEPTH + 1] * row + surface[k, _DEPTH + 2]
        if members == 0:
            first = number
        else:
            f = span[first, 3]
            before = surface[f, _DEPTH] * start + surface[f, _DEPTH + 1] * row + surface[f, _DEPTH + 2]
            if span[number, 0] != span[first, 0] or start > end + _GAP or abs(before - rest) > _SAME * rest:
                break
        member[members] = number
        members, end = members + 1, span[number, 2]
        name = np.int32(surface[k, _INSTANCE])
        least, most = np.float32(surface[k, _LEAST]), np.float32(surface[k, _MOST])
        slope, level = np.float32(surface[k, _DEPTH]), np.float32(rest)
        x, y = np.float32((start - lens[1]) / lens[0]), np.float32((row - lens[2]) / lens[0])
        square = one + y * y
        for i in range(np.uint64(end - start)):
            step, u = np.float32(np.int32(i)), np.uint64(start) + i
            across, z = x + per_focal * step, one / min(max(level + slope * step, least), most)
            depth[u] = z
            distance[v, u] = z * np.sqrt(square + across * across)
            instance[v, u] = name
        number += 1
    return members, number
