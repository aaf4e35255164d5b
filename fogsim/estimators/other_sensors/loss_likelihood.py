"""Likelihood of the extinction coefficient by at which ranges a vehicle was found and at which not."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.units import extinction_from_visibility
from fogsim.values.estimate import ExtinctionBounds

Floats = NDArray[np.float64]

CELLS, NEAREST, FARTHEST = 141, 10.0, 10_000.0
"""Cells of ln k, and visibilities at the ends of the grid [m]."""

USUAL_CONTRAST, CONTRAST_DEVIATION = -0.45, 0.35
"""Mean and standard deviation of the ln of a vehicle's contrast to its surroundings, over the airlight."""

LIGHT_SHARE, LEAST_CONTRAST = 0.1, 0.05
"""Share of vehicles with an unknown contrast, since light paint in front of light airlight may vanish at any range [-],
and its least value then [-]."""

SLOPE = 0.25
"""Deviation, in ln of the contrast, of the threshold at which a vehicle is found [-]."""

ASTRAY = 0.03
"""Share of looks that go astray either way: clutter that looks like a vehicle, something that hides it [-]."""

SUREST = 4.0
"""Largest logarithm of a ratio of likelihoods that is kept [-]: fog changes, and then what contradicts counts."""

END = 0.25
"""Likelihood at both ends of the grid, over the largest, up to which there is an estimate [-]."""

KNOWN = 0.35
"""The same at one end up to which there is a bound [-]."""

WIDEST, LEAST_DEVIATION = 0.5, 0.1
"""Largest and least standard deviation of an estimate, and of a bound, in ln k [-]."""

EXTINCTION = np.geomspace(extinction_from_visibility(FARTHEST), extinction_from_visibility(NEAREST), CELLS)
LOG_EXTINCTION, LOG_CONTRAST = np.log(EXTINCTION), np.linspace(math.log(LEAST_CONTRAST), 0.0, 16)


def _contrast_prior() -> Floats:
    usual = np.exp(-0.5 * ((LOG_CONTRAST - USUAL_CONTRAST) / CONTRAST_DEVIATION) ** 2)
    return np.asarray((1.0 - LIGHT_SHARE) * usual / usual.sum() + LIGHT_SHARE / LOG_CONTRAST.size)


class LossLikelihood:
    """Evidence on k from looks at vehicles at known ranges; each vehicle has an unknown contrast C0 in all looks.

    A look finds the vehicle with the probability that C0 e^(−kd) exceeds a threshold.
    """

    def __init__(self) -> None:
        self._prior = np.log(_contrast_prior())
        self._past = np.zeros(CELLS)
        self._present = np.zeros((CELLS, LOG_CONTRAST.size))
        self._reach = 0.0

    def fade(self, ages: float) -> None:
        """Let what was learnt count for less."""
        kept = math.exp(-ages)
        self._past *= kept
        self._present *= kept

    def meet_another(self) -> None:
        """Look at another vehicle from now on."""
        learnt = self._learnt()
        self._past = np.maximum(learnt - learnt.max(), -SUREST)
        self._present = np.zeros_like(self._present)

    def learn(self, distance: float, threshold: float, weight: float, *, found: bool) -> None:
        """Take in a look (`distance` [m])."""
        contrast = LOG_CONTRAST - distance * EXTINCTION[:, None]
        above = np.clip((contrast - math.log(threshold)) / SLOPE, -40.0, 40.0)
        # A logistic curve is a normal distribution's within 0.01.
        share = ASTRAY + (1.0 - 2.0 * ASTRAY) / (1.0 + np.exp(-1.702 * above))
        self._present += weight * np.log(share if found else 1.0 - share)
        self._present = np.maximum(self._present - self._present.max(), -SUREST)
        self._reach = distance

    def _learnt(self) -> Floats:
        """Logarithm of the likelihood of each ln k."""
        joint = self._present + self._prior
        most = joint.max()
        return np.asarray(self._past + most + np.log(np.exp(joint - most).sum(axis=1)))

    def result(self) -> tuple[float, float, float] | ExtinctionBounds | None:
        """k, its standard deviation and how far all looks reached [1/m, 1/m, m]; bounds; or nothing."""
        learnt = self._learnt()
        likelihood = np.exp(learnt - learnt.max())
        if max(likelihood[0], likelihood[-1]) < END:
            # Tails are by looks that go astray: a normal distribution has e^(−½) of its height one deviation aside.
            near = LOG_EXTINCTION[likelihood >= math.exp(-0.5)]
            mean, deviation = 0.5 * float(near[0] + near[-1]), 0.5 * float(near[-1] - near[0])
            deviation = math.hypot(deviation, LEAST_DEVIATION)
            if deviation <= WIDEST:
                return math.exp(mean), deviation * math.exp(mean), self._reach
        most, above = _fall(likelihood, LOG_EXTINCTION)
        least, below = _fall(likelihood[::-1], -LOG_EXTINCTION[::-1])
        if math.isinf(most) and math.isinf(least):
            return None
        softness = min(max(above, below, LEAST_DEVIATION), WIDEST)
        return ExtinctionBounds(math.exp(most), math.exp(-least), softness)


def _fall(likelihood: Floats, place: Floats) -> tuple[float, float]:
    """Where a likelihood falls below a half for good, and the deviation of that; inf and 0 where it does not."""
    if likelihood[-1] > KNOWN:
        return math.inf, 0.0
    half = int(np.flatnonzero(likelihood > 0.5)[-1])
    tail = int(np.flatnonzero(likelihood > max(0.16, 1.1 * float(likelihood[-1])))[-1])
    return float(place[half]), float(place[max(tail, half)] - place[half])
