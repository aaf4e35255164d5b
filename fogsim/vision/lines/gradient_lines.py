"""negru2013's vanishing point: Hough's transform of edges along their gradient, and random sample consensus."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.vision.lines.edges import Gradient, peak_offset
from fogsim.vision.lines.vanishing_point import Lines, VanishingPoint, all_pairs, crossings, supports

Floats = NDArray[np.float64]

_ANGLES, _OFFSET_STEP = 360, 2.0
"""Bins of the accumulator: directions of the gradient round the circle, and px between offsets."""

_MOST_POINTS = 8000
"""Edge pixels that are looked at."""

_SAMPLES = 48
"""Pairs of lines that are drawn: with 30 % good lines one pair is good with a probability of 0.99 (negru2013)."""

_PEAKS, _VOTES = 16, 30
"""Most lines that are taken from the accumulator, and fewest votes of one."""

_CONSENSUS = 5.0
"""Distance at which a line passes through a point in the choice of lines [px]."""

_SMALLEST_ANGLE = 0.15
"""Angle between two lines below which their crossing says little [rad]."""


def consensus_vanishing_point(
    gradient: Gradient, edges: NDArray[np.uint8], guess: tuple[float, float], reach: float
) -> VanishingPoint | None:
    """Find the vanishing point of the edges below a first guess (negru2013 section IV.B.a).

    Edges vote along their gradient for lines that pass within `reach` of the guess; the highest peaks are lines; of
    random pairs of lines that one is kept through whose crossing the most votes pass, and the centre of mass of the
    crossings of all that pass there is the answer. It is several pixels off; see `fogsim.vision.lines.road_lines`.

    Returns None if no two lines agree. Takes `edges` (rows, cols) uint8, `guess` [px], `reach` [px].
    """
    points = edge_points(gradient.across, gradient.down, edges, guess[0], guess[1])
    found, votes = hough_peaks(points, reach, _PEAKS, _VOTES)
    normal = np.array([(math.cos(angle), math.sin(angle)) for angle in found[:, 0]]).reshape(-1, 2)
    lines = Lines(normal, found[:, 1].copy())
    passing = _passing_lines(lines, votes)
    first, second = all_pairs(len(passing))
    crossed = crossings(lines, passing[first], passing[second], math.sin(_SMALLEST_ANGLE))
    crossed = crossed[~np.isnan(crossed[:, 0])]
    if not crossed.size:
        return None
    column, row = crossed.mean(axis=0)
    spread = float(crossed[:, 1].std()) if len(crossed) > 1 else _CONSENSUS
    score = float(votes[passing].sum())
    return VanishingPoint(guess[0] + float(column), guess[1] + float(row), max(spread, 1.0), len(passing), score)


def _passing_lines(lines: Lines, votes: Floats) -> NDArray[np.int64]:
    """Which lines pass the crossing of two that has the most votes."""
    count = len(votes)
    if count < 2:
        return np.empty(0, np.int64)
    # The same pairs for the same number of lines: an estimate is a function of the image.
    draws = np.random.default_rng(count).integers(0, count, (_SAMPLES, 2))
    crossed = crossings(lines, draws[:, 0].copy(), draws[:, 1].copy(), math.sin(_SMALLEST_ANGLE))
    best = crossed[int(np.argmax(supports(lines, votes, crossed, _CONSENSUS)))]
    return np.flatnonzero(np.abs(lines.misses(best)) <= _CONSENSUS)


@kernel
def edge_points(
    across: NDArray[np.float32], down: NDArray[np.float32], edges: NDArray[np.uint8], col: float, row: float
) -> Floats:
    """Edges below a point, placed within the pixel along the gradient.

    Returns column and row from the point [px], and direction of the gradient [rad] (n, 3). Takes `across`, `down`
    (rows, cols), `edges` (rows, cols) uint8, `col`, `row` [px].
    """
    rows, cols = edges.shape
    out = np.empty((_MOST_POINTS, 3))
    count = 0
    for v in range(max(int(row) + 8, 1), rows - 1):
        line = edges[v]
        for u in range(1, cols - 1):
            if line[u] == 0 or count == _MOST_POINTS:
                continue
            gx, gy = float(across[v, u]), float(down[v, u])
            size = math.hypot(gx, gy)
            # Level edges are bumpers, shadows and the fog's own gradient.
            if abs(gx) < 0.2 * size or size <= 0.0:
                continue
            sideways = abs(gx) >= abs(gy)
            if sideways:
                before = math.hypot(across[v, u - 1], down[v, u - 1])
                behind = math.hypot(across[v, u + 1], down[v, u + 1])
            else:
                before = math.hypot(across[v - 1, u], down[v - 1, u])
                behind = math.hypot(across[v + 1, u], down[v + 1, u])
            shift = min(max(peak_offset(before, size, behind), -0.5), 0.5)
            out[count, 0] = u - col + (shift if sideways else 0.0)
            out[count, 1] = v - row + (0.0 if sideways else shift)
            out[count, 2] = math.atan2(gy, gx)
            count += 1
    return out[:count].copy()


@kernel
def hough_peaks(points: Floats, reach: float, most: int, least: int) -> tuple[Floats, Floats]:
    """Highest peaks of Hough's transform of edge points, each voting near the direction of its gradient.

    Returns direction θ of each line's normal [rad] and offset ρ [px] of u cos θ + v sin θ = ρ; votes (n,). Takes
    `points` (n, 3), `reach` [px].
    """
    offsets = int(2.0 * reach / _OFFSET_STEP) + 1
    cells = np.zeros((_ANGLES, offsets), np.int32)
    unit = 2.0 * math.pi / _ANGLES
    cosine, sine = np.cos(np.arange(_ANGLES) * unit), np.sin(np.arange(_ANGLES) * unit)
    for i in range(points.shape[0]):
        nearest = math.floor(points[i, 2] / unit + 0.5)
        for turn in range(-3, 4):
            angle = (nearest + turn) % _ANGLES
            rho = points[i, 0] * cosine[angle] + points[i, 1] * sine[angle]
            place = math.floor((rho + reach) / _OFFSET_STEP + 0.5)
            if 0 <= place < offsets:
                cells[angle, place] += 1
    lines, votes = np.empty((most, 2)), np.empty(most)
    count = 0
    for _ in range(most):
        best = np.argmax(cells)
        angle, place = best // offsets, best % offsets
        if cells[angle, place] < least:
            break
        lines[count, 0], lines[count, 1] = angle * unit, place * _OFFSET_STEP - reach
        votes[count] = cells[angle, place]
        count += 1
        for turn in range(-4, 5):
            for near in range(max(int(place) - 4, 0), min(int(place) + 5, offsets)):
                cells[(angle + turn) % _ANGLES, near] = 0
    return lines[:count].copy(), votes[:count].copy()
