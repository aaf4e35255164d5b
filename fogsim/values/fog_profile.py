"""What is believed about the fog at places along the way."""

import math
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY


@dataclass(frozen=True, slots=True)
class FogProfile:
    """Normal distributions of ln k at places along the way, behind a vehicle and ahead of it.

    Attributes
    ----------
    distance : (n,) float64
        Distance ahead of the vehicle [m], ascending; negative behind it.
    log_extinction : (n,) float64
        Mean, and median, of ln k with k in 1/m.
    standard_deviation : (n,) float64
        Of ln k [-].
    """

    distance: NDArray[np.float64]
    log_extinction: NDArray[np.float64]
    standard_deviation: NDArray[np.float64]

    def at(self, distance: float) -> tuple[float, float]:
        """Mean and standard deviation of ln k at a place; beyond either end those of the end [-].

        Parameters
        ----------
        distance : float
            Distance ahead [m].
        """
        mean, deviation = (
            float(np.interp(distance, self.distance, values))
            for values in (self.log_extinction, self.standard_deviation)
        )
        return mean, deviation

    def visibility_quantile(self, distance: float, share: float) -> float:
        """Visibility below which the truth lies at a place with a given probability [m].

        Parameters
        ----------
        distance : float
            Distance ahead [m].
        share : float
            Probability, above 0 and below 1.
        """
        mean, deviation = self.at(distance)
        return OPTICAL_DEPTH_AT_VISIBILITY * math.exp(NormalDist().inv_cdf(share) * deviation - mean)
