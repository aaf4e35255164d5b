"""What is printed on the faces of signs, in the plane z = 0, in units of a sign's diameter."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fogsim.scene.lettering import lettering, stroke
from fogsim.scene.solids import Material, disc, merge, polygon
from fogsim.values.scene import Mesh, Surface

SIGN = 4
"""Instance id of signs (see `View.instance`)."""


def _sheeting(red: float, green: float, blue: float) -> Material:
    return Material((red, green, blue), Surface.SHEETING)


RED = _sheeting(0.42, 0.022, 0.025)
FIELD = _sheeting(0.66, 0.66, 0.64)
BLACK = _sheeting(0.022, 0.022, 0.022)
GREY = _sheeting(0.24, 0.24, 0.24)
YELLOW = _sheeting(0.62, 0.40, 0.02)
BLUE = _sheeting(0.02, 0.07, 0.30)
DIODES = Material((0.95, 0.93, 0.85))
RED_DIODES = Material((0.75, 0.06, 0.05))

Corners = Sequence[tuple[float, float]]
_X, _Y, _Z = np.eye(3)


def flat(corners: Corners, material: Material) -> Mesh:
    """Convex polygon."""
    return polygon([(x, y, 0.0) for x, y in corners], material, _Z, SIGN)


def round_spot(x: float, y: float, radius: float, material: Material) -> Mesh:
    """Disc."""
    return disc((x, y, 0.0), radius, _X, _Y, material, sides=12, instance=SIGN)


def line(points: Corners, width: float, material: Material) -> Mesh:
    """Line of a width through points."""
    return stroke(list(points), width, material, SIGN)


def text(words: str, height: float, material: Material, *, widest: float = 10.0) -> Mesh:
    """Text of a height, narrowed to a width where it would be wider."""
    plain = lettering(words, material, SIGN)
    if not len(plain.faces):
        return plain
    narrow = min(1.0, widest / (height * float(np.ptp(plain.positions[:, 0]))))
    return replace(plain, positions=plain.positions * np.array([narrow * height, height, 1.0], np.float32))


def shifted(part: Mesh, x: float, y: float, size: float = 1.0) -> Mesh:
    """Part scaled and moved in its plane."""
    return replace(part, positions=part.positions * np.float32(size) + np.array([x, y, 0.0], np.float32))


def exclamation(material: Material = BLACK) -> Mesh:
    """Mark of a general warning."""
    return merge((flat([(-0.045, 0.22), (-0.025, -0.06), (0.025, -0.06), (0.045, 0.22)], material), _dot(material)))


def _dot(material: Material) -> Mesh:
    return round_spot(0.0, -0.14, 0.045, material)


def car_from_behind(material: Material) -> Mesh:
    """Car, 1 wide, standing on y = 0."""
    return merge(
        (
            flat([(-0.5, 0.16), (0.5, 0.16), (0.5, 0.52), (-0.5, 0.52)], material),
            flat([(-0.42, 0.52), (0.42, 0.52), (0.3, 0.86), (-0.3, 0.86)], material),
            flat([(-0.46, 0.0), (-0.26, 0.0), (-0.26, 0.16), (-0.46, 0.16)], material),
            flat([(0.26, 0.0), (0.46, 0.0), (0.46, 0.16), (0.26, 0.16)], material),
        )
    )


def skidding_car() -> Mesh:
    """Car above two wavy tracks."""
    wave = np.linspace(-0.19, 0.05, 9)
    tracks = [line([(x + 0.03 * np.sin(26 * y), y) for y in wave.tolist()], 0.025, BLACK) for x in (-0.06, 0.06)]
    return merge((shifted(car_from_behind(BLACK), 0.0, 0.07, 0.19), *tracks))


def bend(side: int) -> Mesh:
    """Arrow that bends to the left (1) or the right (−1)."""
    shaft = line([(side * 0.07, -0.19), (side * 0.07, -0.02), (-side * 0.03, 0.08), (-side * 0.03, 0.12)], 0.05, BLACK)
    tip = flat([(-side * 0.03 - 0.06, 0.11), (-side * 0.03 + 0.06, 0.11), (-side * 0.03, 0.22)], BLACK)
    return merge((shaft, tip))


def queue_of_cars() -> Mesh:
    """Three cars, one behind the other."""
    places = ((0.0, -0.19, 0.24), (0.0, 0.02, 0.18), (0.0, 0.17, 0.12))
    return merge([shifted(car_from_behind(BLACK), x, y, size) for x, y, size in places])


def fog() -> Mesh:
    """Car in horizontal swathes of fog."""
    wave = np.linspace(-1.0, 1.0, 13)
    parts = [shifted(car_from_behind(BLACK), 0.0, -0.03, 0.17)]
    for height, reach in ((-0.17, 0.24), (-0.105, 0.2), (0.15, 0.07)):
        parts.append(line([(reach * s, height + 0.014 * np.sin(9 * s)) for s in wave.tolist()], 0.026, BLACK))
    return merge(parts)


def two_cars() -> Mesh:
    """Red car that overtakes a black one."""
    return merge([shifted(car_from_behind(m), x, -0.11, 0.25) for m, x in ((RED, -0.16), (BLACK, 0.16))])


def motorway() -> Mesh:
    """Two carriageways under a bridge."""
    carriageways = [
        flat([(side * 0.06, -0.38), (side * 0.27, -0.38), (side * 0.12, 0.32), (side * 0.03, 0.32)], FIELD)
        for side in (-1, 1)
    ]
    bridge = line([(-0.40, -0.05), (-0.33, 0.08), (0.33, 0.08), (0.40, -0.05)], 0.075, FIELD)
    return merge((*carriageways, bridge))
