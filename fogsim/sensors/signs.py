"""Signs that the map says lie ahead."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.values import SignMap, SignSighting

_FACING = math.cos(math.radians(60.0))
"""A sign speaks to those who drive within 60° of its direction."""


def signs_ahead(
    signs: SignMap,
    position: NDArray[np.float64],
    heading: float,
    reach: float,
    corridor: float = 25.0,
    grade: float = 0.0,
) -> tuple[SignSighting, ...]:
    """Signs of the map that are ahead of a vehicle and face it, nearest first; lengths in m, angles in rad."""
    forward, (x, y, z) = (math.cos(heading), math.sin(heading)), position.tolist()
    seen = []
    for sign in signs.signs:
        dx, dy = sign.position[0] - x, sign.position[1] - y
        distance = dx * forward[0] + dy * forward[1]
        lateral = dy * forward[0] - dx * forward[1]
        is_near = 0.0 < distance <= reach and -corridor <= lateral <= corridor
        if is_near and math.cos(sign.heading - heading) > _FACING:
            height = (sign.position[2] - z) * math.cos(grade) - distance * math.sin(grade)
            facing = math.remainder(sign.heading - heading, 2.0 * math.pi)
            what = (sign.sign_id, sign.kind, sign.value)
            seen.append(SignSighting(*what, distance, lateral, sign.diameter, height, facing))
    return tuple(sorted(seen, key=lambda s: s.distance))
