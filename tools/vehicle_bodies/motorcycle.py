"""A motorcycle with its rider, 2.2 × 0.8 × 1.6 m."""

import numpy as np

from fogsim.scene.solids import Material, box
from fogsim.values.scene import Mesh
from vehicle_bodies.parts import (
    FOG_LAMP,
    HEAD_LAMP,
    LEFT_INDICATOR,
    PLATE,
    POSITION_LAMP,
    STOP_LAMP,
    finished,
    hull,
    pair,
    panel_back,
    panel_front,
)
from vehicle_bodies.solids import BLACK_PLASTIC, STEEL, TYRE, ball, both_sides, cylinder

_LEATHER = Material((0.035, 0.035, 0.04))
_HELMET = Material((0.4, 0.4, 0.4))


def motorcycle() -> Mesh:
    """Shape of a motorcycle with its rider in a unit box."""
    sides, limbs = 14, 5
    rolling = [cylinder((x, -0.08, 0.31), (x, 0.08, 0.31), 0.31, TYRE, sides=sides) for x in (0.31, 1.86)]
    fairing = [
        [0.25, 0.10, 0.75, 0.95, 0.08, 0.03],
        [0.45, 0.22, 0.45, 1.02, 0.15, 0.08],
        [0.90, 0.22, 0.30, 0.92, 0.17, 0.05],
        [1.40, 0.18, 0.40, 0.80, 0.16, 0.02],
        [2.00, 0.14, 0.70, 0.90, 0.10, 0.02],
    ]
    torso = [[0.88, 0.17, 0.88, 1.38, 0.19, 0.03], [1.35, 0.20, 0.80, 1.30, 0.18, 0.05]]
    rider = (
        hull(np.array(torso), _LEATHER),
        both_sides(cylinder((1.05, 0.20, 1.25), (0.62, 0.34, 1.02), 0.055, _LEATHER, sides=limbs)),
        both_sides(cylinder((1.25, 0.18, 0.85), (0.85, 0.26, 0.72), 0.085, _LEATHER, sides=limbs)),
        both_sides(cylinder((0.85, 0.26, 0.72), (1.20, 0.22, 0.30), 0.065, _LEATHER, sides=limbs)),
        ball((0.92, 0.0, 1.46), 0.14, _HELMET),
    )
    lamps = (
        panel_back(2.06, (-0.09, 0.09), (0.80, 0.85), POSITION_LAMP),
        panel_back(2.06, (-0.09, 0.09), (0.85, 0.90), STOP_LAMP),
        panel_back(2.06, (-0.05, 0.05), (0.74, 0.79), FOG_LAMP),
        panel_front(0.23, (-0.08, 0.08), (0.78, 0.92), HEAD_LAMP),
        pair(panel_back(2.05, (0.14, 0.19), (0.78, 0.84), LEFT_INDICATOR)),
        panel_back(2.17, (-0.11, 0.11), (0.48, 0.66), PLATE),
    )
    frame = (
        both_sides(box((0.55, 0.05, 0.95), (0.62, 0.40, 1.02), BLACK_PLASTIC)),
        cylinder((0.31, 0.11, 0.31), (0.6, 0.11, 0.9), 0.03, STEEL, sides=6),
        cylinder((1.2, -0.18, 0.35), (2.0, -0.2, 0.5), 0.06, STEEL, sides=8),
    )
    return finished([*rolling, hull(np.array(fairing)), *rider, *lamps, *frame], 2.17, 0.2)
