"""Letters and digits as strokes for the faces of signs."""

import numpy as np

from fogsim.scene.polyline import cleaned, parallel
from fogsim.scene.solids import Material, grid, merge
from fogsim.values.scene import Mesh

ADVANCE = 0.68
"""Distance between the middles of two characters in units of their height [-]."""

STROKE = 0.16
"""Width of a stroke in units of the height [-]."""

Points = list[tuple[float, float]]


def _arc(x: float, y: float, rx: float, ry: float, start: float, end: float) -> Points:
    angle = np.radians(np.linspace(start, end, max(round(abs(end - start) / 36) + 1, 3)))
    return list(zip((x + rx * np.cos(angle)).tolist(), (y + ry * np.sin(angle)).tolist(), strict=True))


_SIX = [_arc(0.28, 0.27, 0.2, 0.2, 0, 360), [*_arc(0.36, 0.42, 0.28, 0.5, 110, 180), (0.08, 0.27)]]
_ROUND = _arc(0.28, 0.5, 0.2, 0.425, 0, 360)
_BOWL = [(0.1, 0.925), (0.3, 0.925), *_arc(0.3, 0.7, 0.18, 0.225, 90, -90), (0.1, 0.475)]

# Strokes of each character in a field 0.56 wide and 1 high.
_CHARACTERS: dict[str, list[Points]] = {
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


def stroke(points: Points, width: float, material: Material, instance: int) -> Mesh:
    """Line of a width through points of the plane z = 0, facing up."""
    line = cleaned(np.column_stack((np.array(points), np.zeros(len(points)))), 1e-4)
    edges = np.stack((parallel(line, width / 2), parallel(line, -width / 2)), axis=1)
    return grid(edges, material, (0, 0, 1), instance=instance)


def lettering(text: str, material: Material, instance: int) -> Mesh:
    """Lay out a word or a number in the plane z = 0.

    Parameters
    ----------
    text : str
        Letters, all drawn as capitals, digits and ``- _ . : / ?``; anything else is drawn as a question mark, spaces
        are left blank.
    material, instance
        Material and instance id.

    Returns
    -------
    Mesh
        The text in units of its height, centred on the origin, reading along x with y up.
    """
    parts = []
    for place, character in enumerate(text.upper()):
        if character == " ":
            continue
        x = (place - len(text) / 2) * ADVANCE + 0.06
        strokes = _CHARACTERS.get(character, _CHARACTERS["?"])
        parts += [stroke([(a + x, b - 0.5) for a, b in points], STROKE, material, instance) for points in strokes]
    return merge(parts)
