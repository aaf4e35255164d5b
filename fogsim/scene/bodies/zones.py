"""Division of a body into few zones of height, in each of which it looks much the same."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.bodies.seen import COLUMNS, ROWS, Seen, Size

Wide = NDArray[np.float64]
_LEAST = 4  # rows of a zone


def zones_of(side: str, seen: Seen, left: Seen, size: Size, count: int) -> list[tuple[int, int]]:
    """First rows of the zones of a body, and the rows after their last, from below.

    The sum of squares that straight lines through outlines and mean materials leave is the least.

    Parameters
    ----------
    side : str
        From where it is seen: "rear", "front" or "left".
    seen, left : Seen
        The body from there, and from the left.
    size : tuple of float
        Its length, width and height [m].
    count : int
        Number of zones.
    """
    materials = seen.paint.sum(axis=1) / np.maximum(seen.covered.sum(axis=1), 1)
    cost = _cost(_outlines(side, seen, left, size), straight=True) + _cost(materials[:, None], straight=False)
    best, cut = cost[0].copy(), np.zeros((count, ROWS + 1), np.int64)
    for zone in range(1, count):
        total = best[:, None] + cost
        cut[zone], best = np.argmin(total, axis=0), np.min(total, axis=0)
    edges = [ROWS]
    for zone in range(count - 1, -1, -1):
        edges.append(int(cut[zone, edges[-1]]))
    edges.reverse()
    return [(low, high) for low, high in pairwise(edges) if high > low]


def _outlines(side: str, seen: Seen, left: Seen, size: Size) -> Wide:
    """Breadth of each row, and its ends (only that one from where the body is seen) in its widths (rows, 2 or 3)."""
    rear, front = np.argmax(left.covered, axis=1), np.argmax(left.covered[:, ::-1], axis=1)
    ends = {"rear": (rear,), "front": (front,), "left": (rear, front)}[side]
    weight = (1.0 if side == "left" else 2.0) * seen.covered.mean(axis=1)
    return np.column_stack((weight, *(0.5 * size[0] / size[1] / COLUMNS * end for end in ends)))


def _cost(values: Wide, *, straight: bool) -> Wide:
    """Sum of squares left in rows i … j − 1 (ROWS + 1, ROWS + 1), infinite where those are too few."""
    z = np.arange(ROWS) / ROWS

    def between(column: Wide) -> Wide:
        total = np.concatenate((np.zeros((1, *column.shape[1:])), np.cumsum(column, axis=0)))
        return np.asarray(total[None, :] - total[:, None])

    n = np.maximum(np.arange(ROWS + 1)[None, :] - np.arange(ROWS + 1)[:, None], 1)
    y, yy = between(values), between(values**2)
    left = yy - y**2 / n[..., None]
    if straight:
        spread = between(z**2) - between(z) ** 2 / n
        slope = between(z[:, None] * values) - between(z)[..., None] * y / n[..., None]
        left = left - slope**2 / np.maximum(spread, 1e-9)[..., None]
    rows = np.arange(ROWS + 1)[None, :] - np.arange(ROWS + 1)[:, None]
    return np.where(rows >= _LEAST, np.maximum(left, 0.0).sum(axis=2), np.inf)
