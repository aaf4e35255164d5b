"""What is printed on the faces of signs, in the plane z = 0, in units of a sign's diameter."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fogsim.scene.polyline import cleaned, parallel
from fogsim.scene.solids import Material, disc, grid, merge, polygon
from fogsim.values.scene import Instance, Mesh, Surface


def _sheeting(red: float, green: float, blue: float) -> Material:
    return Material((red, green, blue), Surface.SHEETING)


RED = _sheeting(0.42, 0.022, 0.025)
FIELD = _sheeting(0.66, 0.66, 0.64)
BLACK = _sheeting(0.022, 0.022, 0.022)
GREY = _sheeting(0.24, 0.24, 0.24)
YELLOW = _sheeting(0.62, 0.40, 0.02)
BLUE = _sheeting(0.02, 0.07, 0.30)
DIODES = Material((0.95, 0.93, 0.85), Surface.DIODES_WHITE)
RED_DIODES = Material((0.75, 0.06, 0.05), Surface.DIODES_RED)

_BARS = (-0.28, -0.14, 0.0, 0.14, 0.28)

Corners = Sequence[tuple[float, float]]
_X, _Y, _Z = np.eye(3)


def flat(corners: Corners, material: Material) -> Mesh:
    """Convex polygon (`corners` (x, y))."""
    return polygon([(x, y, 0.0) for x, y in corners], material, _Z, Instance.SIGN)


def line(points: Corners, width: float, material: Material) -> Mesh:
    """Line through points (`points` (x, y))."""
    middle = cleaned(np.column_stack((np.array(points), np.zeros(len(points)))), 1e-4)
    edges = np.stack((parallel(middle, width / 2), parallel(middle, -width / 2)), axis=1)
    return grid(edges, material, _Z, instance=Instance.SIGN)


def text(words: str, height: float, material: Material, *, widest: float = 10.0) -> Mesh:
    """Text of a height, narrowed where it would be too wide."""
    plain = lettering(words, material)
    if not len(plain.faces):
        return plain
    narrow = min(1.0, widest / (height * float(np.ptp(plain.positions[:, 0]))))
    return replace(plain, positions=plain.positions * np.array([narrow * height, height, 1.0], np.float32))


_Stroke = list[tuple[float, float]]

_ADVANCE = 0.68  # distance between the middles of two characters in units of their height [-]
_WIDTH = 0.16  # of a stroke in units of the height [-]


def _arc(x: float, y: float, rx: float, ry: float, start: float, end: float) -> _Stroke:
    angle = np.radians(np.linspace(start, end, max(round(abs(end - start) / 36) + 1, 3)))
    return list(zip((x + rx * np.cos(angle)).tolist(), (y + ry * np.sin(angle)).tolist(), strict=True))


_SIX = [_arc(0.28, 0.27, 0.2, 0.2, 0, 360), [*_arc(0.36, 0.42, 0.28, 0.5, 110, 180), (0.08, 0.27)]]
_ROUND = _arc(0.28, 0.5, 0.2, 0.425, 0, 360)
_BOWL = [(0.1, 0.925), (0.3, 0.925), *_arc(0.3, 0.7, 0.18, 0.225, 90, -90), (0.1, 0.475)]

# Strokes of each character in a field 0.56 wide and 1 high.
_CHARACTERS: dict[str, list[_Stroke]] = {
    "0": [_ROUND],
    "1": [[(0.12, 0.74), (0.34, 0.92), (0.34, 0.0)]],
    "2": [[*_arc(0.28, 0.7, 0.2, 0.225, 170, -35), (0.07, 0.075), (0.5, 0.075)]],
    "3": [_arc(0.26, 0.715, 0.19, 0.21, 150, -90), _arc(0.26, 0.29, 0.22, 0.215, 90, -150)],
    "4": [[(0.53, 0.27), (0.06, 0.27), (0.36, 0.93)], [(0.4, 0.52), (0.4, 0.0)]],
    "5": [[(0.47, 0.925), (0.14, 0.925), (0.11, 0.5), *_arc(0.26, 0.31, 0.215, 0.235, 110, -145)]],
    "6": _SIX,
    "7": [[(0.05, 0.925), (0.47, 0.925), (0.2, 0.0)]],
    "8": [_arc(0.28, 0.715, 0.18, 0.205, 0, 360), _arc(0.28, 0.285, 0.205, 0.21, 0, 360)],
    "9": [[(0.56 - x, 1.0 - y) for x, y in stroke] for stroke in _SIX],
    "A": [[(0.04, 0.0), (0.28, 0.93), (0.52, 0.0)], [(0.12, 0.28), (0.44, 0.28)]],
    "B": [_BOWL, [(0.1, 0.0), (0.1, 1.0)], [(0.3, 0.475), *_arc(0.3, 0.275, 0.2, 0.2, 90, -90), (0.1, 0.075)]],
    "C": [_arc(0.3, 0.5, 0.22, 0.425, 50, 310)],
    "D": [[(0.1, 0.075), (0.1, 0.925), (0.25, 0.925), *_arc(0.25, 0.5, 0.23, 0.425, 90, -90), (0.1, 0.075)]],
    "E": [[(0.5, 0.925), (0.1, 0.925), (0.1, 0.075), (0.5, 0.075)], [(0.1, 0.5), (0.42, 0.5)]],
    "F": [[(0.5, 0.925), (0.1, 0.925), (0.1, 0.0)], [(0.1, 0.5), (0.42, 0.5)]],
    "G": [[*_arc(0.3, 0.5, 0.22, 0.425, 50, 335), (0.5, 0.45), (0.32, 0.45)]],
    "H": [[(0.08, 0.0), (0.08, 1.0)], [(0.48, 0.0), (0.48, 1.0)], [(0.08, 0.5), (0.48, 0.5)]],
    "I": [[(0.28, 0.0), (0.28, 1.0)]],
    "J": [[(0.42, 1.0), (0.42, 0.28), *_arc(0.25, 0.28, 0.17, 0.205, 0, -160)]],
    "K": [[(0.1, 0.0), (0.1, 1.0)], [(0.5, 1.0), (0.12, 0.42)], [(0.25, 0.6), (0.52, 0.0)]],
    "L": [[(0.1, 1.0), (0.1, 0.075), (0.5, 0.075)]],
    "M": [[(0.06, 0.0), (0.06, 0.93), (0.28, 0.4), (0.5, 0.93), (0.5, 0.0)]],
    "N": [[(0.08, 0.0), (0.08, 0.95), (0.48, 0.05), (0.48, 1.0)]],
    "O": [_ROUND],
    "P": [_BOWL, [(0.1, 0.0), (0.1, 1.0)]],
    "Q": [_ROUND, [(0.32, 0.25), (0.5, 0.0)]],
    "R": [_BOWL, [(0.1, 0.0), (0.1, 1.0)], [(0.28, 0.475), (0.5, 0.0)]],
    "S": [_arc(0.28, 0.71, 0.19, 0.215, 40, 270), _arc(0.28, 0.285, 0.2, 0.21, 90, -140)],
    "T": [[(0.04, 0.925), (0.52, 0.925)], [(0.28, 0.925), (0.28, 0.0)]],
    "U": [[(0.08, 1.0), (0.08, 0.28), *_arc(0.28, 0.28, 0.2, 0.205, 180, 360), (0.48, 1.0)]],
    "V": [[(0.05, 1.0), (0.28, 0.06), (0.51, 1.0)]],
    "W": [[(0.03, 1.0), (0.16, 0.06), (0.28, 0.7), (0.4, 0.06), (0.53, 1.0)]],
    "X": [[(0.06, 1.0), (0.5, 0.0)], [(0.5, 1.0), (0.06, 0.0)]],
    "Y": [[(0.05, 1.0), (0.28, 0.45), (0.51, 1.0)], [(0.28, 0.45), (0.28, 0.0)]],
    "Z": [[(0.06, 0.925), (0.48, 0.925), (0.07, 0.075), (0.5, 0.075)]],
    "-": [[(0.12, 0.45), (0.44, 0.45)]],
    "_": [[(0.04, 0.0), (0.52, 0.0)]],
    ".": [[(0.28, 0.0), (0.28, 0.16)]],
    ":": [[(0.28, 0.15), (0.28, 0.31)], [(0.28, 0.6), (0.28, 0.76)]],
    "/": [[(0.1, 0.0), (0.46, 1.0)]],
    "?": [[*_arc(0.28, 0.7, 0.2, 0.225, 170, -50), (0.28, 0.4), (0.28, 0.28)], [(0.28, 0.0), (0.28, 0.14)]],
}


def lettering(words: str, material: Material) -> Mesh:
    """Lay out a word or a number in the plane z = 0.

    Returns the text in units of its height, centred on the origin, reading along x with y up.
    """
    parts = []
    for place, character in enumerate(words.upper()):
        if character == " ":
            continue
        x = (place - len(words) / 2) * _ADVANCE + 0.06
        strokes = _CHARACTERS.get(character, _CHARACTERS["?"])
        parts += [line([(a + x, b - 0.5) for a, b in points], _WIDTH, material) for points in strokes]
    return merge(parts)


def _shifted(part: Mesh, x: float, y: float, size: float = 1.0) -> Mesh:
    """Part scaled and moved in its plane."""
    return replace(part, positions=part.positions * np.float32(size) + np.array([x, y, 0.0], np.float32))


def exclamation() -> Mesh:
    """Mark of a general warning."""
    dot = disc((0.0, -0.14, 0.0), 0.045, _X, _Y, BLACK, sides=12, instance=Instance.SIGN)
    return merge((flat([(-0.045, 0.22), (-0.025, -0.06), (0.025, -0.06), (0.045, 0.22)], BLACK), dot))


def _car_from_behind(material: Material) -> Mesh:
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
    return merge((_shifted(_car_from_behind(BLACK), 0.0, 0.07, 0.19), *tracks))


def bend(side: int) -> Mesh:
    """Arrow of a bend."""
    shaft = line([(side * 0.07, -0.19), (side * 0.07, -0.02), (-side * 0.03, 0.08), (-side * 0.03, 0.12)], 0.05, BLACK)
    tip = flat([(-side * 0.03 - 0.06, 0.11), (-side * 0.03 + 0.06, 0.11), (-side * 0.03, 0.22)], BLACK)
    return merge((shaft, tip))


def queue_of_cars() -> Mesh:
    """Three cars, one behind the other."""
    places = ((0.0, -0.19, 0.24), (0.0, 0.02, 0.18), (0.0, 0.17, 0.12))
    return merge([_shifted(_car_from_behind(BLACK), x, y, size) for x, y, size in places])


def fog() -> Mesh:
    """Car in horizontal swathes of fog."""
    wave = np.linspace(-1.0, 1.0, 13)
    parts = [_shifted(_car_from_behind(BLACK), 0.0, -0.03, 0.17)]
    for height, reach in ((-0.17, 0.24), (-0.105, 0.2), (0.15, 0.07)):
        parts.append(line([(reach * s, height + 0.014 * np.sin(9 * s)) for s in wave.tolist()], 0.026, BLACK))
    return merge(parts)


def two_cars() -> Mesh:
    """Red car that overtakes a black one."""
    return merge([_shifted(_car_from_behind(m), x, -0.11, 0.25) for m, x in ((RED, -0.16), (BLACK, 0.16))])


def walking_figure() -> Mesh:
    """Person who walks, above the bars of a crossing."""
    head = disc((0.03, 0.29, 0.0), 0.065, _X, _Y, FIELD, sides=12, instance=Instance.SIGN)
    limbs = (
        [(0.01, 0.21), (-0.02, 0.0)],
        [(-0.02, 0.0), (0.10, -0.12), (0.13, -0.27)],
        [(-0.03, 0.0), (-0.10, -0.14), (-0.19, -0.26)],
        [(0.01, 0.17), (0.11, 0.06), (0.19, 0.04)],
        [(0.0, 0.17), (-0.12, 0.08), (-0.15, -0.03)],
    )
    bars = [flat([(x - 0.04, -0.41), (x + 0.04, -0.41), (x + 0.04, -0.34), (x - 0.04, -0.34)], FIELD) for x in _BARS]
    return merge((head, *(line(points, 0.075, FIELD) for points in limbs), *bars))


def motorway() -> Mesh:
    """Two carriageways under a bridge."""
    carriageways = [
        flat([(side * 0.06, -0.38), (side * 0.27, -0.38), (side * 0.12, 0.32), (side * 0.03, 0.32)], FIELD)
        for side in (-1, 1)
    ]
    bridge = line([(-0.40, -0.05), (-0.33, 0.08), (0.33, 0.08), (0.40, -0.05)], 0.075, FIELD)
    return merge((*carriageways, bridge))
