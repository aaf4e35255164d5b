"""Lane lines by a Hough transform of limited angle, to a fraction of a pixel, and their vanishing point."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from fogsim.linear_algebra import matrix_product, straight_line
from fogsim.vision.lines.vanishing_point import VanishingPoint, crossings, nearest_point, residual_scale, sloped_lines

Floats = NDArray[np.float64]

HALVES = (1.0, -1.0)
"""Sign of du/dv of the lines left and right of the vanishing point turned by: lines are sought in each half alone."""

REACH = 2.0
"""Distance from a Hough line within which edges belong to it [px]; its cells are 1 px by 1°."""

CLEAR_OF_VANISHING_POINT = 22.0
"""Rows below the horizon from which edges are used for refinement; nearer, those of different lines merge [px]."""

LEAST_PIXELS = 12
"""Fewest edge pixels that make a line."""

EDGE_DEVIATION = 0.15
"""Standard deviation of an edge's refined column [px]."""


@dataclass(frozen=True, slots=True)
class LaneLine:
    """A straight line u = offset + slope · v in the image."""

    slope: float  # du/dv [-]
    offset: float  # Its column at row 0 [px]
    votes: int  # Edge pixels on it
    # centre, spread: mean and root of the summed square deviation of its edges' rows [px]
    centre: float
    spread: float

    def column(self, row: float) -> float:
        """Column of the line.

        Returns [px]. Takes `row` [px].
        """
        return self.offset + self.slope * row


def hough_lines(
    edges: NDArray[np.uint8], first_row: int, lowest_angle: float, most: int = 1, steepest_angle: float = 0.5 * math.pi
) -> list[LaneLine]:
    """Longest lines of an edge image in either half of the angles (zhu2015 section 3.2, huang2015 section 4.2.3).

    Cells are 1 px by 1°, as published, so slope and offset are those of a cell's middle.

    Takes `edges` (rows, cols) uint8, `lowest_angle`, `steepest_angle` [rad].
    """
    lower = np.ascontiguousarray(edges[first_row:])
    threshold = max(LEAST_PIXELS, lower.shape[0] // 12)
    found = []
    # OpenCV's angle is that of the normal: 0 for an upright line, π/2 for one along the rows.
    low, high = 0.5 * math.pi - steepest_angle, 0.5 * math.pi - lowest_angle
    for side in HALVES:
        # Its cells are not the same to both sides: the lines of the other half are sought in the mirrored image.
        half = lower if side > 0 else np.ascontiguousarray(lower[:, ::-1])
        peaks: NDArray[Any] | None = cv2.HoughLinesWithAccumulator(
            half, 1.0, math.radians(1.0), threshold, min_theta=low, max_theta=high
        )
        for radius, angle, votes in [] if peaks is None else peaks.reshape(-1, 3)[:most]:
            cosine, sine = math.cos(float(angle)), math.sin(float(angle))
            if abs(cosine) < 1e-3:
                continue
            slope = -sine / cosine
            offset = float(radius) / cosine - slope * first_row
            if side < 0:
                slope, offset = -slope, edges.shape[1] - 1 - offset
            found.append(LaneLine(slope, offset, int(votes), 0.0, 0.0))
    return found


def refined_lines(
    lines: list[LaneLine], edges: NDArray[np.uint8], luminance: NDArray[np.float32], first_row: int
) -> list[LaneLine]:
    """Fit each line to the edges near it to a fraction of a pixel: a correction of both papers' whole cells.

    An edge's column is where the horizontal gradient peaks (parabola through three pixels); only edges of the line's
    own polarity count, for a marking has a bright and a dark side.

    Takes `edges` (rows, cols) uint8, `luminance` (rows, cols).
    """
    # Edges of a gradient against the rows cannot be placed within a row.
    points = _edge_points(edges, luminance, first_row)
    found: list[LaneLine] = []
    for line in lines:
        fitted = _fitted(line, points)
        if fitted is not None and not any(_same(fitted, other, first_row, luminance.shape[0]) for other in found):
            found.append(fitted)
    return found


def _same(line: LaneLine, other: LaneLine, top: int, bottom: int) -> bool:
    return all(abs(line.column(row) - other.column(row)) < 1.0 for row in (top, bottom))


@dataclass(frozen=True, slots=True)
class _EdgePoints:
    column: Floats
    row: Floats
    gradient: Floats


def _edge_points(edges: NDArray[np.uint8], luminance: NDArray[np.float32], first_row: int) -> _EdgePoints:
    rows, cols = np.nonzero(edges[first_row:, 3:-3])
    rows, cols = rows + first_row, cols + 3
    # Central differences at the edge and next to it.
    left, here, right = (luminance[rows, cols + i + 1] - luminance[rows, cols + i - 1] for i in (-1, 0, 1))
    sign = np.sign(here)
    bend = sign * (left - 2.0 * here + right)
    peak = bend < 0
    shift = np.where(peak, 0.5 * sign * (left - right) / np.where(peak, bend, 1.0), 0.0)
    good = peak & (np.abs(shift) <= 1.0)
    return _EdgePoints(
        (cols + shift)[good].astype(np.float64), rows[good].astype(np.float64), here[good].astype(np.float64)
    )


def _fitted(line: LaneLine, points: _EdgePoints) -> LaneLine | None:
    # The distance is across the line, of which the offset along a row is longer.
    reach = REACH * math.hypot(1.0, line.slope)
    apart = np.abs(points.column - line.offset - line.slope * points.row)
    rising = float(points.gradient[apart < reach].sum()) > 0
    # A wider pool lets the line turn within its Hough cell.
    pool = (apart < 2.0 * reach) & ((points.gradient > 0) == rising)
    rows, cols, kept = points.row[pool], points.column[pool], apart[pool] < reach
    fit = None
    for _ in range(5):
        fit = _least_squares(rows[kept], cols[kept])
        if fit is None:
            return None
        residual = np.abs(cols - fit.offset - fit.slope * rows)
        kept = residual < min(max(2.5 * 1.4826 * float(np.median(residual[kept])), 0.5), reach)
    return fit


def _least_squares(rows: Floats, cols: Floats) -> LaneLine | None:
    if rows.size < LEAST_PIXELS:
        return None
    centre = float(rows.mean())
    spread = float(matrix_product(rows - centre, rows - centre))
    if spread < LEAST_PIXELS**3 / 12.0:
        return None
    slope, offset = straight_line(rows, cols)
    return LaneLine(slope, offset, rows.size, centre, math.sqrt(spread))


def longest_pair(lines: Sequence[LaneLine]) -> tuple[LaneLine, LaneLine] | None:
    """Longest line left and right of the vanishing point, of lines in order of length; None if a side has none."""
    left, right = (next((line for line in lines if side * line.slope < 0), None) for side in HALVES)
    return None if left is None or right is None else (left, right)


def published_vanishing_point(lines: list[LaneLine]) -> VanishingPoint | None:
    """Intersection of the longest line of either half, as published.

    Returns None if a half has no line; its deviation is that of 1° and 1 px at either line.
    """
    pair = longest_pair(lines)
    if pair is None:
        return None
    first, second = pair
    both = sloped_lines([first.offset, second.offset], [first.slope, second.slope])
    row = float(crossings(both, np.zeros(1, np.int64), np.ones(1, np.int64), 0.0)[0, 1])
    return VanishingPoint(first.column(row), row, 15.0, 2, first.votes + second.votes)


def lane_vanishing_point(
    lines: list[LaneLine], expected: tuple[float, float], tolerance: float
) -> VanishingPoint | None:
    """Least-squares intersection of the lines that pass near where the calibration expects it.

    Returns None if fewer than two lines of different slope meet there. Takes `expected` [px], `tolerance` [px].
    """
    kept = [line for line in lines if abs(line.column(expected[1]) - expected[0]) < tolerance * (3.0 + abs(line.slope))]
    for _ in range(4):
        if len(kept) < 2 or np.ptp([line.slope for line in kept]) < 0.5:
            return None
        point, covariance, residual = _intersection(kept)
        worst = int(np.argmax(np.abs(residual)))
        if abs(residual[worst]) < 3.0:
            break
        del kept[worst]
    else:
        return None
    if abs(point[1] - expected[1]) > tolerance:
        return None
    deviation = residual_scale(residual) * math.sqrt(covariance[1, 1])
    return VanishingPoint(float(point[0]), float(point[1]), deviation, len(kept), sum(line.votes for line in kept))


def _intersection(kept: list[LaneLine]) -> tuple[Floats, Floats, Floats]:
    """Point, its covariance, and each line's standardised residual."""
    slope = np.array([line.slope for line in kept])
    lines = sloped_lines([line.offset for line in kept], slope)
    row = float(np.median([line.centre - line.spread for line in kept]))
    for _ in range(2):
        # Variance of a fitted line's column at the row of the intersection, and 0.2 px that lines are not straight by.
        variance = np.array([EDGE_DEVIATION**2 * (1 / n.votes + ((row - n.centre) / n.spread) ** 2) for n in kept])
        weight = 1.0 / (variance * (1.0 + slope**2) + 0.04)
        point, covariance = nearest_point(lines, weight)
        row = float(point[1])
    return point, covariance, lines.misses(point) * np.sqrt(weight)
