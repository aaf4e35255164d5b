"""Satellite positioning: where a vehicle takes itself to be."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Gps:
    """How well a vehicle knows where it is."""

    position_deviation: float = 0.0  # Standard deviation of its position, east and north [m]
    heading_deviation: float = 0.0  # Standard deviation of its heading [rad]


class Fix(NamedTuple):
    """Where a vehicle takes itself to be."""

    position: NDArray[np.float64]  # (3,): Middle of the front bumper [m]
    heading: float  # Direction of travel, counterclockwise from east [rad]

    def displaced(self, along: float, left: float) -> "Fix":
        """Fix elsewhere (`along`, `left` [m])."""
        forward, aside = math.cos(self.heading), math.sin(self.heading)
        x, y, z = self.position
        place = (x + along * forward - left * aside, y + along * aside + left * forward, z)
        return self._replace(position=np.array(place))


def measure_fix(position: NDArray[np.float64], heading: float, gps: Gps, rng: np.random.Generator) -> Fix:
    """Measure where a vehicle is (`position` (3,) [m], `heading` [rad])."""
    east, north, turned = rng.standard_normal(3).tolist()
    noise = gps.position_deviation * np.array([east, north, 0.0])
    return Fix(position + noise, heading + gps.heading_deviation * turned)
