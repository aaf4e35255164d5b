"""Edges along single rows, placed within the pixel, and which of them stand upright and so are no lines on a road."""

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.vision.light.medians import median_of_few
from fogsim.vision.light.pixel_kernels import row_luminance
from fogsim.vision.lines.edges import peak_offset

RISING, FALLING, RIDGE = 0, 1, 2
"""Kinds of points: edges to the brighter and to the darker side, and the middle of a narrow bright stripe."""

_NARROW = 5.5
"""Width up to which a bright stripe is one point [px]: blurred together, its edges seem further apart than they are."""

_EDGE_IN_NOISE = 6.0
"""Least gradient of an edge, in deviations of the row's own gradients [-]."""

_SAMPLED = 64
"""Gradients of a row that show how much they scatter, as many from either side."""

_LEAST_GRADIENT = 0.7
"""Least gradient of an edge [linear grey levels per px]."""

REACH, SMOOTHING = 4, 1.3
"""Half-width of the derivative's kernel, and deviation of the Gaussian that it is the derivative of [px]."""

_MOST_A_ROW, _MOST_POINTS = 48, 4000
"""Points that are kept of a row, and of an image."""

KINDS = 3
"""How many kinds of points there are."""

_NEXT, _MISSED = 0.75, 2
"""Columns by which an upright edge may lean from one of its points to the next [px], and rows between that miss it."""

_LEAN, _PLACED = 0.1, 0.5
"""Columns per row by which it may lean in all [-], and how surely its ends are placed [px]."""

_LEAST_HEIGHT, _UPRIGHT_POINTS = 5.0, 3
"""Height from which an edge is seen to stand [px], and of how many points."""


@kernel
def row_points(
    pixels: NDArray[np.uint8] | NDArray[np.uint16], tables: NDArray[np.float32], rows: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points of rows where the luminance changes sharply along the row, to a fraction of a pixel.

    Each row is looked at alone: what fog does from row to row moves no edge within it.

    Returns column and row of each point [px], and its kind (m, 2). Takes `pixels` (rows, cols, channels) uint8,
    `tables` (channels, levels), `rows` (n,) int64.
    """
    cols = pixels.shape[1]
    place, kind = np.empty((_MOST_POINTS, 2)), np.empty(_MOST_POINTS, np.int64)
    line, slope = np.zeros(cols, np.float32), np.zeros(cols, np.float32)
    tap = np.arange(REACH + 1).astype(np.float64)
    weight = tap * np.exp(-0.5 * (tap / SMOOTHING) ** 2)
    weight = weight / (2.0 * (weight * tap).sum())
    w1, w2, w3, w4 = np.float32(weight[1]), np.float32(weight[2]), np.float32(weight[3]), np.float32(weight[4])
    # Views that start at each tap: indices that cannot be negative let the loop be vectorised.
    l4, l3, l2, l1 = line, line[1:], line[2:], line[3:]
    r1, r2, r3, r4 = line[5:], line[6:], line[7:], line[8:]
    inner = slope[REACH:]
    edge, sign = np.empty(_MOST_A_ROW), np.empty(_MOST_A_ROW, np.int64)
    count = 0
    for row in rows:
        row_luminance(pixels, tables, row, line)
        for col in range(cols - 2 * REACH):
            inner[col] = (
                w1 * (r1[col] - l1[col])
                + w2 * (r2[col] - l2[col])
                + w3 * (r3[col] - l3[col])
                + w4 * (r4[col] - l4[col])
            )
        found = _row_edges(slope, edge, sign)
        i = 0
        while i < found and count < _MOST_POINTS:
            stripe = i + 1 < found and sign[i] > 0 and sign[i + 1] < 0 and edge[i + 1] - edge[i] < _NARROW
            place[count, 1] = row
            if stripe:
                place[count, 0], kind[count] = 0.5 * (edge[i] + edge[i + 1]), RIDGE
                i += 2
            else:
                place[count, 0], kind[count] = edge[i], RISING if sign[i] > 0 else FALLING
                i += 1
            count += 1
    return place[:count].copy(), kind[:count].copy()


@kernel
def _row_edges(slope: NDArray[np.float32], edge: NDArray[np.float64], sign: NDArray[np.int64]) -> int:
    """Peaks of a row's gradient that stand out of it; returns how many."""
    cols = slope.size
    # Half of a row's gradients, at least, are noise and texture.
    sample, ordered = np.empty(_SAMPLED, np.float32), np.empty(_SAMPLED, np.float32)
    step = max((cols - 2 * REACH) // _SAMPLED, 1)
    for i in range(_SAMPLED // 2):
        sample[2 * i] = abs(slope[min(REACH + i * step, cols - 1)])
        sample[2 * i + 1] = abs(slope[max(cols - 1 - REACH - i * step, 0)])
    middle = median_of_few(sample, ordered)
    least = np.float32(max(_EDGE_IN_NOISE * middle / 0.6745, _LEAST_GRADIENT))
    found = 0
    for col in range(REACH + 1, cols - REACH - 1):
        here = abs(slope[col])
        if here < least or found == edge.size:
            continue
        before, behind = slope[col - 1], slope[col + 1]
        rising = slope[col] > 0
        if not rising:
            before, behind = -before, -behind
        if here < before or here <= behind:
            continue
        edge[found] = col + peak_offset(before, here, behind)
        sign[found] = 1 if rising else -1
        found += 1
    return found


@kernel
def may_lie_on_road(place: NDArray[np.float64], step: int) -> NDArray[np.bool_]:
    """Separate points that may lie on the road from those of upright edges: sides of vehicles, posts and trunks.

    The side of a vehicle ahead ends near where the lines of its lane pass it. With a dash of such a line it makes a
    line that is straight within two pixels, and long, which the dash alone is not: the point in which the lines meet
    would move by several of its deviations. What lies on the road and seems upright is below the camera, within a tenth
    of its height to either side, and has no information about the horizon.

    Returns false of points on upright edges (m,) bool. Takes `place` (m, 2) [px], `step` [px].
    """
    count = place.shape[0]
    first, last, points = np.arange(count), np.arange(count), np.ones(count, np.int64)
    below = 0
    for i in range(count):
        while below < count and place[below, 1] <= place[i, 1]:
            below += 1
        nearest, near = -1, np.inf
        for j in range(below, count):
            apart = abs(place[j, 0] - place[i, 0])
            if place[j, 1] > (place[i, 1] + (1 + _MISSED) * step if nearest < 0 else place[nearest, 1]):
                break
            if first[j] == j and apart <= _NEXT and apart < near:
                nearest, near = j, apart
        if nearest >= 0:
            first[nearest], last[first[i]] = first[i], nearest
            points[first[i]] += 1
    free = np.ones(count, np.bool_)
    for i in range(count):
        top, foot = first[i], last[first[i]]
        height = place[foot, 1] - place[top, 1]
        lean = abs(place[foot, 0] - place[top, 0])
        free[i] = points[top] < _UPRIGHT_POINTS or height < _LEAST_HEIGHT or lean > _LEAN * height + _PLACED
    return free
