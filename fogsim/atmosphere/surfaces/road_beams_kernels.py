"""Light of beams on a map of the ground."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.surfaces.streetlight_kernels import GroundLight
from fogsim.core.jit import kernel


class BeamsAlike(NamedTuple):
    """Beams of one kind from one height."""

    places: NDArray[np.float64]  # (n, 3): Where the lamps are [m]
    headings: NDArray[np.float64]  # (n,): Directions of their axes, counter-clockwise from x [rad]
    scales: NDArray[np.float64]  # (n,): How many lamps shine together at each place
    extinction: NDArray[np.float64]  # (n,): Of the fog before each [1/m]
    height: float  # Of the lamps above the road [m]


@kernel
def add_beam_illuminance(beams: BeamsAlike, pattern: NDArray[np.float64], step: float, ground: GroundLight) -> None:
    """Add beams to a map of illuminance, and set how high up what stands there is lit: as high as the lamps.

    Takes `pattern` (m, 2 l + 1) [lx], `step` [m].
    """
    origin, cell, illuminance, tops = ground.origin, ground.cell, ground.illuminance, ground.tops
    rows, columns = illuminance.shape
    ahead, half = pattern.shape[0] - 1, (pattern.shape[1] - 1) // 2
    for i in range(beams.places.shape[0]):
        x0, y0 = (beams.places[i, 0] - origin[0]) / cell, (beams.places[i, 1] - origin[1]) / cell
        cosine, sine = math.cos(beams.headings[i]) * cell / step, math.sin(beams.headings[i]) * cell / step
        # The pattern lies between its far end and its sides, turned.
        far_x, far_y = ahead * (step / cell) ** 2 * cosine, ahead * (step / cell) ** 2 * sine
        side_x, side_y = half * (step / cell) ** 2 * abs(sine), half * (step / cell) ** 2 * abs(cosine)
        first_row, last_row = y0 + min(far_y, 0.0) - side_y, y0 + max(far_y, 0.0) + side_y
        first_column, last_column = x0 + min(far_x, 0.0) - side_x, x0 + max(far_x, 0.0) + side_x
        # What `tops` tells is where light ends, a metre above which it has faded.
        top = np.float32(beams.places[i, 2] + 1.0)
        for row in range(max(0, math.ceil(first_row)), min(rows, math.floor(last_row) + 1)):
            for column in range(max(0, math.ceil(first_column)), min(columns, math.floor(last_column) + 1)):
                along = (column - x0) * cosine + (row - y0) * sine
                across = (column - x0) * sine - (row - y0) * cosine + half
                if not (0.0 < along < ahead and 0.0 < across < 2 * half):
                    continue
                a, b = int(along), int(across)
                down, right = along - a, across - b
                near = pattern[a, b] + (pattern[a, b + 1] - pattern[a, b]) * right
                far = pattern[a + 1, b] + (pattern[a + 1, b + 1] - pattern[a + 1, b]) * right
                way = math.sqrt(beams.height**2 + step**2 * (along**2 + (across - half) ** 2))
                light = beams.scales[i] * (near + (far - near) * down) * math.exp(-beams.extinction[i] * way)
                illuminance[row, column] += np.float32(light)
                tops[row, column] = max(tops[row, column], top)
