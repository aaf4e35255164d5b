"""Digits as strokes for the faces of signs."""

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.polyline import cleaned, parallel
from fogsim.scene.solids import Material, grid, merge
from fogsim.values.scene import Mesh

_WIDTH = 0.56  # width of a digit in units of its height [-]
_STROKE = 0.15  # width of a stroke in units of the height [-]


def _arc(x: float, y: float, rx: float, ry: float, start: float, end: float) -> list[tuple[float, float]]:
    angle = np.radians(np.linspace(start, end, max(int(abs(end - start) / 20), 3)))
    return list(zip((x + rx * np.cos(angle)).tolist(), (y + ry * np.sin(angle)).tolist(), strict=True))


_SIX = [_arc(0.28, 0.27, 0.2, 0.2, 0, 360), [*_arc(0.36, 0.42, 0.28, 0.5, 110, 180), (0.08, 0.27)]]
_DIGITS: dict[str, list[list[tuple[float, float]]]] = {
    "0": [_arc(0.28, 0.5, 0.2, 0.425, 0, 360)],
    "1": [[(0.12, 0.74), (0.34, 0.92), (0.34, 0.0)]],
    "2": [[*_arc(0.28, 0.7, 0.2, 0.225, 170, -35), (0.07, 0.075), (0.5, 0.075)]],
    "3": [_arc(0.26, 0.715, 0.19, 0.21, 150, -90), _arc(0.26, 0.29, 0.22, 0.215, 90, -150)],
    "4": [[(0.53, 0.27), (0.06, 0.27), (0.36, 0.93)], [(0.4, 0.52), (0.4, 0.0)]],
    "5": [[(0.47, 0.925), (0.14, 0.925), (0.11, 0.5), *_arc(0.26, 0.31, 0.215, 0.235, 110, -145)]],
    "6": _SIX,
    "7": [[(0.05, 0.925), (0.47, 0.925), (0.2, 0.0)]],
    "8": [_arc(0.28, 0.715, 0.18, 0.205, 0, 360), _arc(0.28, 0.285, 0.205, 0.21, 0, 360)],
    "9": [[(0.56 - x, 1.0 - y) for x, y in stroke] for stroke in _SIX],
}


def _stroke(points: list[tuple[float, float]], matt: Material, instance: int) -> Mesh:
    line = cleaned(np.column_stack((np.array(points), np.zeros(len(points)))), 1e-4)
    edges = np.stack((parallel(line, _STROKE / 2), parallel(line, -_STROKE / 2)), axis=1)
    return grid(edges, matt, (0, 0, 1), instance=instance)


def digits(text: str, material: Material, instance: int) -> Mesh:
    """Lay out a number in the plane z = 0.

    Parameters
    ----------
    text : str
        Digits; anything else is left blank.
    material, instance
        Material and instance id.

    Returns
    -------
    Mesh
        The number in units of its height, centred on the origin, reading along x with y up.
    """
    advance = _WIDTH + 0.12
    parts = []
    for place, character in enumerate(text):
        shift = np.array([(place - len(text) / 2) * advance + 0.06, -0.5])
        for points in _DIGITS.get(character, []):
            moved: NDArray[np.float64] = np.array(points) + shift
            parts.append(_stroke([(float(x), float(y)) for x, y in moved], material, instance))
    return merge(parts)
