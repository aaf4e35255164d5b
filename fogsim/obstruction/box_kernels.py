"""Straight lines through upright boxes that rise with the road: compiled loops over plain arrays.

A box is a row of ten numbers: where its middle line begins (x, y, z), the direction of that line in plan (x, y), what
it rises over a metre of its length, its length, half its width, and the heights above that line between which it is.
In coordinates along the line, across it and above it a box has faces along the axes and a straight line stays one, so
that the part inside is what the three pairs of faces leave of it (Kay & Kajiya 1986).
"""

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

NUMBERS = 10
"""Numbers of a box."""

_Array = NDArray[np.float64]


@kernel
def share_inside(start: _Array, end: _Array, box: _Array) -> float:
    """Share of a straight line that lies inside a box [-]; the same from either end, and 0 for one that touches it.

    Takes `start`, `end` (3,) [m], `box` (10,).
    """
    # Rounding must not depend on who looks at whom.
    if (start[0], start[1], start[2]) > (end[0], end[1], end[2]):
        start, end = end, start
    x, y, step_x, step_y = start[0] - box[0], start[1] - box[1], end[0] - start[0], end[1] - start[1]
    along, step_along = x * box[3] + y * box[4], step_x * box[3] + step_y * box[4]
    across, step_across = y * box[3] - x * box[4], step_y * box[3] - step_x * box[4]
    above, step_above = start[2] - box[2] - box[5] * along, end[2] - start[2] - box[5] * step_along
    enters, leaves = 0.0, 1.0
    for place, step, low, high in (
        (along, step_along, 0.0, box[6]),
        (across, step_across, -box[7], box[7]),
        (above, step_above, box[8], box[9]),
    ):
        if step == 0.0:
            if not low < place < high:
                return 0.0
        else:
            first, last = (low - place) / step, (high - place) / step
            enters, leaves = max(enters, min(first, last)), min(leaves, max(first, last))
            if enters >= leaves:
                return 0.0
    return leaves - enters


@kernel
def add_ways_inside(starts: _Array, ends: _Array, boxes: _Array, ways: _Array) -> None:
    """Add to each line's way what of it lies inside boxes.

    Takes `starts`, `ends` (n, 3) [m], `boxes` (m, 10), `ways` (n,) [m].
    """
    for line in range(len(starts)):
        x, y, z = ends[line] - starts[line]
        length = np.sqrt(x * x + y * y + z * z)
        for box in boxes:
            ways[line] += share_inside(starts[line], ends[line], box) * length


@kernel
def find_hidden(eyes: _Array, targets: _Array, boxes: _Array, bounds: _Array, hidden: NDArray[np.bool_]) -> None:
    """Find for each pair of eyes whether boxes hide all points of its target.

    Takes `eyes` (n, 3) [m], `targets` (n, k, 3) [m], `boxes` (m, 10), `bounds` (m, 4) [m], `hidden` (n,) bool.
    """
    near = np.empty(len(boxes), np.int64)
    for one in range(len(eyes)):
        count = _boxes_near(eyes[one], targets[one], bounds, near)
        hidden[one] = count > 0
        for point in targets[one]:
            is_free = True
            for number in near[:count]:
                if share_inside(eyes[one], point, boxes[number]) > 0.0:
                    is_free = False
                    break
            if is_free:
                hidden[one] = False
                break


@kernel
def _boxes_near(eyes: _Array, points: _Array, bounds: _Array, near: NDArray[np.int64]) -> int:
    """Write the numbers of those boxes that may be between eyes and points; returns how many."""
    west = east = eyes[0]
    south = north = eyes[1]
    for point in points:
        west, east = min(west, point[0]), max(east, point[0])
        south, north = min(south, point[1]), max(north, point[1])
    count = 0
    for number in range(len(bounds)):
        box = bounds[number]
        if box[0] <= east and box[1] >= west and box[2] <= north and box[3] >= south:
            near[count] = number
            count += 1
    return count
