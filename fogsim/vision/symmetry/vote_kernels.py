"""Votes of pairs of edge points for the middle of what they are the outline of."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel
from fogsim.vision.symmetry.edge_kernels import NX, NY, SNR, X, Y

Floats = NDArray[np.float32]

OPPOSITE = -0.9
"""Largest cosine between two gradients that are opposite: within 26° [-]."""

_SIDES = ((0.0, 1.0), (math.sqrt(0.75), -0.5), (-math.sqrt(0.75), -0.5))
"""Outward normals of an upright triangle with its tip up, row downward."""

_ALIGNED = 0.97
"""Least cosine between a gradient and the normal of a triangle's side: within 14° [-]."""


@kernel
def pair_votes(points: Floats, rows: int, cols: int, nearest: float, farthest: float) -> Floats:
    """Accumulate the middles of pairs of points with opposite gradients along the line between them.

    Parameters
    ----------
    points : (n, 5) float32
        Edge points by rows, see `fogsim.vision.symmetry.edge_kernels.edge_points`.
    rows, cols : int
        Size of the picture's piece [px].
    nearest, farthest : float
        Distances between the two points of a pair [px].

    Returns
    -------
    (rows, cols) float32
        Votes: one that counts fully comes from two points that face each other squarely, and weighs as the weaker of
        their gradients does on a logarithmic scale.
    """
    votes = np.zeros((rows, cols), np.float32)
    n = points.shape[0]
    weight = np.log1p(points[:, SNR])
    starts = np.zeros(rows + 1, np.int64)
    for i in range(n):
        starts[int(points[i, Y] + 0.5) + 1] += 1
    for row in range(rows):
        starts[row + 1] += starts[row]
    # Points are sorted by the pixel that they come from; that of the place may be the next one.
    order = np.empty(n, np.int64)
    filled = starts[:-1].copy()
    for i in range(n):
        row = int(points[i, Y] + 0.5)
        order[filled[row]] = i
        filled[row] += 1
    reach = int(farthest) + 1
    for row in range(rows):
        for other in range(row, min(row + reach, rows)):
            first = starts[other]
            for a in range(starts[row], starts[row + 1]):
                i = order[a]
                x = points[i, X]
                while first < starts[other + 1] and points[order[first], X] < x - farthest - 2.0:
                    first += 1
                for b in range(max(first, a + 1), starts[other + 1]):
                    j = order[b]
                    if points[j, X] > x + farthest + 2.0:
                        break
                    _vote(points, weight, i, j, nearest, farthest, votes)
    return votes


@kernel
def _vote(points: Floats, weight: Floats, i: int, j: int, nearest: float, farthest: float, votes: Floats) -> None:
    opposed = points[i, NX] * points[j, NX] + points[i, NY] * points[j, NY]
    if opposed > OPPOSITE:
        return
    dx, dy = points[j, X] - points[i, X], points[j, Y] - points[i, Y]
    distance = math.sqrt(dx * dx + dy * dy)
    if distance < nearest or distance > farthest:
        return
    one = (dx * points[i, NX] + dy * points[i, NY]) / distance
    other = -(dx * points[j, NX] + dy * points[j, NY]) / distance
    if one * other < 0.4:
        return
    value = -opposed * one * other * min(weight[i], weight[j])
    _add(votes, 0.5 * (points[i, X] + points[j, X]), 0.5 * (points[i, Y] + points[j, Y]), value)


@kernel
def triangle_votes(points: Floats, rows: int, cols: int, radius: float, direction: float) -> Floats:
    """Accumulate the middles of the upright triangles of which two points lie on two sides.

    Parameters
    ----------
    points : (n, 5) float32
        Edge points.
    rows, cols : int
        Size of the picture's piece [px].
    radius : float
        Half of the triangles' width [px].
    direction : float
        1 with the tip up, −1 with the tip down.

    Returns
    -------
    (rows, cols) float32
        Votes for the middle between tip and base; see `pair_votes` for their weight.
    """
    votes = np.zeros((rows, cols), np.float32)
    n = points.shape[0]
    side, polarity = np.full(n, -1, np.int64), np.zeros(n)
    for i in range(n):
        for k in range(3):
            along = points[i, NX] * _SIDES[k][0] + points[i, NY] * _SIDES[k][1] * direction
            if abs(along) > _ALIGNED:
                side[i], polarity[i] = k, 1.0 if along > 0.0 else -1.0
    inner, lift = radius / math.sqrt(3.0), radius * (0.5 * math.sqrt(3.0) - 1.0 / math.sqrt(3.0))
    for i in range(n):
        if side[i] < 0:
            continue
        ax, ay = _SIDES[side[i]][0], _SIDES[side[i]][1] * direction
        for j in range(i + 1, n):
            if side[j] < 0 or side[j] == side[i] or polarity[i] != polarity[j]:
                continue
            bx, by = _SIDES[side[j]][0], _SIDES[side[j]][1] * direction
            # The middle of the inscribed circle lies as far inside both sides.
            p = points[i, X] * ax + points[i, Y] * ay - inner
            q = points[j, X] * bx + points[j, Y] * by - inner
            area = ax * by - ay * bx
            x, y = (p * by - q * ay) / area, (ax * q - bx * p) / area
            beside = -(points[i, X] - x) * ay + (points[i, Y] - y) * ax
            other = -(points[j, X] - x) * by + (points[j, Y] - y) * bx
            if abs(beside) < radius and abs(other) < radius:
                _add(votes, x, y - lift * direction, min(math.log1p(points[i, SNR]), math.log1p(points[j, SNR])))
    return votes


@kernel
def _add(votes: Floats, x: float, y: float, value: float) -> None:
    """Share a vote between the four pixels around its place."""
    col, row = math.floor(x), math.floor(y)
    if 0 <= row < votes.shape[0] - 1 and 0 <= col < votes.shape[1] - 1:
        right, down = x - col, y - row
        votes[row, col] += value * (1.0 - right) * (1.0 - down)
        votes[row, col + 1] += value * right * (1.0 - down)
        votes[row + 1, col] += value * (1.0 - right) * down
        votes[row + 1, col + 1] += value * right * down


@kernel
def peaks(votes: Floats, box: tuple[float, float, float, float], apart: int, least: float, most: int) -> Floats:
    """Largest sums of 3 × 3 votes within a box, none the neighbour of a larger one, the largest first.

    Parameters
    ----------
    votes : (rows, cols) float32
        Votes.
    box : tuple of float
        First and last column, first and last row in which middles are looked for [px].
    apart : int
        Rows and columns within which only the largest counts.
    least : float
        Least sum.
    most : int
        How many at most.

    Returns
    -------
    (n, 3) float32
        Place (x, y) by the centre of the 3 × 3 votes [px], and their sum.
    """
    rows, cols = votes.shape
    sums = np.zeros_like(votes)
    for row in range(1, rows - 1):
        for col in range(1, cols - 1):
            total = np.float32(0.0)
            for i in range(row - 1, row + 2):
                for j in range(col - 1, col + 2):
                    total += votes[i, j]
            sums[row, col] = total
    found = np.empty((most, 3), np.float32)
    count = 0
    for row in range(max(math.ceil(box[2]), 1), min(int(box[3]), rows - 2) + 1):
        for col in range(max(math.ceil(box[0]), 1), min(int(box[1]), cols - 2) + 1):
            here = sums[row, col]
            if here < least or (count == most and here <= found[most - 1, 2]) or not _is_peak(sums, row, col, apart):
                continue
            place = min(count, most - 1)
            while place > 0 and found[place - 1, 2] < here:
                found[place] = found[place - 1]
                place -= 1
            found[place, 0], found[place, 1] = _middle(votes, row, col)
            found[place, 2] = here
            count = min(count + 1, most)
    return found[:count].copy()


@kernel
def _is_peak(sums: Floats, row: int, col: int, apart: int) -> bool:
    here = sums[row, col]
    for i in range(max(row - apart, 0), min(row + apart + 1, sums.shape[0])):
        for j in range(max(col - apart, 0), min(col + apart + 1, sums.shape[1])):
            if sums[i, j] > here or (sums[i, j] == here and (i < row or (i == row and j < col))):
                return False
    return True


@kernel
def _middle(votes: Floats, row: int, col: int) -> tuple[float, float]:
    total = x = y = 0.0
    for i in range(row - 1, row + 2):
        for j in range(col - 1, col + 2):
            total += votes[i, j]
            x += votes[i, j] * j
            y += votes[i, j] * i
    return x / total, y / total
