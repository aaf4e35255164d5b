"""Who passes which cross section: compiled, as each way is compared with all sections."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

Floats = NDArray[np.float64]
Numbers = NDArray[np.intp]

NOT_YET = -2.0
"""Step at which a vehicle was last seen that has not been seen."""

_LEAST_COSINE = math.cos(math.radians(45.0))
"""Ways at a larger angle to the road are on another one [-]."""


@kernel
def count_passages(
    position: Floats,
    step: Numbers,
    vehicle: Numbers,
    last: Floats,
    sections: Floats,
    read: NDArray[np.bool_],
    first: int,
    half_width: float,
) -> int:
    """Count how often vehicles pass sections of a road in its direction.

    Takes `position` (n, 2) [m], `step`, `vehicle` (n,) int, `last` (m, 4) [m], `sections` (s, 4) [m], `read` (k, s)
    bool, `half_width` [m].
    """
    count = 0
    for i in range(len(position)):
        v = vehicle[i]
        came_x, came_y, clear = last[v, 0], last[v, 1], 0.0
        if last[v, 2] == step[i] - 1:
            way, clear = math.hypot(position[i, 0] - came_x, position[i, 1] - came_y), last[v, 3]
            if way < clear:
                clear -= way
            else:
                nearest = math.inf
                for j in range(len(sections)):
                    x, y, along_x, along_y = sections[j]
                    nearest = min(nearest, (position[i, 0] - x) ** 2 + (position[i, 1] - y) ** 2)
                    after = (position[i, 0] - x) * along_x + (position[i, 1] - y) * along_y
                    before = (came_x - x) * along_x + (came_y - y) * along_y
                    if before >= 0.0 or after < max(_LEAST_COSINE * way + before, 0.0) or not read[step[i] - first, j]:
                        continue
                    aside_after = (position[i, 1] - y) * along_x - (position[i, 0] - x) * along_y
                    aside_before = (came_y - y) * along_x - (came_x - x) * along_y
                    if abs(aside_before * after - aside_after * before) <= half_width * (after - before):
                        count += 1
                clear = math.sqrt(nearest) - half_width
        last[v, 0], last[v, 1], last[v, 2], last[v, 3] = position[i, 0], position[i, 1], step[i], clear
    return count
