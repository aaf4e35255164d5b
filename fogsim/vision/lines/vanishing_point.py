"""The vanishing point of straight lines: where they cross, which crossing most of them support, which point fits all.

Methods differ in how lines are found and which of them count: those of zhu2015, huang2015 and negru2013 as published
are here; `road_lines` looks near an assumed calibration, and `segments` needs none.
"""

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogsim.core.jit import kernel
from fogsim.core.linear_algebra import inverse_of, matrix_product
from fogsim.vision.lines.edges import Gradient, peak_offset
from fogsim.vision.lines.horizon import Horizon

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class VanishingPoint:
    """Where the lines along the road meet."""

    # column, row: in the image [px]
    column: float
    row: float
    row_deviation: float  # Standard deviation of the row [px]
    lines: int  # How many lines meet there
    support: float  # Edge pixels on these lines

    @property
    def horizon(self) -> Horizon:
        """The horizon on its row."""
        return Horizon(self.row, self.row_deviation)


class Lines(NamedTuple):
    """Straight lines n · (column, row) = c in the image."""

    normal: Floats  # (n, 2): Normals n, of any length: distances from a line are in units of one over it
    offset: Floats  # (n,): Right-hand sides c

    def misses(self, points: Floats) -> Floats:
        """By how much lines pass points: n · p − c.

        Returns In pixels where normals are unit vectors (n,). Takes `points` (2,) [px].
        """
        if points.ndim == 1:
            return matrix_product(self.normal, points) - self.offset
        return matrix_product(points, self.normal.T) - self.offset


def sloped_lines(offset: ArrayLike, slope: ArrayLike) -> Lines:
    """Lines column = offset + slope · row; their distances are measured along the rows.

    Takes `offset`, `slope` (n,) [px].
    """
    slope = np.asarray(slope, np.float64)
    return Lines(np.column_stack((np.ones_like(slope), -slope)), np.asarray(offset, np.float64))


@functools.cache
def all_pairs(count: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Both indices of every pair of so many lines, the first one's the larger."""
    first, second = np.tril_indices(count, -1)
    return first, second


@kernel
def crossings(lines: Lines, first: NDArray[np.int64], second: NDArray[np.int64], least_turn: float) -> Floats:
    """Points in which pairs of lines cross.

    Returns column and row [px]; NaN for lines nearer to parallel (m, 2). Takes `first`, `second` (m,) int64.
    """
    normal, offset = lines
    out = np.full((first.size, 2), np.nan)
    for m in range(first.size):
        i, j = first[m], second[m]
        a, b, c, d = normal[i, 0], normal[i, 1], normal[j, 0], normal[j, 1]
        turn = a * d - b * c
        if abs(turn) >= least_turn:
            out[m, 0] = (d * offset[i] - b * offset[j]) / turn
            out[m, 1] = (a * offset[j] - c * offset[i]) / turn
    return out


@kernel
def supports(lines: Lines, weight: Floats, points: Floats, reach: float) -> Floats:
    """Sum, for each point, the weights of the lines that pass it within reach.

    Returns the support of each point (m,). Takes `weight` (n,), `points` (m, 2) [px].
    """
    normal, offset = lines
    out = np.zeros(len(points))
    for m in range(len(points)):
        for i in range(offset.size):
            if abs(normal[i, 0] * points[m, 0] + normal[i, 1] * points[m, 1] - offset[i]) <= reach:
                out[m] += weight[i]
    return out


def nearest_point(lines: Lines, weight: Floats) -> tuple[Floats, Floats]:
    """Point of least squares to weighted lines.

    Returns column and row [px], and their covariance [px²] (2, 2). Takes `weight` (n,).
    """
    weighted = lines.normal * weight[:, None]
    covariance = inverse_of(matrix_product(weighted.T, lines.normal))
    return matrix_product(covariance, matrix_product(lines.normal.T, weight * lines.offset)), covariance


def residual_scale(residual: Floats) -> float:
    """Factor by which residuals scatter more than their deviations say; 1 at least (`residual` (n,))."""
    return max(1.0, math.sqrt(float(matrix_product(residual, residual)) / max(residual.size - 2, 1)))


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


_HALVES = (1.0, -1.0)
"""Sign of du/dv of the lines left and right of the vanishing point turned by: lines are sought in each half alone."""

_LEAST_PIXELS = 12
"""Fewest edge pixels that make a line."""


@dataclass(frozen=True, slots=True)
class LaneLine:
    """A straight line u = offset + slope · v in the image."""

    slope: float  # du/dv [-]
    offset: float  # Its column at row 0 [px]
    votes: int  # Edge pixels on it

    def column(self, row: float) -> float:
        """Column of the line.

        Returns [px]. Takes `row` [px].
        """
        return self.offset + self.slope * row


def hough_lines(edges: NDArray[np.uint8], first_row: int, lowest_angle: float) -> list[LaneLine]:
    """Longest line of an edge image in either half of the angles (zhu2015 section 3.2, huang2015 section 4.2.3).

    Cells are 1 px by 1°, as published, so slope and offset are those of a cell's middle.

    Takes `edges` (rows, cols) uint8, `lowest_angle` [rad].
    """
    lower = np.ascontiguousarray(edges[first_row:])
    threshold = max(_LEAST_PIXELS, lower.shape[0] // 12)
    found = []
    # OpenCV's angle is that of the normal: 0 for an upright line, π/2 for one along the rows.
    most = 0.5 * math.pi - lowest_angle
    for side in _HALVES:
        # Its cells are not the same to both sides: the lines of the other half are sought in the mirrored image.
        half = lower if side > 0 else np.ascontiguousarray(lower[:, ::-1])
        peaks: NDArray[Any] | None = cv2.HoughLinesWithAccumulator(
            half, 1.0, math.radians(1.0), threshold, min_theta=0.0, max_theta=most
        )
        for radius, angle, votes in [] if peaks is None else peaks.reshape(-1, 3)[:1]:
            cosine, sine = math.cos(float(angle)), math.sin(float(angle))
            if abs(cosine) < 1e-3:
                continue
            slope = -sine / cosine
            offset = float(radius) / cosine - slope * first_row
            if side < 0:
                slope, offset = -slope, edges.shape[1] - 1 - offset
            found.append(LaneLine(slope, offset, int(votes)))
    return found


def longest_pair(lines: Sequence[LaneLine]) -> tuple[LaneLine, LaneLine] | None:
    """Longest line left and right of the vanishing point, of lines in order of length; None if a side has none."""
    left, right = (next((line for line in lines if side * line.slope < 0), None) for side in _HALVES)
    return None if left is None or right is None else (left, right)


def published_vanishing_point(lines: list[LaneLine], first_row: int) -> VanishingPoint | None:
    """Intersection of the longest line of either half, as published, of an image that begins at a row of another.

    Returns None if a half has no line; its deviation is that of 1° and 1 px at either line.
    """
    pair = longest_pair(lines)
    if pair is None:
        return None
    first, second = pair
    both = sloped_lines([first.offset, second.offset], [first.slope, second.slope])
    row = float(crossings(both, np.zeros(1, np.int64), np.ones(1, np.int64), 0.0)[0, 1])
    return VanishingPoint(first.column(row), row + first_row, 15.0, 2, first.votes + second.votes)
