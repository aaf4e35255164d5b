"""Traffic signs on posts."""

import math
from dataclasses import replace

import numpy as np

from fogsim.scene.lettering import digits
from fogsim.scene.solids import Material, box, disc, merge, moved, quad
from fogsim.units import KMH_PER_MPS
from fogsim.values.road import Sign
from fogsim.values.scene import Mesh

SIGN = 4
"""Instance id of signs (see `View.instance`)."""

RED = Material((0.42, 0.022, 0.025))
FIELD = Material((0.66, 0.66, 0.64))
BLACK = Material((0.025, 0.025, 0.025))
BACK = Material((0.28, 0.285, 0.29))

_X, _Y, _Z = np.eye(3)


def sign_mesh(sign: Sign, ground: float) -> Mesh:
    """Sign with its face, back and post.

    Parameters
    ----------
    sign : Sign
        The sign; kind "speed_limit" is a red ring with its value in km/h, any other a blank white plate.
    ground : float
        Height at which its post stands [m].
    """
    face = _speed_limit(sign) if sign.kind == "speed_limit" else _plate(sign)
    # The face is drawn in its own plane: x to its reader's right, y up, z towards the reader.
    ahead = np.array([math.cos(sign.heading), math.sin(sign.heading), 0.0])
    right = np.array([ahead[1], -ahead[0], 0.0])
    matrix = np.eye(4)
    matrix[:3, :3] = np.column_stack((right, _Z, -ahead))
    matrix[:3, 3] = sign.position
    post = box((-0.038, ground - sign.position[2], -0.13), (0.038, 0.35 * sign.diameter, -0.055), BACK, instance=SIGN)
    return moved(merge((face, post)), matrix)


def _speed_limit(sign: Sign) -> Mesh:
    radius = sign.diameter / 2
    number = str(round(sign.value * KMH_PER_MPS))
    height = sign.diameter * (0.44 if len(number) < 3 else 0.34)
    black = digits(number, BLACK, SIGN)
    return merge(
        (
            disc((0, 0, 0), radius, _X, _Y, FIELD, sides=32, hole=0.965 * radius, instance=SIGN),
            disc((0, 0, 0), 0.965 * radius, _X, _Y, RED, sides=32, hole=0.76 * radius, instance=SIGN),
            disc((0, 0, 0), 0.76 * radius, _X, _Y, FIELD, sides=32, instance=SIGN),
            replace(black, positions=black.positions * np.float32(height) + np.array([0, 0, 0.012], np.float32)),
            disc((0, 0, -0.05), radius, -_X, _Y, BACK, sides=32, instance=SIGN),
        )
    )


def _plate(sign: Sign) -> Mesh:
    half = sign.diameter / 2

    def corners(share: float, depth: float) -> list[tuple[float, float, float]]:
        size = half * share
        return [(-size, -size, depth), (size, -size, depth), (size, size, depth), (-size, size, depth)]

    return merge(
        (
            quad(corners(1.0, 0.0), BLACK, _Z, SIGN),
            quad(corners(0.92, 0.012), FIELD, _Z, SIGN),
            quad(corners(1.0, -0.05), BACK, -_Z, SIGN),
        )
    )
