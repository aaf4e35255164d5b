"""Trucks: semitrailer (16.5 × 2.55 × 4.0 m), rigid with a box (8.5 × 2.5 × 3.6 m), flatbed (7.1 × 2.4 × 2.4 m)."""

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.solids import GLASS, Material, box, merge
from fogsim.values.scene import Mesh, Surface
from vehicle_bodies.parts import (
    FOG_LAMP,
    HEAD_LAMP,
    LEFT_INDICATOR,
    LENS,
    PLATE,
    POSITION_LAMP,
    STOP_LAMP,
    finished,
    hull,
    pair,
    panel_back,
    panel_front,
    side_panel,
    wheels,
)
from vehicle_bodies.solids import BLACK_PLASTIC, PAINT, STEEL, UNDERBODY, both_sides

_SEAM = Material((0.05, 0.05, 0.05))
_CONTOUR = Material((0.45, 0.05, 0.04), Surface.SHEETING)
_WOOD = Material((0.13, 0.095, 0.06))

# x, half width, lower edge, upper edge, half width at the upper edge, crown [m]
_CAB = np.array(
    [
        [0.00, 1.12, 0.38, 1.55, 1.10, 0.0],
        [0.20, 1.22, 0.35, 2.90, 1.10, 0.0],
        [0.60, 1.25, 0.35, 3.40, 1.10, 0.05],
        [1.30, 1.25, 0.50, 3.72, 1.12, 0.08],
        [2.25, 1.25, 0.60, 3.85, 1.14, 0.08],
    ]
)


def semitrailer(box_material: Material) -> Mesh:
    """Shape of an articulated truck in a unit box."""
    trailer = _load((2.85, 16.35), (1.10, 4.0), 1.27, box_material)
    chassis = box((2.0, -0.45, 0.55), (16.2, 0.45, 1.12), UNDERBODY)
    skirts = both_sides(box((6.2, 1.18, 0.45), (10.2, 1.24, 1.10), STEEL))
    tanks = both_sides(box((2.4, 0.7, 0.40), (4.4, 1.20, 1.0), BLACK_PLASTIC))
    axles = wheels((1.4, 5.0, 11.4, 12.7, 14.0), 1.26, 0.50, 0.34, arch=False)
    rear = (_doors(16.375, (1.10, 4.0), 1.25, box_material), _tail(16.45, 1.24, 0.86))
    parts = [hull(_CAB, columns=3, levels=3), trailer, chassis, skirts, tanks, axles, *rear, _cab_front()]
    return finished(parts, 16.5, 1.275)


def tractor() -> Mesh:
    """Shape of the tractor of such a truck in a unit box, as long as from its front to the end of its frame."""
    chassis = box((2.0, -0.45, 0.55), (6.2, 0.45, 1.08), UNDERBODY)
    tanks = both_sides(box((2.4, 0.7, 0.40), (4.4, 1.20, 1.0), BLACK_PLASTIC))
    axles = wheels((1.4, 5.0), 1.26, 0.50, 0.34, arch=False)
    return finished([hull(_CAB, columns=3, levels=3), chassis, tanks, axles, _cab_front()], 6.2, 1.275)


def trailer(box_material: Material) -> Mesh:
    """Shape of the trailer of such a truck in a unit box."""
    load = _load((0.0, 13.5), (1.10, 4.0), 1.27, box_material)
    front = panel_front(0.005, (-1.26, 1.26), (1.10, 4.0), box_material)
    chassis = box((3.6, -0.45, 0.55), (13.35, 0.45, 1.12), UNDERBODY)
    skirts = both_sides(box((3.35, 1.18, 0.45), (7.35, 1.24, 1.10), STEEL))
    axles = wheels((8.55, 9.85, 11.15), 1.26, 0.50, 0.34, arch=False)
    rear = (_doors(13.525, (1.10, 4.0), 1.25, box_material), _tail(13.6, 1.24, 0.86))
    return finished([load, front, chassis, skirts, axles, *rear], 13.65, 1.275)


def rigid() -> Mesh:
    """Shape of a truck with a box body in a unit box."""
    cab = _CAB * (0.88, 0.97, 1.0, 0.80, 0.97, 1.0)
    load = _load((2.15, 8.35), (1.05, 3.6), 1.24, Material((0.58, 0.585, 0.58)))
    chassis = box((1.8, -0.42, 0.5), (8.2, 0.42, 1.05), UNDERBODY)
    bars = both_sides(box((3.2, 1.14, 0.5), (5.6, 1.2, 0.95), STEEL))
    axles = wheels((1.25, 6.3), 1.23, 0.47, 0.5, arch=False)
    rear = (_doors(8.375, (1.05, 3.6), 1.22, PAINT), _tail(8.45, 1.2, 0.80))
    return finished([hull(cab, columns=3, levels=3), load, chassis, bars, axles, *rear, _cab_front(0.8)], 8.5, 1.25)


def flatbed() -> Mesh:
    """Shape of a light truck with a flat bed in a unit box."""
    cab = _CAB[:, :] * (0.75, 0.9, 1.0, 0.60, 0.9, 1.0) + (0.0, 0.0, 0.05, 0.04, 0.0, 0.0)
    floor = box((1.85, -1.18, 0.92), (6.95, 1.18, 1.05), _WOOD)
    boards = both_sides(box((1.85, 1.15, 0.92), (6.95, 1.19, 1.50), STEEL))
    ends = [box((x, -1.18, 0.92), (x + 0.05, 1.18, top), STEEL) for x, top in ((1.8, 1.95), (6.92, 1.5))]
    load = box((2.4, -0.9, 1.05), (4.6, 0.9, 1.75), Material((0.18, 0.15, 0.10)))
    chassis = box((1.5, -0.4, 0.5), (6.8, 0.4, 0.92), UNDERBODY)
    axles = wheels((1.1, 5.3), 1.18, 0.40, 0.4, arch=False)
    parts = [hull(cab, columns=3, levels=3), floor, boards, *ends, load, chassis, axles]
    return finished([*parts, _tail(7.05, 1.14, 0.68), _cab_front(0.6, 0.9)], 7.1, 1.2)


def _load(along: tuple[float, float], heights: tuple[float, float], half: float, material: Material) -> Mesh:
    """Box body without a rear wall of its own."""
    (start, end), (low, high) = along, heights
    table: NDArray[np.float64] = np.array([[x, half, low, high, half - 0.01, 0.0] for x in (start, end)])
    return hull(table, material, columns=2, levels=3)


def _doors(x: float, heights: tuple[float, float], half: float, material: Material) -> Mesh:
    low, high = heights
    return merge(
        (
            panel_back(x - 0.012, (-half, half), (low, high), material),
            panel_back(x, (-0.02, 0.02), (low + 0.1, high - 0.08), _SEAM),
            both_sides(panel_back(x, (0.40, 0.44), (low + 0.15, high - 0.12), STEEL)),
            both_sides(panel_back(x, (half - 0.06, half), (low + 0.05, high - 0.05), STEEL)),
            panel_back(x, (-half + 0.06, half - 0.06), (high - 0.11, high - 0.03), STEEL),
            panel_back(x, (-half, half), (low, low + 0.10), STEEL),
            both_sides(panel_back(x + 0.012, (half - 0.045, half - 0.005), (low + 0.15, high - 0.15), _CONTOUR)),
            panel_back(x + 0.012, (-half + 0.1, half - 0.1), (low + 0.115, low + 0.165), _CONTOUR),
        )
    )


def _tail(x: float, half: float, low: float) -> Mesh:
    """Bumper bar with lamps and plate, whose lamps end at half a width and begin at a height [m]."""
    high = low + 0.16
    lamps = merge(
        (
            panel_back(x, (half - 0.26, half - 0.02), (low, high), POSITION_LAMP),
            panel_back(x, (half - 0.46, half - 0.26), (low, high), STOP_LAMP),
            panel_back(x, (half - 0.64, half - 0.46), (low, high), LEFT_INDICATOR),
            panel_back(x, (half - 0.80, half - 0.64), (low, high), FOG_LAMP),
        )
    )
    holder = box((x - 0.09, -half, low - 0.06), (x - 0.01, half, high + 0.04), BLACK_PLASTIC)
    guard = box((x - 0.15, -half + 0.04, low - 0.38), (x - 0.03, half - 0.04, low - 0.22), BLACK_PLASTIC)
    plate = panel_back(x + 0.01, (-0.26, 0.26), (low + 0.02, low + 0.14), PLATE)
    return merge((pair(lamps), holder, guard, plate))


def _cab_front(tall: float = 1.0, wide: float = 1.0) -> Mesh:
    """Face of a cab, with the heights of what lies above its bumper scaled."""

    def up(z: float) -> float:
        return tall * z

    lamp = panel_front(-0.02, (0.66 * wide, 1.06 * wide), (0.58, 0.78), HEAD_LAMP)
    indicator = panel_front(-0.02, (1.06 * wide, 1.12 * wide), (0.58, 0.78), LEFT_INDICATOR)
    fog = panel_front(-0.02, (0.80 * wide, 0.96 * wide), (0.43, 0.53), LENS)
    screen = panel_front((0.0, 0.155), (-1.04 * wide, 1.04 * wide), (up(1.72), up(2.75)), GLASS)
    grille = panel_front(-0.015, (-0.85 * wide, 0.85 * wide), (up(1.0), up(1.50)), BLACK_PLASTIC)
    y, back = 1.262 * wide, 0.7 + 0.45 * tall
    outline = [(0.4, y, up(1.75)), (0.5, y - 0.012, up(2.55)), (back, y - 0.012, up(2.6)), (back, y, up(1.75))]
    plate = panel_front(-0.03, (-0.26, 0.26), (0.42, 0.53), PLATE)
    mirrors = both_sides(box((0.02, 1.11 * wide, up(1.95)), (0.16, 1.25 * wide, up(2.55)), BLACK_PLASTIC))
    return merge((pair(merge((lamp, indicator, fog))), screen, grille, side_panel(outline, GLASS), plate, mirrors))
