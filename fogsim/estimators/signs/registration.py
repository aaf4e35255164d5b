"""Which of the detected signs are those of the map."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from fogsim.estimators.signs.regions import GATE, ProjectedSign
from fogsim.vision.symmetry.detection import LARGER, SMALLER, SignDetection

LIMIT = 4.0
"""Standard deviations that column, row and size of a detection may be off together: 0.1 % are farther off [-]."""

_SIZE_DEVIATION, _BLUR = 0.15, 0.4
"""Standard deviation of a detected radius about the map's: relative to it, and by what blurs small signs [px]."""

_FALSE_ALARMS = 0.05
"""Detections in a region that are no sign of the map [-]."""

_DETECTED = 0.9
"""Share of signs that are detected, for the confidence in a pair [-]."""


@dataclass(frozen=True, slots=True)
class Registration:
    """A detection taken for a sign of the map."""

    sign: ProjectedSign  # The sign
    detection: SignDetection  # The detection
    confidence: float  # p(c): probability that the detection is this sign and no false alarm [-]


def register_signs(signs: Sequence[ProjectedSign], detections: Sequence[SignDetection]) -> tuple[Registration, ...]:
    """Pair detections with signs of the map, each with one at most, so that the pairs are likeliest together.

    A pair is possible within `LIMIT` standard deviations of column, row and size together. Its likelihood q is that of
    the offsets over that of a false alarm anywhere in the sign's region: p(c) = P q / (P q + λ) with the share P of
    signs that are detected and the false alarms λ in a region, as in probabilistic data association with one target.

    Returns In the order of the signs; signs without a detection are left out.
    """
    ratios = np.array([[_likelihood_ratio(sign, one) for one in detections] for sign in signs])
    if ratios.size == 0:
        return ()
    gain = np.log1p(ratios)
    pairs = zip(*(found.tolist() for found in linear_sum_assignment(gain, maximize=True)), strict=True)
    return tuple(
        Registration(signs[i], detections[j], float(ratios[i, j] / (1.0 + ratios[i, j])))
        for i, j in pairs
        if ratios[i, j] > 0.0
    )


def _likelihood_ratio(sign: ProjectedSign, detection: SignDetection) -> float:
    """Likelihood of a detection as this sign over that as a false alarm [-]; 0 outside the gate."""
    a, b = (detection.u - sign.u) / sign.deviation_u, (detection.v - sign.v) / sign.deviation_v
    size_deviation = math.hypot(_SIZE_DEVIATION, _BLUR / sign.radius)
    c = math.log(detection.radius / sign.radius) / size_deviation
    square = a * a + b * b + c * c
    if square > LIMIT * LIMIT:
        return 0.0
    density = math.exp(-0.5 * square) / (2.0 * math.pi) ** 1.5
    density /= sign.deviation_u * sign.deviation_v * size_deviation
    area: float = 4.0 * GATE * GATE * sign.deviation_u * sign.deviation_v * math.log(LARGER / SMALLER)
    return float(_DETECTED * density * area / _FALSE_ALARMS)
