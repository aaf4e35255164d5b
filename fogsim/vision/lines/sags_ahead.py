"""Sags and crests that may begin farther on than the lines along a road show them."""

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import inverse_of, matrix_product
from fogsim.vision.lines.road_course_kernels import KNOTS, PIECES

Floats = NDArray[np.float64]

SAG_DEVIATION, SAG_LENGTH = 1.0 / 8000.0, 150.0
"""Standard deviation of vertical curvature where a road is curved [1/m], and the length over which it changes [m].
Least radii of crests and sags are 5000 … 13 000 m and 2600 … 8800 m on motorways, 3000 … 8000 m and 2000 … 4000 m on
roads outside towns (RAA 2008, RAL 2012; from memory)."""

BEGINS = 0.05
"""How likely it is that the road is straight up to a piece, and sags or crests from there on [-]: of a road's length a
third does, in stretches of 200 to 400 m."""


@dataclass(frozen=True, slots=True)
class SagsAhead:
    """What is known of vertical curvature ahead, if each piece of road may have some."""

    # (1 + pieces,): Row in which the road's tangent under the camera vanishes [px], and vertical curvature by piece,
    # positive in a sag [1/m]
    mean: Floats
    covariance: Floats  # (1 + pieces, 1 + pieces): Theirs [px², px/m, 1/m²]

    def row(self, sag: Floats) -> tuple[float, float]:
        """Row in which the tangent vanishes if the road is curved so, and its variance [px, px²].

        Takes `sag` (pieces,) [1/m].
        """
        gain = matrix_product(self.covariance[0, 1:], self._precision())
        row = self.mean[0] + float(matrix_product(gain, sag - self.mean[1:]))
        return row, max(float(self.covariance[0, 0] - matrix_product(gain, self.covariance[1:, 0])), 0.0)

    def cost(self, sag: Floats) -> float:
        """Minus twice the logarithm of how much likelier the lines are if the road is curved so, up to a constant [-].

        What is known of curvature before any lines are seen is not in it.

        Takes `sag` (pieces,) [1/m].
        """
        return _square(sag - self.mean[1:], self._precision()) - _square(sag, inverse_of(sag_covariance()))

    def _precision(self) -> Floats:
        return inverse_of(np.ascontiguousarray(self.covariance[1:, 1:]))


def sag_from(piece: int, curvature: float) -> Floats:
    """(pieces,) float64: vertical curvature of a road that is straight up to a piece [1/m] (`curvature` [1/m])."""
    return np.where(np.arange(PIECES) >= piece, curvature, 0.0)


@functools.cache
def sag_covariance() -> Floats:
    """(pieces, pieces) float64: covariance of the curvatures of a curved road [1/m²]; it belongs to all who ask."""
    return curvature_covariance(SAG_DEVIATION, SAG_LENGTH)


def curvature_covariance(deviation: float, length: float) -> Floats:
    """(pieces, pieces) float64: covariance of curvatures that change over a length [1/m²].

    Takes `deviation` [1/m], `length` [m].
    """
    knots = np.array(KNOTS[:-1])
    return np.asarray(deviation**2 * np.exp(-np.abs(knots[:, None] - knots) / length))


def unseen_sags(row: float, deviation: float) -> SagsAhead:
    """What is known of vertical curvature where no lines are seen (`row`, `deviation` [px])."""
    covariance = np.zeros((1 + PIECES, 1 + PIECES))
    covariance[0, 0], covariance[1:, 1:] = deviation**2, sag_covariance()
    return SagsAhead(np.array([row, *np.zeros(PIECES)]), covariance)


def _square(values: Floats, precision: Floats) -> float:
    """Square of a vector's length in standard deviations [-]."""
    return float(matrix_product(values, matrix_product(precision, values)))


def beginning_cost(curvature: float) -> float:
    """Minus twice the logarithm of how likely a curvature from some piece on is beforehand, but for its density [-].

    Takes `curvature` [1/m].
    """
    return (curvature / SAG_DEVIATION) ** 2 - 2.0 * math.log(BEGINS)
