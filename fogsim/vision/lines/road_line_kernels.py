"""Compiled search for the lines along a road: edges of single rows, and the point in which straight lines meet."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel
from fogsim.linear_algebra import inverse_of, times
from fogsim.vision.light.medians import median_of_few
from fogsim.vision.light.pixel_kernels import row_luminance

RISING, FALLING, RIDGE = 0, 1, 2
"""Kinds of points: edges to the brighter and to the darker side, and the middle of a narrow bright stripe."""

NARROW = 5.5
"""Width up to which a bright stripe is one point [px]: blurred together, its edges seem further apart than they are."""

EDGE_IN_NOISE = 6.0
"""Least gradient of an edge, in deviations of the row's own gradients [-]."""

SAMPLED = 64
"""Gradients of a row that show how much they scatter, as many from either side."""

LEAST_GRADIENT = 0.7
"""Least gradient of an edge [linear grey levels per px]."""

REACH, SMOOTHING = 4, 1.3
"""Half-width of the derivative's kernel, and deviation of the Gaussian that it is the derivative of [px]."""

MOST_A_ROW, MOST_POINTS = 48, 4000
"""Points that are kept of a row, and of an image."""

KINDS = 3
"""How many kinds of points there are."""

LEAST_POINTS, LEAST_TURN = 10.0, 0.4
"""Fewest points of a line, and least difference of two lines' slopes for their crossing to say anything [-]."""

LEAST_SCATTER, ALIKE, CROOKED = 0.12, 3.0, 0.12
"""Least deviation of a point from its line [px], how many neighbouring points err together, and by how much a line
that was painted straight is none [px]."""


@kernel
def row_points(
    pixels: NDArray[np.uint8] | NDArray[np.uint16], tables: NDArray[np.float32], rows: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points of rows where the luminance changes sharply along the row, to a fraction of a pixel.

    Each row is looked at alone: what fog does from row to row moves no edge within it.

    Parameters
    ----------
    pixels : (rows, cols, channels) uint8 or uint16
        The image.
    tables : (channels, levels) float32
        Linear grey levels that each channel adds.
    rows : (n,) int64
        Which rows.

    Returns
    -------
    tuple of (m, 2) float64 and (m,) int64
        Column and row of each point [px], and its kind.
    """
    cols = pixels.shape[1]
    place, kind = np.empty((MOST_POINTS, 2)), np.empty(MOST_POINTS, np.int64)
    line, slope = np.zeros(cols, np.float32), np.zeros(cols, np.float32)
    tap = np.arange(REACH + 1).astype(np.float64)
    weight = tap * np.exp(-0.5 * (tap / SMOOTHING) ** 2)
    weight = weight / (2.0 * (weight * tap).sum())
    w1, w2, w3, w4 = np.float32(weight[1]), np.float32(weight[2]), np.float32(weight[3]), np.float32(weight[4])
    # Views that start at each tap: indices that cannot be negative let the loop be vectorised.
    l4, l3, l2, l1 = line, line[1:], line[2:], line[3:]
    r1, r2, r3, r4 = line[5:], line[6:], line[7:], line[8:]
    inner = slope[REACH:]
    edge, sign = np.empty(MOST_A_ROW), np.empty(MOST_A_ROW, np.int64)
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
        while i < found and count < MOST_POINTS:
            stripe = i + 1 < found and sign[i] > 0 and sign[i + 1] < 0 and edge[i + 1] - edge[i] < NARROW
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
    sample, ordered = np.empty(SAMPLED, np.float32), np.empty(SAMPLED, np.float32)
    step = max((cols - 2 * REACH) // SAMPLED, 1)
    for i in range(SAMPLED // 2):
        sample[2 * i] = abs(slope[min(REACH + i * step, cols - 1)])
        sample[2 * i + 1] = abs(slope[max(cols - 1 - REACH - i * step, 0)])
    middle = median_of_few(sample, ordered)
    least = np.float32(max(EDGE_IN_NOISE * middle / 0.6745, LEAST_GRADIENT))
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
        bend = before - 2.0 * here + behind
        edge[found] = col + (0.5 * (before - behind) / bend if bend < 0.0 else 0.0)
        sign[found] = 1 if rising else -1
        found += 1
    return found


@kernel
def vote(
    across: NDArray[np.float64],
    below: NDArray[np.float64],
    kind: NDArray[np.int64],
    offsets: NDArray[np.float64],
    slopes: NDArray[np.float64],
    most: int,
    least: int,
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Straight lines that many points of one kind lie on (Hough's transform), the ones with most points first.

    Parameters
    ----------
    across, below : (m,) float64
        Columns and rows of the points from the expected vanishing point [px].
    kind : (m,) int64
        Their kinds.
    offsets : (b,) float64
        Columns from there at which lines may cross the expected horizon [px], evenly.
    slopes : (s,) float64
        Middles of the cells for slopes, columns per row [-], evenly.
    most, least : int
        Most lines, and fewest points of one.

    Returns
    -------
    tuple of (n, 2) float64 and (n,) int64
        Offset [px] and slope of each line, and its kind.
    """
    cells = np.zeros((KINDS, offsets.size, slopes.size), np.int16)
    step, width = slopes[1] - slopes[0], offsets[1] - offsets[0]
    for i in range(across.size):
        _cast(cells[kind[i]], across[i], below[i], offsets, slopes, 1)
    lines, kinds, free = np.empty((most, 2)), np.empty(most, np.int64), np.ones(across.size, np.bool_)
    # Votes only ever get fewer, so that a row's last maximum bounds it: only rows that may hold the best are looked at.
    table = cells.reshape(KINDS * offsets.size, slopes.size)
    bound, place = np.full(table.shape[0], np.iinfo(np.int16).max, np.int16), np.zeros(table.shape[0], np.int64)
    for line in range(most):
        best = _middle_argmax(bound, offsets.size)
        while True:
            place[best] = _middle_argmax(table[best], slopes.size)
            if table[best, place[best]] == bound[best]:
                break
            bound[best] = table[best, place[best]]
            best = _middle_argmax(bound, offsets.size)
        if bound[best] < least:
            return lines[:line].copy(), kinds[:line].copy()
        which = best // offsets.size
        offset, slope = offsets[best % offsets.size], slopes[place[best]]
        lines[line, 0], lines[line, 1], kinds[line] = offset, slope, which
        # What lies on this line votes for no other.
        for i in range(across.size):
            near = abs(across[i] - offset - slope * below[i]) <= width + step * below[i]
            if free[i] and kind[i] == which and near:
                free[i] = False
                _cast(cells[which], across[i], below[i], offsets, slopes, -1)
    return lines, kinds


@kernel
def _middle_argmax(values: NDArray[np.int16], size: int) -> int:
    """Place of the largest of numbers that come in groups of `size`: of equals that nearest to its group's middle.

    Mirrored images then have mirrored lines.
    """
    most, best, aside = values.max(), 0, 2 * size
    for i in range(values.size):
        if values[i] == most:
            here = abs(2 * (i % size) - size + 1)
            if here < aside:
                best, aside = i, here
    return best


@kernel
def _cast(
    cells: NDArray[np.int16],
    across: float,
    below: float,
    offsets: NDArray[np.float64],
    slopes: NDArray[np.float64],
    votes: int,
) -> None:
    unit = 1.0 / (slopes[1] - slopes[0])
    for j in range(offsets.size):
        cell = math.floor(((across - offsets[j]) / below - slopes[0]) * unit + 0.5)
        if 0 <= cell < slopes.size:
            cells[j, cell] += votes


@kernel
def straighten(
    across: NDArray[np.float64],
    below: NDArray[np.float64],
    kind: NDArray[np.int64],
    lines: NDArray[np.float64],
    kinds: NDArray[np.int64],
    reach: float,
) -> NDArray[np.float64]:
    """Fit each line to the points of its kind near it.

    Returns
    -------
    (n, 3) float64
        Offset [px], slope, and how many points that is of; 0 of lines that have too few, or too near to one another.
    """
    out = np.zeros((lines.shape[0], 3))
    for line in range(lines.shape[0]):
        offset, slope, count, near = lines[line, 0], lines[line, 1], 0.0, reach
        for _ in range(3):
            n, sy, sx, syy, sxy = 0.0, 0.0, 0.0, 0.0, 0.0
            low, high = np.inf, 0.0
            for i in range(across.size):
                y, x = below[i], across[i]
                if kind[i] != kinds[line] or abs(x - offset - slope * y) > near:
                    continue
                n, sy, sx, syy, sxy = n + 1.0, sy + y, sx + x, syy + y * y, sxy + x * y
                # Points come by row: one or two that are not of the line make it no longer.
                low, high = y if n <= 3.0 else low, y
            spread = syy - sy * sy / max(n, 1.0)
            count = n
            # A line is known by points near and far.
            if n < LEAST_POINTS or high < 1.35 * low or spread <= 0.0:
                count = 0.0
                break
            slope = (sxy - sy * sx / n) / spread
            offset = (sx - slope * sy) / n
            near = max(0.5 * near, 2.0)
        out[line, 0], out[line, 1], out[line, 2] = offset, slope, count
    return out


@kernel
def agreeing(lines: NDArray[np.float64], tolerance: float, most: float) -> tuple[float, float, float]:
    """Point near the expected one through which lines with most points pass: offset, row and those points."""
    best_offset, best_row, best = 0.0, 0.0, 0.0
    for i in range(lines.shape[0]):
        for j in range(i):
            turn = lines[i, 1] - lines[j, 1]
            if lines[i, 2] == 0.0 or lines[j, 2] == 0.0 or abs(turn) < LEAST_TURN:
                continue
            row = -(lines[i, 0] - lines[j, 0]) / turn
            if abs(row) > most:
                continue
            offset = lines[i, 0] + lines[i, 1] * row
            total = 0.0
            for m in range(lines.shape[0]):
                if abs(lines[m, 0] + lines[m, 1] * row - offset) <= tolerance:
                    total += lines[m, 2]
            # Of points that are about as good, the one nearer to the expected row.
            total *= 1.0 - 0.3 * abs(row) / most
            if total > best:
                best_offset, best_row, best = offset, row, total
    return best_offset, best_row, best


@kernel
def meet(  # noqa: C901, PLR0912, PLR0915 - one iteration of a solver, which shares all its arrays
    across: NDArray[np.float64],
    below: NDArray[np.float64],
    kind: NDArray[np.int64],
    slopes: NDArray[np.float64],
    kinds: NDArray[np.int64],
    offset: float,
    row: float,
    bend_deviation: float,
) -> tuple[float, float, float, int, float]:
    """Least squares of all lines at once: they meet in one point and bend alike.

    A line along a road of constant curvature is u = u_h + s (v − v_h) + c / (v − v_h), with the same c for all lines.

    Parameters
    ----------
    across, below, kind : (m,)
        The points.
    slopes, kinds : (n,)
        The lines.
    offset, row : float
        Where they meet, from the expected vanishing point [px].
    bend_deviation : float
        Deviation of c [px²].

    Returns
    -------
    tuple
        Offset and row of the point [px], variance of the row [px²], number of lines, and range of their slopes [-].
    """
    lines = slopes.size
    size = 3 + lines
    slope, bend, reach = slopes.copy(), 0.0, 3.0
    scatter, number = np.full(lines, 0.5), np.zeros(lines)
    inverse: NDArray[np.float64] = np.eye(size)
    which = np.empty(across.size, np.int64)
    for _ in range(5):
        squares, number = np.zeros(lines), np.zeros(lines)
        for i in range(across.size):
            which[i] = -1
            y = below[i] - row
            if y < 4.0:
                continue
            nearest = np.inf
            for m in range(lines):
                if kinds[m] == kind[i]:
                    apart = abs(across[i] - offset - slope[m] * y - bend / y)
                    if apart < min(nearest, max(4.0 * scatter[m], 0.6), reach):
                        nearest, which[i] = apart, m
            if which[i] >= 0:
                number[which[i]] += 1.0
                squares[which[i]] += nearest * nearest
        normal, right = np.zeros((size, size)), np.zeros(size)
        normal[2, 2] = 1.0 / bend_deviation**2
        right[2] = -bend / bend_deviation**2
        for m in range(lines):
            normal[3 + m, 3 + m] = 1e-3
            if number[m] >= LEAST_POINTS:
                scatter[m] = math.sqrt(squares[m] / number[m])
            weight = 1.0 / (ALIKE * max(scatter[m], LEAST_SCATTER) ** 2 + number[m] * CROOKED**2)
            if number[m] < LEAST_POINTS:
                weight = 0.0
            n00, n01, n02, n0s, n11, n12, n1s, n22, n2s, nss = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            r0, r1, r2, rs = 0.0, 0.0, 0.0, 0.0
            for i in range(across.size):
                if which[i] != m:
                    continue
                y = below[i] - row
                residual = across[i] - offset - slope[m] * y - bend / y
                by_row, by_bend = -slope[m] + bend / (y * y), 1.0 / y
                n00, n01, n02, n0s = n00 + 1.0, n01 + by_row, n02 + by_bend, n0s + y
                n11, n12, n1s = n11 + by_row * by_row, n12 + by_row * by_bend, n1s + by_row * y
                n22, n2s, nss = n22 + by_bend * by_bend, n2s + by_bend * y, nss + y * y
                r0, r1, r2, rs = r0 + residual, r1 + by_row * residual, r2 + by_bend * residual, rs + y * residual
            s = 3 + m
            normal[0, 0] += weight * n00
            normal[0, 1] += weight * n01
            normal[0, 2] += weight * n02
            normal[1, 1] += weight * n11
            normal[1, 2] += weight * n12
            normal[2, 2] += weight * n22
            normal[0, s], normal[1, s], normal[2, s] = weight * n0s, weight * n1s, weight * n2s
            normal[s, s] += weight * nss
            right[0] += weight * r0
            right[1] += weight * r1
            right[2] += weight * r2
            right[s] = weight * rs
        normal[0, 0] += 1e-6
        normal[1, 1] += 1e-3
        for a in range(size):
            for b in range(a):
                normal[a, b] = normal[b, a]
        inverse = inverse_of(normal)
        step = times(inverse, right)
        offset, row, bend = offset + step[0], row + min(max(step[1], -5.0), 5.0), bend + step[2]
        slope += step[3:]
        reach = max(0.6 * reach, 1.0)
    low, high, used = np.inf, -np.inf, 0
    for m in range(lines):
        if number[m] >= LEAST_POINTS:
            low, high, used = min(low, slope[m]), max(high, slope[m]), used + 1
    return offset, row, float(inverse[1, 1]), used, high - low
