"""Extinction from how the light of a sign's face changes while it comes nearer."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import convolution
from fogsim.estimators.signs.face_light import FaceLight
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY

Floats = NDArray[np.float64]

GRID = OPTICAL_DEPTH_AT_VISIBILITY / np.geomspace(8000.0, 10.0, 900)
"""Extinction coefficients to weigh [1/m], evenly spaced in ln k, more finely than any sign can resolve."""

SIGN_DEVIATION = 0.015
"""Relative deviation of k that a sign has to itself, whatever its looks agree on [-]."""

_AIRLIGHT, _CLIPPED_AIRLIGHT = 0.008, 0.05
"""Relative deviation of the airlight at the sign from the sky's, and where the sky is clipped [-]."""

_DARKNESS = 0.02
"""Deviation of what a sign's black sends, over the airlight [-]: gloss, dirt, and red that is not as red."""

_REGISTRATION = 0.012
"""Relative deviation of a single look's contrast by what is not noise: its layout, its place within the pixels [-]."""

_SMALL_FACE = 0.05
"""Relative deviation of the contrast of faces too small for their areas to be distinguished, which the looks at a sign
share: how far their light spreads, how large they are taken to be [-]."""

_BRIGHTNESS, _BRIGHTNESS_DEVIATION = 1.0, 0.5
"""What a white face would send without fog over the airlight, divided by its reflectance, and its deviation [-]: a
vertical surface gets about half of a level one's light, the airlight has 0.37 over woods and 0.87 over snow."""

_HUBER, _ROUNDS, _COARSE = 2.0, 2, 6
"""Standard deviations from which on a look counts less [-], rounds of weighing, and every how manieth k they need."""

MAX_MISFIT = 2.5
"""Mean square of the standardised residuals beyond which it is not the sign that the map has [-]."""


@dataclass(frozen=True, slots=True)
class FaceLook:
    """One look at a sign."""

    distance: float  # From the camera by the map [m]
    face: FaceLight  # What its face sends
    airlight: float  # Luminance of the sky [linear grey levels]
    clipped: bool = False  # Whether the sky is clipped


@dataclass(frozen=True, slots=True)
class ApproachFit:
    """What the approach to one sign says."""

    log_likelihood: Floats  # (300,): For each k of `GRID`, the largest 0 [-]
    misfit: float  # Mean square of the standardised residuals at the likeliest k [-]


def fit_approach(looks: Sequence[FaceLook], range_deviation: float) -> ApproachFit:
    """Weigh every extinction coefficient by the looks at one sign.

    By Koschmieder's law the face's black has the contrast −(1 − g) e^(−kd) + ε to the airlight, and its slope over
    reflectance is Q e^(−kd): the brightness Q, the black's own light g and the airlight's error ε are the sign's own,
    and are fitted for each k. A constant error of the map's distance changes Q and g alone.

    Takes `range_deviation` [m].
    """
    distance = np.array([one.distance for one in looks])
    airlight = np.array([one.airlight for one in looks])
    seen = np.array([(one.face.black, one.face.slope) for one in looks]) / airlight[:, None]
    seen[:, 0] -= 1.0
    small = np.array([float(one.face.is_mean) for one in looks])
    noise = np.array([one.face.variance for one in looks]) / airlight[:, None] ** 2
    unsure = _CLIPPED_AIRLIGHT if any(one.clipped for one in looks) else _AIRLIGHT
    measured = _Measured(distance, seen, noise, small, unsure, range_deviation)
    weight = np.ones(len(looks))
    for _ in range(_ROUNDS):
        squares, residuals = _profile(GRID[::_COARSE], measured, weight)
        square = residuals[int(np.argmin(squares))]
        weight = np.minimum(1.0, _HUBER / np.sqrt(np.maximum(square, 1e-9)))
    squares, residuals = _profile(GRID, measured, weight)
    at = int(np.argmin(squares))
    misfit = float((weight * residuals[at]).sum() / max(2 * len(looks) - 3, 1))
    scaled = -0.5 * (squares - squares[at]) / max(misfit, 1.0)
    return ApproachFit(_widened(scaled), misfit)


def _widened(log_likelihood: Floats) -> Floats:
    """Log-likelihood of `GRID` after `SIGN_DEVIATION` has been added, the largest 0."""
    step = math.log(GRID[1] / GRID[0])
    reach = math.ceil(3.5 * SIGN_DEVIATION / step)
    share = np.exp(-0.5 * (np.arange(-reach, reach + 1) * step / SIGN_DEVIATION) ** 2)
    padded = np.pad(np.exp(np.maximum(log_likelihood, -700.0)), reach, mode="edge")
    wider = np.log(convolution(padded, share)[2 * reach : -2 * reach])
    return np.asarray(wider - wider.max())


class _Measured(NamedTuple):
    """Looks at one sign, relative to the airlight.

    Distances [m]; contrast of black and slope (looks, 2), variances and covariance of these (looks, 3); 1 where only
    the mean counts; deviations of the airlight [-] and of a distance [m].
    """

    distance: Floats
    seen: Floats
    noise: Floats
    small: Floats
    unsure: float
    range_deviation: float


def _profile(grid: Floats, measured: _Measured, weight: Floats) -> tuple[Floats, Floats]:
    """Least sum of squares for each k of the grid, and each look's own (k, looks)."""
    distance, seen, noise, small, unsure, range_deviation = measured
    k = grid[:, None]
    fall = np.exp(-k * distance)
    # What is not noise scales a contrast; taken along the usual face, so that what was seen decides no weights.
    relative = (_REGISTRATION**2 + (k * range_deviation) ** 2) * fall**2
    a = noise[:, 0] + relative
    b = noise[:, 1] + _BRIGHTNESS**2 * relative
    c = noise[:, 2] - _BRIGHTNESS * relative * 0.5
    determinant = np.maximum(a * b - c * c, 1e-30)
    aa, bb, ab = b / determinant, a / determinant, -c / determinant
    first, second = seen[:, 0] + fall, np.broadcast_to(seen[:, 1], fall.shape) - _BRIGHTNESS * fall
    # Linear unknowns: g, ε and what small faces share in the first, the brightness beyond the usual in the second.
    none = np.zeros_like(fall)
    rows = ((fall, none), (np.ones_like(fall), none), (small * fall, none), (none, fall))
    priors = (_DARKNESS**-2.0, unsure**-2.0, _SMALL_FACE**-2.0, _BRIGHTNESS_DEVIATION**-2.0)
    matrix, right = np.zeros((len(grid), 4, 4)), np.zeros((len(grid), 4))
    for i, (p, q) in enumerate(rows):
        left_p, left_q = weight * (aa * p + ab * q), weight * (ab * p + bb * q)
        right[:, i] = (left_p * first + left_q * second).sum(axis=1)
        for j, (r, s) in enumerate(rows):
            matrix[:, i, j] = (left_p * r + left_q * s).sum(axis=1)
        matrix[:, i, i] += priors[i]
    solved = _solved(matrix, right)
    g, offset, shared, brighter = (solved[:, i, None] for i in range(4))
    first, second = first - (g + shared * small) * fall - offset, second - brighter * fall
    own = aa * first**2 + bb * second**2 + 2.0 * ab * first * second
    # The logarithm of the determinant: variances depend on k.
    whole = (weight * (own + np.log(determinant))).sum(axis=1)
    return whole + (solved**2 * np.array(priors)).sum(axis=1), own


def _solved(matrix: Floats, right: Floats) -> Floats:
    """Solutions of many small positive definite systems, by Gauss's elimination."""
    matrix, right = matrix.copy(), right.copy()
    count = right.shape[1]
    for i in range(count):
        for j in range(i + 1, count):
            share = matrix[:, j, i] / matrix[:, i, i]
            matrix[:, j] -= share[:, None] * matrix[:, i]
            right[:, j] -= share * right[:, i]
    for i in reversed(range(count)):
        right[:, i] = (right[:, i] - (matrix[:, i, i + 1 :] * right[:, i + 1 :]).sum(axis=1)) / matrix[:, i, i]
    return right


def extinction_of(fits: Sequence[ApproachFit], wrong_share: float) -> tuple[float, float]:
    """Mean and standard deviation of k [1/m] after several signs; some may be wrong."""
    likelihoods = [np.exp(np.maximum(fit.log_likelihood, -700.0)) for fit in fits]
    likelihoods = [one / one.mean() for one in likelihoods]
    shares = [np.log((1.0 - wrong_share) * one + wrong_share) for one in likelihoods]
    likeliest = int(np.argmax(np.sum(shares, axis=0)))
    # A sign counts for the probability that it is right, there where most of them agree.
    right = [(1.0 - wrong_share) * one[likeliest] for one in likelihoods]
    total = np.sum([r / (r + wrong_share) * fit.log_likelihood for r, fit in zip(right, fits, strict=True)], axis=0)
    probability = np.exp(total - total.max())
    probability /= probability.sum()
    mean = float((probability * GRID).sum())
    deviation = math.sqrt(float((probability * (GRID - mean) ** 2).sum()))
    return mean, deviation
