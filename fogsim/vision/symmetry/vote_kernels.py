"""Votes of pairs of edge points for the middle of what they are the outline of."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.vision.symmetry.edge_kernels import NX, NY, SNR, X, Y

Floats = NDArray[np.float32]
Numbers = NDArray[np.int32]

_OPPOSITE = -0.9
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

    Returns votes, one place a pixel: one that counts fully comes from two points that face each other squarely, and
    weighs as the weaker of their gradients does on a logarithmic scale (rows, cols). Takes `nearest`, `farthest` [px].
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
                    if opposed > _OPPOSITE or square < least or square > most:
                        continue
                    facing = -(dx * nx[i] + dy * ny[i]) * (dx * nx[j] + dy * ny[j]) / square
                    if facing > _FACING:
                        value = -opposed * facing * min(weight[i], weight[j])
                        _add(votes, 0.5 * (x[i] + x[j]), 0.5 * (y[i] + y[j]), value)
    return votes


@kernel
def triangle_votes(points: Floats, number: Numbers, radii: Floats, direction: float) -> Floats:
    """Accumulate the middles of the upright triangles with two points on two sides.

    Returns votes for the middle between tip and base; see `pair_votes` for their weight (m, rows, cols). Takes `radii`
    (m,) [px].
    """
    votes = np.zeros((radii.size, *number.shape), np.float32)
    # Lines: normal of the side, place along it and across it, weight, direction of the gradient.
    lines, n = np.empty((points.shape[0], 7), np.float32), 0
    for i in range(points.shape[0]):
        for k in range(3):
            a, b = _SIDES[k][0], _SIDES[k][1] * direction
            along = points[i, NX] * a + points[i, NY] * b
            if abs(along) > _ALIGNED:
                x, y = points[i, X], points[i, Y]
                lines[n, 0], lines[n, 1], lines[n, 2], lines[n, 3] = a, b, x * a + y * b, y * a - x * b
                lines[n, 4], lines[n, 5], lines[n, 6] = y, math.log1p(points[i, SNR]), math.copysign(1.0, along)
                n += 1
    lift = 0.5 * math.sqrt(3.0) - 1.0 / math.sqrt(3.0)
    for i in range(n):
        for j in range(i + 1, n):
            if lines[j, 4] > lines[i, 4] + 2.0 * radii[-1]:
                break
            area = lines[i, 0] * lines[j, 1] - lines[i, 1] * lines[j, 0]
            if abs(area) < 0.5 or lines[i, 6] != lines[j, 6]:
                continue
            for k in range(radii.size):
                # The middle of the inscribed circle lies as far inside both sides.
                p, q = lines[i, 2] - radii[k] / math.sqrt(3.0), lines[j, 2] - radii[k] / math.sqrt(3.0)
                x, y = (p * lines[j, 1] - q * lines[i, 1]) / area, (lines[i, 0] * q - lines[j, 0] * p) / area
                one = lines[i, 3] - (y * lines[i, 0] - x * lines[i, 1])
                other = lines[j, 3] - (y * lines[j, 0] - x * lines[j, 1])
                if abs(one) < radii[k] and abs(other) < radii[k]:
                    _add(votes[k], x, y - lift * radii[k] * direction, min(lines[i, 5], lines[j, 5]))
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

    Returns place (x, y) by the centre of the 3 × 3 votes [px], and their sum. Takes `votes` (rows, cols), `box` [px].
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
