"""Extinction from how the contrast of the best edges falls with the distance."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.vision.stereo.matching import SeenEdges

Floats = NDArray[np.float64]

STEP = 1.35
"""Ratio of the disparities at both ends of a class of distances [-]."""

_FEWEST = 20
"""Fewest edges that a class needs for its contrast."""

_BEST = 0.95
"""Quantile of a class's contrasts that stands for its darkest things before the airlight [-]."""

_INTRINSIC, _INTRINSIC_DEVIATION = 0.95, 0.08
"""Contrast of those without fog, and the standard deviation of its logarithm over scenes [-]."""

_SCATTER = 0.12
"""Standard deviation of ln contrast from class to class [-]."""

_STEPS = 8
"""Iterations of the fit, whose weights go by what it finds."""


class ContrastClass(NamedTuple):
    """Edges at about one distance."""

    distance: float  # Median distance [m]
    relative_deviation: float  # Its standard deviation over itself, by that of the disparity [-]
    contrast: float  # Their best contrast [-]


class ContrastDecay(NamedTuple):
    """What the fit of ln C = ln C₀ − k d finds."""

    # extinction, standard_deviation: k and its standard deviation [1/m]
    extinction: float
    standard_deviation: float
    intrinsic: float  # C₀ [-]


def contrast_classes(edges: SeenEdges, scale: float, deviation: float, least: float) -> list[ContrastClass]:
    """Classes of distances in which both pictures show edges, nearest first.

    Takes `scale` [m px], `deviation` [px], `least` [px].
    """
    found: list[ContrastClass] = []
    far = float(edges.disparity.max(initial=0.0))
    while far > least:
        near, far = far, far / STEP
        inside = (edges.disparity <= near) & (edges.disparity > max(far, least))
        if np.count_nonzero(inside) >= _FEWEST:
            disparity = float(np.median(edges.disparity[inside]))
            best = float(np.quantile(edges.contrast[inside], _BEST))
            found.append(ContrastClass(scale / disparity, deviation / disparity, best))
    return found


def fit_decay(classes: list[ContrastClass]) -> ContrastDecay:
    """Fit the contrast's fall over classes, with what is known of the contrast without fog.

    Iteratively reweighted least squares: a class's deviation is that of its things and of its distance, k σ_d, and one
    that lies far off counts less (Student's t of four degrees of freedom).
    """
    distance, relative, contrast = (np.array(column) for column in zip(*classes, strict=True))
    seen, prior = np.log(contrast), math.log(_INTRINSIC)
    k, start = max(float(np.mean((prior - seen) / distance)), 0.0), prior
    spread = 0.0
    for _ in range(_STEPS):
        variance = _SCATTER**2 + (k * distance * relative) ** 2
        off = seen - start + k * distance
        weight = 5.0 / (4.0 + off**2 / variance) / variance
        # Normal equations of (start, −k), the first with its prior.
        known = 1.0 / _INTRINSIC_DEVIATION**2
        a, b, c = known + weight.sum(), (weight * distance).sum(), (weight * distance**2).sum()
        p, q = known * prior + (weight * seen).sum(), (weight * distance * seen).sum()
        determinant = a * c - b * b
        start, k = float((c * p - b * q) / determinant), max(float((b * p - a * q) / determinant), 0.0)
        spread = math.sqrt(float(a / determinant))
    return ContrastDecay(k, spread, math.exp(start))
