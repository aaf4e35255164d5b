"""Edges that stand upright in the image: sides of vehicles, posts and trunks, which are no lines along a road."""

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel

NEXT, MISSED = 0.75, 2
"""Columns by which an upright edge may lean from one of its points to the next [px], and rows between that miss it."""

LEAN, PLACED = 0.1, 0.5
"""Columns per row by which it may lean in all [-], and how surely its ends are placed [px]."""

LEAST_HEIGHT, LEAST_POINTS = 5.0, 3
"""Height from which an edge is seen to stand [px], and of how many points."""


@kernel
def lying(place: NDArray[np.float64], step: int) -> NDArray[np.bool_]:
    """Tell points that may lie on the road from those of upright edges.

    The side of a vehicle ahead ends near where the lines of its lane pass it. With a dash of such a line it makes a
    line that is straight within two pixels, and long, which the dash alone is not: the point in which the lines meet
    would move by several of its deviations. What lies on the road and seems upright is below the camera, within a
    tenth of its height to either side, and tells nothing of the horizon.

    Parameters
    ----------
    place : (m, 2) float64
        Column and row of each point [px], by row. Of what kind they are does not count: a vehicle's side is brighter
        than what is behind it in one place and darker in another.
    step : int
        Rows from one that is looked at to the next [px].

    Returns
    -------
    (m,) bool
        False of points on upright edges.
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
            if place[j, 1] > (place[i, 1] + (1 + MISSED) * step if nearest < 0 else place[nearest, 1]):
                break
            if first[j] == j and apart <= NEXT and apart < near:
                nearest, near = j, apart
        if nearest >= 0:
            first[nearest], last[first[i]] = first[i], nearest
            points[first[i]] += 1
    free = np.ones(count, np.bool_)
    for i in range(count):
        top, foot = first[i], last[first[i]]
        height = place[foot, 1] - place[top, 1]
        lean = abs(place[foot, 0] - place[top, 0])
        free[i] = points[top] < LEAST_POINTS or height < LEAST_HEIGHT or lean > LEAN * height + PLACED
    return free
