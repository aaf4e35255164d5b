"""Edges of a part of an image as points between pixels, each with its direction, and their votes for centres."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

Floats = NDArray[np.float32]
Picture = NDArray[np.uint8] | NDArray[np.uint16] | NDArray[np.float32]

X, Y, NX, NY, _SNR = range(5)
"""Columns of edge points: place [px], unit gradient [-], gradient over its noise [-]."""


@kernel
def shrunk(image: Picture, top: int, left: int, rows: int, cols: int, factor: int) -> Floats:
    """Cut a piece out of a picture, each value the mean over a square of pixels.

    Returns their means (channels, rows, cols). Takes `image` (all rows, all cols, channels) uint8, `top`, `left` [px],
    `factor` [px].
    """
    piece = np.empty((image.shape[2], rows, cols), np.float32)
    share = np.float32(1.0 / (factor * factor))
    for row in range(rows):
        for col in range(cols):
            for channel in range(image.shape[2]):
                total = np.float32(0.0)
                for i in range(top + row * factor, top + (row + 1) * factor):
                    for j in range(left + col * factor, left + (col + 1) * factor):
                        total += np.float32(image[i, j, channel])
                piece[channel, row, col] = total * share
    return piece


@kernel
def clearest_gradients(piece: Floats, share: float, least: float) -> tuple[Floats, Floats, Floats]:
    """Gradient of whichever channel shows it clearest above its own noise.

    Returns gradient along columns and rows and its length, over the standard deviation of a component by noise [-]
    (rows, cols). Takes `piece` (channels, rows, cols), `least` [1/px].
    """
    along, down, length = gradients(piece[0])
    _scale(along, down, length, 1.0 / _gradient_noise(length, share, least))
    for channel in range(1, piece.shape[0]):
        x, y, both = gradients(piece[channel])
        _scale(x, y, both, 1.0 / _gradient_noise(both, share, least))
        for row in range(length.shape[0]):
            for col in range(length.shape[1]):
                if both[row, col] > length[row, col]:
                    along[row, col], down[row, col] = x[row, col], y[row, col]
                    length[row, col] = both[row, col]
    return along, down, length


@kernel
def _scale(along: Floats, down: Floats, length: Floats, by: float) -> None:
    for row in range(length.shape[0]):
        for col in range(length.shape[1]):
            along[row, col] *= by
            down[row, col] *= by
            length[row, col] *= by


@kernel
def gradients(piece: Floats) -> tuple[Floats, Floats, Floats]:
    """Gradient by derivatives of a binomial window, of standard deviation 1 px across and 0.7 px along.

    Returns derivatives along columns and rows, and the length of both [1/px]; 0 within 2 px of the border (rows, cols).
    Takes `piece` (rows, cols).
    """
    rows, cols = piece.shape
    smooth, slope = np.zeros_like(piece), np.zeros_like(piece)
    sixteenth, eighth, two = np.float32(1 / 16), np.float32(1 / 8), np.float32(2.0)
    four, six = np.float32(4.0), np.float32(6.0)
    for row in range(2, rows - 2):
        for col in range(cols):
            a, b, c = piece[row - 2, col], piece[row - 1, col], piece[row, col]
            d, e = piece[row + 1, col], piece[row + 2, col]
            smooth[row, col] = (a + e + four * (b + d) + six * c) * sixteenth
            slope[row, col] = (e - a + two * (d - b)) * eighth
    along, down, length = np.zeros_like(piece), np.zeros_like(piece), np.zeros_like(piece)
    for row in range(2, rows - 2):
        for col in range(2, cols - 2):
            a, b, c = smooth[row, col - 2], smooth[row, col - 1], smooth[row, col + 1]
            gx = (smooth[row, col + 2] - a + two * (c - b)) * eighth
            gy = slope[row, col - 2] + slope[row, col + 2] + four * (slope[row, col - 1] + slope[row, col + 1])
            gy = (gy + six * slope[row, col]) * sixteenth
            along[row, col], down[row, col] = gx, gy
            length[row, col] = math.sqrt(gx * gx + gy * gy)
    return along, down, length


@kernel
def _gradient_noise(length: Floats, share: float, least: float) -> float:
    """Standard deviation of each component of the gradient by noise [1/px] (`length` (rows, cols), `least` [1/px])."""
    # A quarter of the pixels tells as well.
    inner = length[2:-2:2, 2:-2:2].copy().ravel()
    if inner.size == 0:
        return least
    # The quantile of a Rayleigh distribution says its scale.
    quantile = np.partition(inner, int(share * inner.size))[int(share * inner.size)]
    return max(float(quantile) / math.sqrt(-2.0 * math.log(1.0 - share)), least)


@kernel
def edge_points(along: Floats, down: Floats, length: Floats, least: float) -> tuple[Floats, NDArray[np.int32]]:
    """Ridges of the gradient, each placed between pixels by a parabola across it.

    Takes `along`, `down`, `length` (rows, cols).
    """
    rows, cols = length.shape
    number = np.full((rows, cols), -1, np.int32)
    points = np.empty((rows * cols, 5), np.float32)
    found = 0
    for row in range(3, rows - 3):
        for col in range(3, cols - 3):
            here = length[row, col]
            if here < least:
                continue
            gx, gy = along[row, col], down[row, col]
            nx, ny = gx / here, gy / here
            before, after = _interpolated(length, row - ny, col - nx), _interpolated(length, row + ny, col + nx)
            if before > here or after >= here:
                continue
            bend = before - 2.0 * here + after
            shift = 0.5 * (before - after) / bend if bend < 0.0 else 0.0
            points[found, X], points[found, Y] = col + shift * nx, row + shift * ny
            points[found, NX], points[found, NY], points[found, _SNR] = nx, ny, here
            number[row, col] = found
            found += 1
    return points[:found].copy(), number


@kernel
def _interpolated(values: Floats, row: float, col: float) -> float:
    i, j = int(row), int(col)
    down, right = row - i, col - j
    upper = values[i, j] * (1.0 - right) + values[i, j + 1] * right
    lower = values[i + 1, j] * (1.0 - right) + values[i + 1, j + 1] * right
    return float(upper * (1.0 - down) + lower * down)


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
    weight = np.log1p(points[:, _SNR])
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
                lines[n, 4], lines[n, 5], lines[n, 6] = y, math.log1p(points[i, _SNR]), math.copysign(1.0, along)
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
