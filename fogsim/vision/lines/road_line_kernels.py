"""Edges of single rows and lines along a road through them: Hough's transform, and fits of each and of all lines."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.core.linear_algebra import inverse_of, times
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


Floats = NDArray[np.float64]

LEAST_POINTS, LEAST_TURN = 10.0, 0.4
"""Fewest points of a line, and least difference of two lines' slopes for their crossing to say anything [-]."""

LEAST_SCATTER, _ALIKE, _CROOKED = 0.12, 3.0, 0.12
"""Least deviation of a point from its line [px], how many neighbouring points err together, and by how much a line
that was painted straight is none [px]."""

_COLUMN, _ROW, BEND, _SLOPE = range(4)
"""Unknowns of the fit: the vanishing point [px], the bend [px²], and from the fourth on each line's slope [-]."""


class Points(NamedTuple):
    """Points of edges, by row."""

    # across, below (m,): columns and rows from the expected vanishing point [px]
    across: Floats
    below: Floats
    kind: NDArray[np.int64]  # (m,) int64: Their kinds: `RISING`, `FALLING` or `RIDGE`


class RoadLines(NamedTuple):
    """Straight lines across = offset + slope · below, the ones with most points first."""

    # offset, slope (n,): column at the expected horizon [px], and columns per row [-]
    offset: Floats
    slope: Floats
    kind: NDArray[np.int64]  # (n,) int64: Kind of their points
    points: Floats  # (n,): How many points they are of


@kernel
def chosen_lines(lines: RoadLines, mask: NDArray[np.bool_]) -> RoadLines:
    """Some of the lines (`mask` (n,) bool)."""
    return RoadLines(lines.offset[mask], lines.slope[mask], lines.kind[mask], lines.points[mask])


class RoadFit(NamedTuple):
    """Least squares of all lines at once."""

    # column, row: where they meet, from the expected vanishing point [px]
    column: float
    row: float
    variance: float  # Variance of the row [px²]
    lines: int  # How many lines have points enough
    span: float  # Range of their slopes [-]
    points: float  # How many points they are of


@kernel
def hough_road_lines(points: Points, offsets: Floats, slopes: Floats, most: int, least: int) -> RoadLines:
    """Straight lines that many points of one kind lie on (Hough's transform) (`offsets` (b,) [px], `slopes` (s,))."""
    across, below, kind = points
    cells = np.zeros((KINDS, offsets.size, slopes.size), np.int16)
    step, width = slopes[1] - slopes[0], offsets[1] - offsets[0]
    for i in range(across.size):
        _cast_votes(cells[kind[i]], across[i], below[i], offsets, slopes, 1)
    lines = RoadLines(np.empty(most), np.empty(most), np.empty(most, np.int64), np.empty(most))
    count, free = 0, np.ones(across.size, np.bool_)
    # Votes only ever get fewer, so that a row's last maximum bounds it: only rows that may hold the best are looked at.
    table = cells.reshape(KINDS * offsets.size, slopes.size)
    bound, place = np.full(table.shape[0], np.iinfo(np.int16).max, np.int16), np.zeros(table.shape[0], np.int64)
    while count < most:
        best = _middle_argmax(bound, offsets.size)
        while True:
            place[best] = _middle_argmax(table[best], slopes.size)
            if table[best, place[best]] == bound[best]:
                break
            bound[best] = table[best, place[best]]
            best = _middle_argmax(bound, offsets.size)
        if bound[best] < least:
            break
        which = best // offsets.size
        offset, slope = offsets[best % offsets.size], slopes[place[best]]
        lines.offset[count], lines.slope[count], lines.kind[count] = offset, slope, which
        lines.points[count] = bound[best]
        count += 1
        # What lies on this line votes for no other.
        for i in range(across.size):
            near = abs(across[i] - offset - slope * below[i]) <= width + step * below[i]
            if free[i] and kind[i] == which and near:
                free[i] = False
                _cast_votes(cells[which], across[i], below[i], offsets, slopes, -1)
    return _first_lines(lines, count)


@kernel
def _first_lines(lines: RoadLines, count: int) -> RoadLines:
    return RoadLines(
        lines.offset[:count].copy(), lines.slope[:count].copy(), lines.kind[:count].copy(), lines.points[:count].copy()
    )


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
def _cast_votes(
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
def refitted_lines(points: Points, lines: RoadLines, reach: float) -> RoadLines:
    """Fit each line to the points of its kind near it; lines of too few points, or of none far apart, are left out.

    Takes `reach` [px].
    """
    across, below, kind = points
    out, kept = _first_lines(lines, lines.slope.size), 0
    for line in range(lines.slope.size):
        offset, slope, count, near = lines.offset[line], lines.slope[line], 0.0, reach
        for _ in range(3):
            n, sy, sx, syy, sxy = 0.0, 0.0, 0.0, 0.0, 0.0
            low, high = np.inf, 0.0
            for i in range(across.size):
                y, x = below[i], across[i]
                if kind[i] != lines.kind[line] or abs(x - offset - slope * y) > near:
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
        if count > 0.0:
            out.offset[kept], out.slope[kept], out.kind[kept], out.points[kept] = offset, slope, lines.kind[line], count
            kept += 1
    return _first_lines(out, kept)


class _Fit(NamedTuple):
    """State of the fit: the unknowns, and of each line kind, deviation of its points [px] and how many they are."""

    unknown: Floats
    kind: NDArray[np.int64]
    scatter: Floats
    number: Floats


@kernel
def fit_road_lines(points: Points, lines: RoadLines, column: float, row: float, bend_deviation: float) -> RoadFit:
    """Least squares of all lines at once (Gauss–Newton): they meet in one point and bend alike.

    A line along a road of constant curvature is u = u_h + s (v − v_h) + c / (v − v_h), with the same c for all lines.

    Takes `column`, `row` [px], `bend_deviation` [px²].
    """
    count = lines.slope.size
    size = _SLOPE + count
    fit = _Fit(np.zeros(size), lines.kind, np.full(count, 0.5), np.zeros(count))
    unknown, reach = fit.unknown, 3.0
    unknown[_COLUMN], unknown[_ROW], unknown[_SLOPE:] = column, row, lines.slope
    inverse: Floats = np.eye(size)
    line_of = np.empty(points.across.size, np.int64)
    for _ in range(5):
        _assign_points(points, fit, reach, line_of)
        normal, right = np.zeros((size, size)), np.zeros(size)
        normal[BEND, BEND] = 1.0 / bend_deviation**2
        right[BEND] = -unknown[BEND] / bend_deviation**2
        for line in range(count):
            _add_equations(points, fit, line_of, line, normal, right)
        normal[_COLUMN, _COLUMN] += 1e-6
        normal[_ROW, _ROW] += 1e-3
        for a in range(size):
            for b in range(a):
                normal[a, b] = normal[b, a]
        inverse = inverse_of(normal)
        step = times(inverse, right)
        step[_ROW] = min(max(step[_ROW], -5.0), 5.0)
        unknown += step
        reach = max(0.6 * reach, 1.0)
    low, high, used, total = np.inf, -np.inf, 0, 0.0
    for line in range(count):
        if fit.number[line] >= LEAST_POINTS:
            low, high = min(low, unknown[_SLOPE + line]), max(high, unknown[_SLOPE + line])
            used, total = used + 1, total + fit.number[line]
    return RoadFit(unknown[_COLUMN], unknown[_ROW], float(inverse[_ROW, _ROW]), used, high - low, total)


@kernel
def _assign_points(points: Points, fit: _Fit, reach: float, line_of: NDArray[np.int64]) -> None:
    """Give each point to the nearest line of its kind within reach, −1 for none; count and scatter follow."""
    across, below, kind = points
    unknown, kinds, scatter, number = fit
    column, row, bend = unknown[_COLUMN], unknown[_ROW], unknown[BEND]
    squares = np.zeros(number.size)
    number[:] = 0.0
    for i in range(across.size):
        line_of[i] = -1
        y = below[i] - row
        if y < 4.0:
            continue
        nearest = np.inf
        for m in range(number.size):
            if kinds[m] == kind[i]:
                apart = abs(across[i] - column - unknown[_SLOPE + m] * y - bend / y)
                if apart < min(nearest, max(4.0 * scatter[m], 0.6), reach):
                    nearest, line_of[i] = apart, m
        if line_of[i] >= 0:
            number[line_of[i]] += 1.0
            squares[line_of[i]] += nearest * nearest
    for m in range(number.size):
        if number[m] >= LEAST_POINTS:
            scatter[m] = math.sqrt(squares[m] / number[m])


@kernel
def _add_equations(
    points: Points, fit: _Fit, line_of: NDArray[np.int64], line: int, normal: Floats, right: Floats
) -> None:
    """Add the normal equations of one line's points, above the diagonal."""
    across, below, _ = points
    column, row, bend, slope = fit.unknown[_COLUMN], fit.unknown[_ROW], fit.unknown[BEND], fit.unknown[_SLOPE + line]
    number, s = fit.number[line], _SLOPE + line
    normal[s, s] = 1e-3
    if number < LEAST_POINTS:
        return
    n00, n01, n02, n0s, n11, n12, n1s, n22, n2s, nss = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    r0, r1, r2, rs = 0.0, 0.0, 0.0, 0.0
    for i in range(across.size):
        if line_of[i] != line:
            continue
        y = below[i] - row
        residual = across[i] - column - slope * y - bend / y
        by_row, by_bend = -slope + bend / (y * y), 1.0 / y
        n00, n01, n02, n0s = n00 + 1.0, n01 + by_row, n02 + by_bend, n0s + y
        n11, n12, n1s = n11 + by_row * by_row, n12 + by_row * by_bend, n1s + by_row * y
        n22, n2s, nss = n22 + by_bend * by_bend, n2s + by_bend * y, nss + y * y
        r0, r1, r2, rs = r0 + residual, r1 + by_row * residual, r2 + by_bend * residual, rs + y * residual
    weight = 1.0 / (_ALIKE * max(fit.scatter[line], LEAST_SCATTER) ** 2 + number * _CROOKED**2)
    normal[_COLUMN, _COLUMN] += weight * n00
    normal[_COLUMN, _ROW] += weight * n01
    normal[_COLUMN, BEND] += weight * n02
    normal[_ROW, _ROW] += weight * n11
    normal[_ROW, BEND] += weight * n12
    normal[BEND, BEND] += weight * n22
    normal[_COLUMN, s], normal[_ROW, s], normal[BEND, s] = weight * n0s, weight * n1s, weight * n2s
    normal[s, s] += weight * nss
    right[_COLUMN] += weight * r0
    right[_ROW] += weight * r1
    right[BEND] += weight * r2
    right[s] = weight * rs
