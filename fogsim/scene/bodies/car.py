"""A compact estate car, 4.5 × 1.8 × 1.47 m."""

import numpy as np

from fogsim.scene.bodies.parts import (
    BACK,
    FOG_LAMP,
    HEAD_LAMP,
    LEFT_INDICATOR,
    PLATE,
    POSITION_LAMP,
    STOP_LAMP,
    UP,
    corner_panel,
    finished,
    hull,
    pair,
    panel_back,
    panel_front,
    side_panel,
    wheels,
)
from fogsim.scene.solids import BLACK_PLASTIC, CHROME, GLASS, PAINT, Material, both_sides, box, grid, merge, quad
from fogsim.values.scene import Mesh

# x, half width, lower edge, belt, half width at the belt, crown [m]
_BODY = np.array(
    [
        [0.00, 0.58, 0.30, 0.56, 0.52, 0.02],
        [0.05, 0.74, 0.22, 0.63, 0.66, 0.03],
        [0.22, 0.84, 0.18, 0.70, 0.74, 0.05],
        [0.65, 0.885, 0.17, 0.79, 0.79, 0.06],
        [1.20, 0.895, 0.17, 0.88, 0.83, 0.05],
        [2.20, 0.895, 0.17, 0.92, 0.84, 0.02],
        [3.20, 0.895, 0.17, 0.95, 0.84, 0.01],
        [3.95, 0.885, 0.19, 0.965, 0.82, 0.01],
        [4.27, 0.855, 0.24, 0.96, 0.78, 0.01],
        [4.43, 0.78, 0.28, 0.90, 0.70, 0.01],
        [4.49, 0.66, 0.33, 0.80, 0.60, 0.01],
    ]
)
_SKY_IN_GLASS = Material((0.095, 0.105, 0.115))


def car(*, detail: bool = True) -> Mesh:
    """Shape of a car in a unit box; without detail, the stand-in for the distance."""
    body = _BODY if detail else _BODY[[0, 2, 4, 7, 8, 10]]
    parts = [hull(body), _greenhouse(detail=detail), _front(), _rear()]
    parts.append(wheels((0.86, 3.52), 0.90, 0.315, 0.205, detail=detail))
    if detail:
        parts.append(both_sides(box((1.62, 0.70, 0.93), (1.76, 0.885, 1.05), BLACK_PLASTIC)))
        parts.append(
            side_panel([(0.3, 0.893, 0.2), (4.2, 0.893, 0.2), (4.2, 0.897, 0.29), (0.3, 0.897, 0.29)], BLACK_PLASTIC)
        )
    return finished(parts, 4.5, 0.9)


def _side(z: float) -> float:
    """Half the width of the greenhouse at a height [m]: its sides lean inwards."""
    return 0.80 - 0.40 * (z - 0.92)


def _window(outline: list[tuple[float, float]], material: Material, outward: float) -> Mesh:
    return side_panel([(x, _side(z) + outward, z) for x, z in outline], material)


def _greenhouse(*, detail: bool) -> Mesh:
    x, z = np.array([2.02, 2.5, 3.1, 3.72]), np.array([1.405, 1.435, 1.435, 1.39])
    across = np.linspace(1, -1, 5 if detail else 3)
    roof = [[(a, s * _side(b), b + 0.035 * (1 - s * s)) for s in across] for a, b in zip(x, z, strict=True)]
    outline = [(1.22, 0.87), (2.02, 1.405), (2.5, 1.435), (3.1, 1.435), (3.72, 1.39), (4.30, 0.95)]
    front = [(1.70, 0.96), (2.16, 1.34), (2.78, 1.37), (2.78, 0.975)]
    rear = [(2.86, 0.975), (2.86, 1.37), (3.58, 1.345), (3.92, 1.01)]
    return merge(
        (
            grid(roof, PAINT, UP),
            _window(outline, PAINT, 0.0),
            _window(front, GLASS, 0.008),
            _window(rear, GLASS, 0.008),
            _screen((1.22, 0.87), (2.02, 1.405), -BACK),
            _screen((4.30, 0.95), (3.72, 1.39), BACK),
        )
    )


def _screen(base: tuple[float, float], top: tuple[float, float], toward: np.ndarray) -> Mesh:
    """Windscreen or rear window between two heights, in its painted frame; its upper part mirrors the sky."""

    def row(share: float, inset: float, out: float) -> list[tuple[float, float, float]]:
        x, z = base[0] + share * (top[0] - base[0]), base[1] + share * (top[1] - base[1])
        half = _side(z) - inset
        return [(x + out * toward[0], half, z + 0.5 * out), (x + out * toward[0], -half, z + 0.5 * out)]

    frame = np.array([row(0.0, 0.0, 0.0), row(1.0, 0.0, 0.0)])
    pane = np.array([row(0.10, 0.055, 0.012), row(0.55, 0.055, 0.012), row(0.93, 0.055, 0.012)])
    shade = np.repeat([GLASS.reflectance, (0.05, 0.058, 0.066), _SKY_IN_GLASS.reflectance], 2, axis=0)
    return merge((grid(frame, PAINT, toward + UP), grid(pane, GLASS, toward + UP, reflectance=shade)))


def _front() -> Mesh:
    lamp = corner_panel((0.015, 0.46), (0.17, 0.825), (0.56, 0.68), HEAD_LAMP)
    indicator = corner_panel((0.17, 0.825), (0.26, 0.862), (0.57, 0.67), LEFT_INDICATOR)
    grille = panel_front(-0.015, (-0.42, 0.42), (0.50, 0.62), BLACK_PLASTIC)
    intake = panel_front(-0.015, (-0.52, 0.52), (0.30, 0.42), BLACK_PLASTIC)
    plate = panel_front(-0.03, (-0.26, 0.26), (0.40, 0.51), PLATE)
    badge = panel_front(-0.03, (-0.05, 0.05), (0.55, 0.60), CHROME)
    return merge((pair(merge((lamp, indicator))), grille, intake, plate, badge))


def _rear() -> Mesh:
    inner, middle, outer, edge = (4.515, 0.47), (4.50, 0.62), (4.45, 0.765), (4.30, 0.865)
    lamps = merge(
        (
            corner_panel(middle, outer, (0.72, 0.86), STOP_LAMP),
            corner_panel(outer, edge, (0.72, 0.92), POSITION_LAMP),
            corner_panel(inner, middle, (0.78, 0.86), POSITION_LAMP),
            corner_panel(inner, middle, (0.72, 0.78), LEFT_INDICATOR),
        )
    )
    fog = panel_back(4.52, (0.50, 0.64), (0.40, 0.47), FOG_LAMP)
    high_stop = quad(
        [(3.79, 0.17, 1.375), (3.79, -0.17, 1.375), (3.83, -0.17, 1.35), (3.83, 0.17, 1.35)], STOP_LAMP, BACK
    )
    apron = panel_back(4.505, (-0.64, 0.64), (0.33, 0.39), BLACK_PLASTIC)
    seam = panel_back(4.505, (-0.60, 0.60), (0.515, 0.53), BLACK_PLASTIC)
    plate = panel_back(4.525, (-0.26, 0.26), (0.61, 0.72), PLATE)
    return merge((pair(merge((lamps, fog))), high_stop, apron, seam, plate))
