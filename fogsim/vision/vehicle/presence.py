"""Whether a vehicle stands out of the fog where its range says that it is."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera
from fogsim.vision.vehicle.rear_localisation import BODY, WIDTHS, upright_steps

Floats = NDArray[np.float64]

_PLACED = (-0.5, 0.0, 0.5)
"""How much higher than where the calibration has the road a vehicle is looked for [m]: pitch, sag and crest."""

_EDGE_GAIN = 0.41
"""Step from pixel to pixel over that across the edge of something: by its blur and the smoothing [-]."""


@dataclass(frozen=True, slots=True)
class Presence:
    """What came of looking for a vehicle."""

    # Lesser step of luminance across the sides of what is most like a vehicle, over the airlight; 0 for nothing [-]
    step: float
    threshold: float  # What it must be for a vehicle to be found: by noise and clutter; over the airlight [-]
    aside: float = 0.0  # How far to the right of the own axis the middle is [m]

    @property
    def found(self) -> bool:
        """Whether it stands out."""
        return self.step > self.threshold


def vehicle_presence(
    luminance: NDArray[np.float32],
    origin: tuple[int, int],
    camera: Camera,
    depth: float,
    aside: float,
    light: tuple[float, float],
) -> Presence:
    """Look for two upright edges, one up and one down, as far apart as a vehicle's sides.

    What is brighter than the airlight, as lamps are, counts as bright as that: so no contrast exceeds e^(−kd), by what
    light ever it comes.

    Takes `luminance` (rows, cols) [linear grey levels], `depth` [m], `aside` [m], `light` [linear grey levels].
    """
    airlight, noise = light
    scale = camera.focal_length / depth
    foot = camera.horizon_row + camera.row_distance / depth - origin[1]
    found = []
    for higher in _PLACED:
        top, bottom = (foot - (height + higher) * scale for height in (BODY[1], BODY[0]))
        rows = slice(max(math.floor(top), 0), max(math.ceil(bottom) + 1, 0))
        body = np.minimum(luminance[rows], np.float32(airlight))
        if body.shape[0] >= 2 and body.shape[1] >= 8:
            step, floor = upright_steps(body, noise)
            best, middle = _strongest_pair(step, scale, camera.principal_point[0] - origin[0], aside)
            found.append(Presence(best / _EDGE_GAIN / airlight, floor / _EDGE_GAIN / airlight, middle / scale))
    return max(found, key=lambda one: one.step / one.threshold) if found else Presence(0.0, 1.0)


def _strongest_pair(step: Floats, scale: float, axis: float, aside: float) -> tuple[float, float]:
    """The weaker step of the strongest pair at a width that vehicles have, and its middle from the axis [px]."""
    strongest = 0.0, 0.0
    for width in range(max(math.floor(WIDTHS[0] * scale), 3), min(math.ceil(WIDTHS[1] * scale) + 1, step.size - 1)):
        first, second = step[:-width], step[width:]
        strength = np.where(first * second < 0.0, np.minimum(np.abs(first), np.abs(second)), 0.0)
        middle = np.arange(strength.size) + 0.5 * width - axis
        strength[np.abs(middle) > aside * scale] = 0.0
        best = int(strength.argmax())
        strongest = max(strongest, (float(strength[best]), float(middle[best])))
    return strongest
