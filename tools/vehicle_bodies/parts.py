"""What bodies of vehicles are put together from.

Bodies are modelled in metres: x backwards from the front bumper, y to the left, z up from the road. `finished` turns
them into shapes that fill a unit box, so that a vehicle's own length, width and height scale them.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogsim.scene.solids import Material, disc, grid, grid_faces, merge, mesh, polygon, quad
from fogsim.scene.vehicles import LIT_AREAS
from fogsim.values.scene import Mesh, Surface
from vehicle_bodies.lamp_patches import with_lit_areas
from vehicle_bodies.solids import PAINT, TYRE, UNDERBODY, both_sides, mirrored

LEFT, UP, BACK = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])

POSITION_LAMP = Material((0.20, 0.012, 0.014), Surface.LAMP_POSITION_REAR)
STOP_LAMP = Material((0.24, 0.014, 0.016), Surface.LAMP_STOP)
FOG_LAMP = Material((0.22, 0.013, 0.015), Surface.LAMP_REAR_FOG)
LEFT_INDICATOR = Material((0.36, 0.15, 0.03), Surface.LAMP_INDICATOR_LEFT)
HEAD_LAMP = Material((0.50, 0.51, 0.52), Surface.LAMP_HEAD)
PLATE = Material((0.62, 0.62, 0.58), Surface.SHEETING)
LENS = Material((0.42, 0.43, 0.44))
"""Lamp without a surface of its own: front fog lamps."""
RIM = Material((0.19, 0.195, 0.20))


def hull(table: ArrayLike, material: Material = PAINT, *, columns: int = 5, levels: int = 4) -> Mesh:
    """Closed body through cross-sections.

    Each is a row [m]: x, half width, lower edge, upper edge at the side, half width there, rise of the middle.
    `columns` and `levels` are points across the top and up each side; three levels make upright sides.
    """
    x, half, low, top, half_top, crown = np.asarray(table, float).T
    sides = []
    shares = ((0.0, 0.93 * half), (0.22, half), (0.62, half), (1.0, half_top))
    for share, width in shares if levels == 4 else shares[:2] + shares[3:]:
        sides.append(np.stack((x, width, low + share * (top - low)), axis=1))
    side = np.stack(sides, axis=1)
    across = np.linspace(1.0, -1.0, columns)
    roof = np.stack([np.stack((x, share * half_top, top + crown * (1 - share**2)), axis=1) for share in across], axis=1)
    floor = np.stack((side[:, 0], side[:, 0] * (1, -1, 1)), axis=1)
    return merge(
        (
            both_sides(grid(side, material, LEFT)),
            grid(roof, material, UP),
            grid(floor, UNDERBODY, -UP),
            _end(side[0], roof[0], material, -BACK),
            _end(side[-1], roof[-1], material, BACK),
        )
    )


def _end(side: NDArray[np.float64], roof: NDArray[np.float64], material: Material, toward: NDArray[np.float64]) -> Mesh:
    outline = np.concatenate((side, roof[1:-1], (side * (1, -1, 1))[::-1]))
    return polygon(outline, material, toward)


def panel_back(
    x: float | tuple[float, float], y: tuple[float, float], z: tuple[float, float], material: Material
) -> Mesh:
    """Rectangle facing backwards; two values of x are those at the lower and upper edge [m]."""
    lower, upper = x if isinstance(x, tuple) else (x, x)
    corners = [(lower, y[0], z[0]), (lower, y[1], z[0]), (upper, y[1], z[1]), (upper, y[0], z[1])]
    return quad(corners, material, BACK)


def panel_front(
    x: float | tuple[float, float], y: tuple[float, float], z: tuple[float, float], material: Material
) -> Mesh:
    """Rectangle facing forwards; two values of x are those at the lower and upper edge [m]."""
    part = panel_back(x, y, z, material)
    return replace(part, normals=-part.normals, faces=part.faces[:, ::-1].copy())


def corner_panel(
    inner: tuple[float, float], outer: tuple[float, float], z: tuple[float, float], material: Material
) -> Mesh:
    """Upright panel round a corner on the left side, between two places (x, y) [m], facing outwards."""
    (xi, yi), (xo, yo) = inner, outer
    corners = [(xi, yi, z[0]), (xo, yo, z[0]), (xo, yo, z[1]), (xi, yi, z[1])]
    along = np.array([xo - xi, yo - yi, 0.0])
    toward = np.cross(along, UP)
    return quad(corners, material, toward if toward[1] > 0 else -toward)


def side_panel(outline: Sequence[tuple[float, float, float]], material: Material) -> Mesh:
    """Convex panels on both sides; the outline (x, y, z) is that of the left one [m]."""
    return both_sides(polygon(outline, material, LEFT))


def pair(left: Mesh) -> Mesh:
    """Lamps on both sides; an indicator's twin is that of the other side."""
    twin = mirrored(left)
    swapped = np.where(twin.surface == Surface.LAMP_INDICATOR_LEFT, Surface.LAMP_INDICATOR_RIGHT, twin.surface)
    return merge((left, replace(twin, surface=swapped.astype(np.int32))))


def wheels(axles: Sequence[float], outside: float, radius: float, width: float, *, arch: bool = True) -> Mesh:
    """Pairs of wheels."""
    parts = []
    for x in axles:
        parts.append(_wheel(x, outside, radius, width))
        if arch:
            outline = [
                (x - 1.2 * radius * np.cos(a), outside - 0.02, max(radius + 1.2 * radius * np.sin(a), 0.19))
                for a in np.linspace(-0.35, np.pi + 0.35, 9)
            ]
            parts.append(polygon(outline, UNDERBODY, LEFT))
    return both_sides(merge(parts))


def _wheel(x: float, outside: float, radius: float, width: float, sides: int = 12) -> Mesh:
    angle = np.linspace(0.0, 2 * np.pi, sides + 1)
    rim = np.stack((np.cos(angle), np.zeros(sides + 1), np.sin(angle)), axis=1)
    hub = np.array([x, outside, radius])
    tread = np.stack((hub - (0, width, 0) + radius * rim, hub - (0, 0.012, 0) + radius * rim), axis=1)
    tyre = mesh(tread, grid_faces(sides + 1, 2), np.repeat(rim, 2, axis=0), TYRE)
    wall = disc(hub - (0, 0.012, 0), radius, -BACK, UP, TYRE, sides=sides)
    return merge((tyre, wall, disc(hub, 0.64 * radius, -BACK, UP, RIM, sides=8)))


def contact_shadow(length: float, half_width: float, *, fine: bool = True) -> Mesh:
    """Darkness on the road under a body, deepest in the middle, fading towards its outline."""
    x, along = np.array([0.005, 0.05, 0.15, 0.85, 0.95, 0.995]), np.array([0, 0.6, 1, 1, 0.6, 0])
    y, across = np.array([-0.99, -0.82, 0.82, 0.99]), np.array([0, 0.75, 0.75, 0])
    if not fine:
        # As dark in the mean, along and across.
        x, along = x[[0, 2, 3, 5]], np.array([0.29, 1.0, 1.0, 0.29])
        y, across = np.array([-0.99, 0.99]), np.array([0.686, 0.686])
    points = np.array([[(a * length, b * half_width, 0.012) for b in y] for a in x])
    depth = np.multiply.outer(along, across / 0.75)
    reflectance = np.repeat((0.058 - 0.048 * depth).reshape(-1, 1), 3, axis=1)
    return grid(points, UNDERBODY, UP, reflectance=reflectance)


def finished(parts: Sequence[Mesh], length: float, half_width: float) -> Mesh:
    """Shape of a body with its contact shadow in a unit box: x −1 (rear) … 0 (front), y ±1/2, z 0 … 1."""
    body = with_lit_areas(merge(parts), LIT_AREAS)
    whole = merge((body, contact_shadow(length, half_width)))
    low, high = body.positions.min(axis=0), body.positions.max(axis=0)
    size = (high - low).astype(np.float64)
    offset = np.array([low[0], 0.5 * (low[1] + high[1]), low[2]])
    positions = np.clip((whole.positions - offset) / size, (0.0, -0.5, 0.0), (1.0, 0.5, 1.0)) * (-1.0, 1.0, 1.0)
    # The renderer turns normals by the inverse scale, so a shape that was squeezed needs the opposite here.
    normals = whole.normals * size * (-1.0, 1.0, 1.0)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    return replace(
        whole,
        positions=positions.astype(np.float32),
        normals=normals.astype(np.float32),
        faces=whole.faces[:, ::-1].copy(),
    )
