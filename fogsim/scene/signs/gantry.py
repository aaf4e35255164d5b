"""Gantries: what signs over a carriageway hang from."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import matrix_product
from fogsim.scene.polyline import cleaned
from fogsim.scene.solids import Material, box, merge, moved
from fogsim.scene.terrain import Terrain
from fogsim.values.road import Lane, LaneKind, Sign
from fogsim.values.scene import Mesh

_STEEL = Material((0.25, 0.26, 0.27))
_SIDEWAYS = 30.0  # lanes farther to the side belong to another road [m]
_BESIDE = 1.3  # legs stand this far beyond shoulder and rail [m]
_SAME = 3.0  # signs nearer to one another along the road hang from one gantry [m]


@dataclass(frozen=True, slots=True)
class Gantry:
    """A bridge of steel over a carriageway."""

    signs: tuple[Sign, ...]  # What hangs from it
    # How far to the right and to the left of its first sign its legs stand [m], to the left positive
    reach: tuple[float, float]


def gantries(signs: Sequence[Sign], lanes: Sequence[Lane]) -> list[Gantry]:
    """Gantries for those signs whose middle lies over a lane."""
    found: list[Gantry] = []
    if not signs:
        return found
    pieces = _Pieces(lanes)
    for sign in signs:
        reach = pieces.carriageway(sign)
        if reach is None:
            continue
        for place, gantry in enumerate(found):
            if _together(gantry.signs[0], sign):
                found[place] = Gantry((*gantry.signs, sign), gantry.reach)
                break
        else:
            found.append(Gantry((sign,), reach))
    return found


def _together(one: Sign, other: Sign) -> bool:
    offset = np.subtract(other.position, one.position)
    along = offset[0] * np.cos(one.heading) + offset[1] * np.sin(one.heading)
    return bool(abs(along) < _SAME and np.hypot(offset[0], offset[1]) < _SIDEWAYS and abs(offset[2]) < _SAME)


class _Pieces:
    """Straight pieces of all lanes of carriageways."""

    def __init__(self, lanes: Sequence[Lane]) -> None:
        driven = [lane for lane in lanes if lane.kind in {LaneKind.CARRIAGEWAY, LaneKind.JUNCTION}]
        lines = [cleaned(lane.centreline) for lane in driven]
        self._start = np.concatenate([line[:-1] for line in lines])
        self._step = np.concatenate([np.diff(line, axis=0) for line in lines])
        counts = [len(line) - 1 for line in lines]
        self._half = np.repeat([lane.width / 2 for lane in driven], counts)

    def carriageway(self, sign: Sign) -> tuple[float, float] | None:
        """Where legs stand to the right and left of a sign over a carriageway [m]; None if no lane is below it."""
        ahead = np.array([np.cos(sign.heading), np.sin(sign.heading)])
        left, half = self._crossed(sign, ahead)
        # Lanes of junctions lie one on the other: rounding must not say which comes first.
        order = np.argsort(np.round(left, 6), kind="stable")
        left, half = left[order], half[order]
        over = np.flatnonzero(np.abs(left) < half)
        if not len(over):
            return None
        first = last = int(over[0])
        while first > 0 and left[first] - left[first - 1] < half[first] + half[first - 1] + 0.5:
            first -= 1
        while last + 1 < len(left) and left[last + 1] - left[last] < half[last] + half[last + 1] + 0.5:
            last += 1
        return float(left[first] - half[first] - 2.5 - _BESIDE), float(left[last] + half[last] + 1.0 + _BESIDE)

    def _crossed(self, sign: Sign, ahead: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Offset to the left and half width [m] of the lanes that lead through the sign's plane in its direction."""
        offset = self._start[:, :2] - np.array(sign.position[:2])
        before, ahead_of = matrix_product(offset, ahead), matrix_product(offset + self._step[:, :2], ahead)
        through = (before <= 0) & (ahead_of > 0) & (sign.position[2] > self._start[:, 2])
        through &= np.abs(sign.position[2] - self._start[:, 2]) < 10.0
        share = before[through] / (before[through] - ahead_of[through])
        places = offset[through] + share[:, None] * self._step[through, :2]
        left = matrix_product(places, np.array([-ahead[1], ahead[0]]))
        near = np.abs(left) < _SIDEWAYS
        return left[near], self._half[through][near]


def gantry_mesh(gantry: Gantry, terrain: Terrain) -> Mesh:
    """Two legs and a beam of two tubes with struts, behind the signs."""
    first = gantry.signs[0]
    right, left = gantry.reach
    ahead = np.array([np.cos(first.heading), np.sin(first.heading), 0.0])
    side = np.array([-ahead[1], ahead[0], 0.0])
    feet = np.array([first.position + side * reach for reach in gantry.reach])
    down = terrain.height(feet[:, :2]) - first.position[2] - 0.3
    parts = [
        box((0.35, reach - 0.18, float(foot)), (0.75, reach + 0.18, 0.55), _STEEL)
        for reach, foot in zip(gantry.reach, down, strict=True)
    ]
    for low in (-0.45, 0.35):
        parts += [box((x, right, low), (x + 0.12, left, low + 0.14), _STEEL) for x in (0.34, 0.66)]
    struts = np.linspace(right, left, max(round((left - right) / 1.6), 2) + 1)
    for a, b in zip(struts[:-1].tolist(), struts[1:].tolist(), strict=True):
        parts.append(_strut(a, b))
    matrix = np.eye(4)
    matrix[:3, :3] = np.column_stack((ahead, side, (0.0, 0.0, 1.0)))
    matrix[:3, 3] = first.position
    return moved(merge(parts), matrix)


def _strut(start: float, end: float) -> Mesh:
    """Diagonal of the beam's front."""
    tilt = np.eye(4)
    length = float(np.hypot(end - start, 0.7))
    cosine, sine = (end - start) / length, 0.7 / length
    tilt[1:3, 1:3] = [[cosine, -sine], [sine, cosine]]
    tilt[:3, 3] = (0.4, start, -0.38)
    return moved(box((-0.03, 0.0, -0.04), (0.03, length, 0.04), _STEEL), tilt)
