"""Van (5.9 × 2.0 × 2.6 m), articulated truck (16.5 × 2.55 × 4.0 m) and coach (12 × 2.55 × 3.4 m)."""

from itertools import pairwise

import numpy as np

from fogsim.scene.bodies.parts import (
    FOG_LAMP,
    HEAD_LAMP,
    LEFT_INDICATOR,
    PLATE,
    POSITION_LAMP,
    STOP_LAMP,
    corner_panel,
    finished,
    hull,
    pair,
    panel_back,
    panel_front,
    side_panel,
    wheels,
)
from fogsim.scene.solids import BLACK_PLASTIC, GLASS, PAINT, STEEL, UNDERBODY, Material, both_sides, box, merge
from fogsim.values.scene import Mesh

_SEAM = Material((0.05, 0.05, 0.05))
_CONTOUR = Material((0.45, 0.05, 0.04))

# x, half width, lower edge, upper edge, half width at the upper edge, crown [m]
_VAN = np.array(
    [
        [0.00, 0.72, 0.32, 0.78, 0.62, 0.02],
        [0.10, 0.86, 0.26, 0.92, 0.76, 0.03],
        [0.45, 0.95, 0.24, 1.12, 0.82, 0.05],
        [0.80, 0.98, 0.24, 1.26, 0.84, 0.05],
        [1.62, 1.00, 0.24, 2.38, 0.86, 0.06],
        [2.20, 1.00, 0.24, 2.50, 0.90, 0.09],
        [5.60, 1.00, 0.26, 2.50, 0.90, 0.09],
        [5.84, 0.98, 0.28, 2.44, 0.88, 0.07],
        [5.88, 0.95, 0.32, 2.38, 0.86, 0.05],
    ]
)
_CAB = np.array(
    [
        [0.00, 1.12, 0.38, 1.55, 1.10, 0.0],
        [0.20, 1.22, 0.35, 2.90, 1.10, 0.0],
        [0.60, 1.25, 0.35, 3.40, 1.10, 0.05],
        [1.30, 1.25, 0.50, 3.72, 1.12, 0.08],
        [2.25, 1.25, 0.60, 3.85, 1.14, 0.08],
    ]
)
_TRAILER = np.array(
    [
        [2.85, 1.27, 1.10, 3.98, 1.25, 0.0],
        [2.90, 1.27, 1.10, 4.00, 1.26, 0.0],
        [16.3, 1.27, 1.10, 4.00, 1.26, 0.0],
        [16.35, 1.27, 1.10, 3.98, 1.25, 0.0],
    ]
)
_COACH = np.array(
    [
        [0.00, 1.10, 0.40, 1.20, 1.14, 0.0],
        [0.12, 1.20, 0.35, 2.90, 1.16, 0.0],
        [0.40, 1.26, 0.32, 3.22, 1.20, 0.06],
        [1.00, 1.27, 0.32, 3.30, 1.24, 0.08],
        [11.6, 1.27, 0.34, 3.30, 1.24, 0.08],
        [11.9, 1.25, 0.36, 3.20, 1.18, 0.06],
        [11.97, 1.20, 0.42, 3.05, 1.06, 0.03],
    ]
)


def van(*, detail: bool = True) -> Mesh:
    """Shape of a van in a unit box."""
    body = _VAN if detail else _VAN[[0, 2, 3, 4, 5, 6, 8]]
    lamps = merge(
        (
            corner_panel((5.91, 0.80), (5.85, 0.985), (1.22, 1.45), STOP_LAMP),
            corner_panel((5.91, 0.80), (5.85, 0.985), (1.02, 1.22), POSITION_LAMP),
            corner_panel((5.91, 0.80), (5.85, 0.985), (0.88, 1.02), LEFT_INDICATOR),
            corner_panel((-0.01, 0.50), (0.16, 0.90), (0.72, 0.92), HEAD_LAMP),
            corner_panel((0.16, 0.90), (0.28, 0.935), (0.74, 0.90), LEFT_INDICATOR),
            panel_back(5.92, (0.58, 0.72), (0.42, 0.50), FOG_LAMP),
        )
    )
    screen = panel_front((0.85, 1.52), (-0.72, 0.72), (1.42, 2.34), GLASS)
    windows = side_panel([(1.3, 1.015, 1.38), (1.68, 0.985, 2.1), (2.25, 0.985, 2.12), (2.25, 1.015, 1.32)], GLASS)
    rear = (
        panel_back(5.895, (0.06, 0.70), (1.50, 2.18), GLASS),
        panel_back(5.895, (-0.70, -0.06), (1.50, 2.18), GLASS),
        panel_back(5.895, (-0.012, 0.012), (0.55, 2.32), _SEAM),
        panel_back(5.90, (-0.92, 0.92), (0.33, 0.55), BLACK_PLASTIC),
        panel_back(5.91, (-0.30, 0.22), (0.86, 0.97), PLATE),
        panel_back(5.905, (-0.20, 0.20), (2.34, 2.38), STOP_LAMP),
    )
    front = (
        panel_front(-0.015, (-0.66, 0.66), (0.34, 0.54), BLACK_PLASTIC),
        panel_front(-0.015, (-0.46, 0.46), (0.60, 0.74), BLACK_PLASTIC),
        panel_front(-0.03, (-0.26, 0.26), (0.45, 0.56), PLATE),
    )
    rolling = wheels((1.0, 4.65), 1.005, 0.345, 0.22, detail=detail)
    return finished([hull(body), pair(lamps), screen, windows, *rear, *front, rolling], 5.92, 1.0)


def truck(*, detail: bool = True) -> Mesh:
    """Shape of an articulated truck in a unit box."""
    chassis = box((2.0, -0.45, 0.55), (16.2, 0.45, 1.12), UNDERBODY)
    skirts = both_sides(box((6.2, 1.18, 0.45), (10.2, 1.24, 1.10), STEEL))
    tanks = both_sides(box((2.4, 0.7, 0.40), (4.4, 1.20, 1.0), BLACK_PLASTIC))
    guard = box((16.30, -1.20, 0.48), (16.42, 1.20, 0.64), BLACK_PLASTIC)
    axles = wheels((1.4, 5.0, 11.4, 12.7, 14.0), 1.26, 0.50, 0.34, detail=detail, arch=False)
    hulls = (hull(_CAB, columns=3), hull(_TRAILER, columns=3))
    parts = [*hulls, chassis, skirts, tanks, guard, axles, _trailer_rear(), _cab_front()]
    return finished(parts, 16.5, 1.275)


def _trailer_rear() -> Mesh:
    lamps = merge(
        (
            panel_back(16.45, (0.98, 1.22), (0.86, 1.02), POSITION_LAMP),
            panel_back(16.45, (0.78, 0.98), (0.86, 1.02), STOP_LAMP),
            panel_back(16.45, (0.60, 0.78), (0.86, 1.02), LEFT_INDICATOR),
            panel_back(16.45, (0.44, 0.60), (0.86, 1.02), FOG_LAMP),
        )
    )
    x = 16.375
    doors = (
        panel_back(x, (-0.02, 0.02), (1.20, 3.92), _SEAM),
        both_sides(panel_back(x, (0.40, 0.44), (1.25, 3.88), STEEL)),
        both_sides(panel_back(x, (1.19, 1.25), (1.15, 3.95), STEEL)),
        panel_back(x, (-1.19, 1.19), (3.89, 3.97), STEEL),
        panel_back(x, (-1.25, 1.25), (1.10, 1.20), STEEL),
        both_sides(panel_back(x + 0.012, (1.205, 1.245), (1.25, 3.85), _CONTOUR)),
        panel_back(x + 0.012, (-1.15, 1.15), (1.215, 1.265), _CONTOUR),
    )
    holder = box((16.36, -1.24, 0.80), (16.44, 1.24, 1.06), BLACK_PLASTIC)
    plate = panel_back(16.46, (-0.26, 0.26), (0.88, 1.0), PLATE)
    return merge((pair(lamps), *doors, holder, plate))


def _cab_front() -> Mesh:
    lamp = panel_front(-0.02, (0.66, 1.06), (0.62, 0.82), HEAD_LAMP)
    indicator = panel_front(-0.02, (1.06, 1.12), (0.62, 0.82), LEFT_INDICATOR)
    screen = panel_front((0.0, 0.155), (-1.04, 1.04), (1.72, 2.75), GLASS)
    grille = panel_front(-0.015, (-0.85, 0.85), (0.92, 1.50), BLACK_PLASTIC)
    windows = side_panel([(0.4, 1.262, 1.75), (0.5, 1.25, 2.55), (1.15, 1.25, 2.6), (1.15, 1.262, 1.75)], GLASS)
    plate = panel_front(-0.03, (-0.26, 0.26), (0.45, 0.56), PLATE)
    return merge((pair(merge((lamp, indicator))), screen, grille, windows, plate))


def bus(*, detail: bool = True) -> Mesh:
    """Shape of a coach in a unit box."""
    lamps = merge(
        (
            corner_panel((12.0, 1.0), (11.93, 1.235), (1.15, 1.40), STOP_LAMP),
            corner_panel((12.0, 1.0), (11.93, 1.235), (0.95, 1.15), POSITION_LAMP),
            corner_panel((12.0, 1.0), (11.93, 1.235), (0.78, 0.95), LEFT_INDICATOR),
            panel_back(12.0, (0.70, 0.86), (0.62, 0.72), FOG_LAMP),
            panel_front(-0.02, (0.66, 1.02), (0.62, 0.82), HEAD_LAMP),
            panel_front(-0.02, (1.02, 1.09), (0.62, 0.82), LEFT_INDICATOR),
        )
    )
    edges = np.linspace(1.2, 11.5, 8)
    panes = [
        side_panel([(a, 1.282, 1.62), (b - 0.07, 1.282, 1.62), (b - 0.07, 1.275, 2.75), (a, 1.275, 2.75)], GLASS)
        for a, b in pairwise(edges.tolist())
    ]
    ends = (
        panel_front((-0.015, 0.09), (-1.06, 1.06), (1.3, 2.8), GLASS),
        panel_back((11.975, 11.965), (-0.95, 0.95), (1.95, 2.80), GLASS),
        panel_back(11.99, (-0.95, 0.95), (0.95, 1.55), _SEAM),
        panel_back(12.0, (-0.26, 0.26), (0.62, 0.74), PLATE),
        panel_back(11.985, (-0.25, 0.25), (2.86, 2.92), STOP_LAMP),
        panel_back(11.98, (-1.12, 1.12), (0.42, 0.56), BLACK_PLASTIC),
        panel_front(-0.03, (-0.26, 0.26), (0.45, 0.56), PLATE),
    )
    rolling = wheels((2.7, 8.9), 1.275, 0.50, 0.32, detail=detail)
    return finished([hull(_COACH, PAINT), pair(lamps), *panes, *ends, rolling], 12.0, 1.275)
