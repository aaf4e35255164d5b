"""Van (5.9 × 2.0 × 2.6 m) and coach (12 × 2.55 × 3.4 m)."""

from itertools import pairwise

import numpy as np

from fogsim.scene.solids import GLASS, Material, box, merge
from fogsim.values.scene import Mesh
from vehicle_bodies.parts import (
    FOG_LAMP,
    HEAD_LAMP,
    LEFT_INDICATOR,
    LENS,
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
from vehicle_bodies.solids import BLACK_PLASTIC, PAINT, UNDERBODY, both_sides

_SEAM = Material((0.05, 0.05, 0.05))

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


def van() -> Mesh:
    """Shape of a van in a unit box."""
    lamps = merge(
        (
            corner_panel((5.91, 0.80), (5.85, 0.985), (1.22, 1.45), STOP_LAMP),
            corner_panel((5.91, 0.80), (5.85, 0.985), (1.02, 1.22), POSITION_LAMP),
            corner_panel((5.91, 0.80), (5.85, 0.985), (0.88, 1.02), LEFT_INDICATOR),
            corner_panel((-0.01, 0.50), (0.16, 0.90), (0.72, 0.92), HEAD_LAMP),
            corner_panel((0.16, 0.90), (0.28, 0.935), (0.74, 0.90), LEFT_INDICATOR),
            panel_back(5.92, (0.58, 0.72), (0.42, 0.50), FOG_LAMP),
            panel_front(-0.005, (0.48, 0.62), (0.38, 0.46), LENS),
        )
    )
    mirrors = both_sides(box((1.05, 0.84, 1.36), (1.2, 1.0, 1.62), BLACK_PLASTIC))
    seam = side_panel([(3.4, 1.006, 0.6), (3.43, 1.006, 0.6), (3.43, 0.985, 2.2), (3.4, 0.985, 2.2)], _SEAM)
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
    rolling = wheels((1.0, 4.65), 1.005, 0.345, 0.22)
    return finished([hull(_VAN), pair(lamps), screen, windows, mirrors, seam, *rear, *front, rolling], 5.92, 1.0)


def bus() -> Mesh:
    """Shape of a coach in a unit box."""
    lamps = merge(
        (
            corner_panel((12.0, 1.0), (11.93, 1.235), (1.15, 1.40), STOP_LAMP),
            corner_panel((12.0, 1.0), (11.93, 1.235), (0.95, 1.15), POSITION_LAMP),
            corner_panel((12.0, 1.0), (11.93, 1.235), (0.78, 0.95), LEFT_INDICATOR),
            panel_back(12.0, (0.70, 0.86), (0.62, 0.72), FOG_LAMP),
            panel_front(-0.02, (0.66, 1.02), (0.62, 0.82), HEAD_LAMP),
            panel_front(-0.02, (1.02, 1.09), (0.62, 0.82), LEFT_INDICATOR),
            panel_front(-0.02, (0.72, 0.90), (0.47, 0.57), LENS),
        )
    )
    mirrors = both_sides(box((-0.02, 1.14, 1.9), (0.12, 1.27, 2.4), BLACK_PLASTIC))
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
    rolling = wheels((2.7, 8.9), 1.275, 0.50, 0.32)
    return finished([hull(_COACH, PAINT), pair(lamps), mirrors, *panes, *ends, rolling], 12.0, 1.275)


# A flat end on either side, and windows all along.
_CARRIAGE = np.array(
    [
        [0.00, 1.22, 0.60, 3.16, 1.16, 0.03],
        [0.10, 1.27, 0.55, 3.30, 1.24, 0.08],
        [11.87, 1.27, 0.55, 3.30, 1.24, 0.08],
        [11.97, 1.22, 0.60, 3.16, 1.16, 0.03],
    ]
)


def carriage() -> Mesh:
    """Shape of a carriage of a train, or of a section of a tram or bus behind the first, in a unit box."""
    lamps = merge(
        (
            panel_back(12.0, (0.86, 1.08), (1.15, 1.35), STOP_LAMP),
            panel_back(12.0, (0.86, 1.08), (0.95, 1.15), POSITION_LAMP),
            panel_back(12.0, (0.86, 1.08), (0.78, 0.95), LEFT_INDICATOR),
            panel_back(12.0, (0.64, 0.80), (0.78, 0.90), FOG_LAMP),
            panel_front(-0.02, (0.66, 1.02), (0.80, 1.00), HEAD_LAMP),
            panel_front(-0.02, (1.02, 1.09), (0.80, 1.00), LEFT_INDICATOR),
        )
    )
    edges = np.linspace(0.8, 11.2, 9)
    panes = [
        side_panel([(a, 1.282, 1.62), (b - 0.12, 1.282, 1.62), (b - 0.12, 1.275, 2.75), (a, 1.275, 2.75)], GLASS)
        for a, b in pairwise(edges.tolist())
    ]
    ends = (
        panel_front(-0.015, (-0.95, 0.95), (1.5, 2.85), GLASS),
        panel_back(11.985, (-0.95, 0.95), (1.5, 2.85), GLASS),
        panel_back(11.99, (-0.25, 0.25), (2.92, 2.98), STOP_LAMP),
    )
    # Wheels would be stretched with the body; bogies and boxes under the floor are of any length.
    frame = box((0.3, -1.1, 0.35), (11.7, 1.1, 0.62), UNDERBODY)
    bogies = [box((x, -1.12, 0.02), (x + 1.6, 1.12, 0.55), BLACK_PLASTIC) for x in (1.0, 9.4)]
    return finished([hull(_CARRIAGE, PAINT), pair(lamps), *panes, *ends, frame, *bogies], 12.0, 1.275)
