"""Votes of pairs of edge points for the middle of what they are the outline of."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel
from fogsim.vision.symmetry.edge_kernels import NX, NY, SNR, X, Y

Floats = NDArray[np.float32]
Numbers = NDArray[np.int32]

OPPOSITE = -0.9
"""Largest cosine between two gradients that are opposite: within 26° [-]."""

_FACING = 0.4
"""Least product of the cosines between two gradients and the line through their points [-]."""

_SIDES = ((0.0, 1.0), (math.sqrt(0.75), -0.5), (-math.sqrt(0.75), -0.5))
"""Outward normals of an upright triangle with its tip up, row downward."""

_ALIGNED = 0.97
"""Least cosine between a gradient and the normal of a triangle's side: within 14° [-]."""


@kernel
def pair_votes(points: Floats, number: Numbers, nearest: float, farthest: float) -> Floats:
    """Accumulate the middles of pairs of points with opposite gradients along the line between them.

    Parameters
    ----------
    points, number
        See `fogsim.vision.symmetry.edge_kernels.edge_points`.
    nearest, farthest : float
        Distances between the two points of a pair [px].

    Returns
    -------
    (rows, cols) float32
        Votes, one place a pixel: one that counts fully comes from two points that face each other squarely, and weighs
        as the weaker of their gradients does on a logarithmic scale.
    """
    rows = number.shape[0]
    votes = np.zeros(number.shape, np.float32)
    starts = np.zeros(rows + 1, np.int64)
    for row in range(rows):
        starts[row + 1] = starts[row] + (number[row] >= 0).sum()
    x, y, nx, ny = points[:, X].copy(), points[:, Y].copy(), points[:, NX].copy(), points[:, NY].copy()
    weight = np.log1p(points[:, SNR])
    least, most = nearest * nearest, farthest * farthest
    for row in range(rows):
        for other in range(row, min(row + int(farthest) + 2, rows)):
            first = starts[other]
            for i in range(starts[row], starts[row + 1]):
                while first < starts[other + 1] and x[first] < x[i] - farthest - 1.0:
                    first += 1
                for j in range(max(first, i + 1), starts[other + 1]):
                    dx, dy = x[j] - x[i], y[j] - y[i]
                    if dx > farthest + 1.0:
                        break
                    square, opposed = dx * dx + dy * dy, nx[i] * nx[j] + ny[i] * ny[j]
                    if opposed > OPPOSITE or square < least or square > most:
                        continue
                    facing = -(dx * nx[i] + dy * ny[i]) * (dx * nx[j] + dy * ny[j]) / square
                    if facing > _FACING:
                        value = -opposed * facing * min(weight[i], weight[j])
                        _add(votes, 0.5 * (x[i] + x[j]), 0.5 * (y[i] + y[j]), value)
    return votes


@kernel
def triangle_votes(points: Floats, number: Numbers, radius: float, direction: float) -> Floats:
    """Accumulate the middles of the upright triangles of which two points lie on two sides.

    Parameters
    ----------
    points, number
        See `fogsim.vision.symmetry.edge_kernels.edge_points`.
    radius : float
        Half of the triangles' width [px].
    direction : float
        1 with the tip up, −1 with the tip down.

    Returns
    -------
    (rows, cols) float32
        Votes for the middle between tip and base; see `pair_votes` for their weight.
    """
    votes = np.zeros(number.shape, np.float32)
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
