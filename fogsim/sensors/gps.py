"""Satellite positioning: where a vehicle takes itself to be."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Gps:
    """How well a vehicle knows where it is.

    Attributes
    ----------
    position_deviation : float
        Standard deviation of its position, east and north [m].
    heading_deviation : float
        Standard deviation of its heading [rad].
    """

    position_deviation: float = 0.0
    heading_deviation: float = 0.0


class Fix(NamedTuple):
    """Where a vehicle takes itself to be.

    Attributes
    ----------
    position : (3,) float64
        Middle of the front bumper [m].
    heading : float
        Direction of travel, counterclockwise from east [rad].
    """

    position: NDArray[np.float64]
    heading: float

    def displaced(self, along: float, left: float) -> "Fix":
        """Fix elsewhere.

        Parameters
        ----------
        along, left : float
            How far ahead and to the left [m].
        """
        forward, aside = math.cos(self.heading), math.sin(self.heading)
        x, y, z = self.position
        place = (x + along * forward - left * aside, y + along * aside + left * forward, z)
        return self._replace(position=np.array(place))


def measure_fix(position: NDArray[np.float64], heading: float, gps: Gps, rng: np.random.Generator) -> Fix:
    """Measure where a vehicle is.

    Parameters
    ----------
    position : (3,) float64
        Middle of the front bumper as it truly is [m].
    heading : float
        True direction of travel, counterclockwise from east [rad].
    gps : Gps
        Noise.
    rng : numpy.random.Generator
        Source of the noise; three numbers are drawn in every call.
    """
    east, north, turned = rng.standard_normal(3).tolist()
    noise = gps.position_deviation * np.array([east, north, 0.0])
    return Fix(position + noise, heading + gps.heading_deviation * turned)
