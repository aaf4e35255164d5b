"""The vanishing point of straight lines: where they cross, which crossing most of them support, which point fits all.

How lines are found, and which of them count, is what the methods differ in: `lane_lines` (zhu2015, huang2015),
`gradient_lines` (negru2013), `road_lines` (near an assumed calibration) and `segments` (an unknown camera)
each have a function ``…_vanishing_point``.
"""

import functools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogsim.core.jit import kernel
from fogsim.core.linear_algebra import inverse_of, matrix_product
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
