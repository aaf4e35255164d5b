"""What of a network is near a line, in coordinates that single precision holds to the millimetre."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.polyline import Points
from fogsim.values.road import RoadNetwork, SignMap

T = TypeVar("T")

REACH = 1700.0
"""What is nearer to a line than this [m] belongs to its surroundings; renderers show little that is farther away."""

_SQUARE = 250.0  # side of the squares that index what is near [m]
_ORIGINS = 10_000.0  # origins are multiples of this [m], so that networks near the origin of theirs keep it


@dataclass(frozen=True, slots=True)
class Surroundings:
    """Part of a network."""

    # Its lanes, areas and traffic lights; its route is the whole one. Places are counted from the origin
    network: RoadNetwork
    signs: SignMap  # Its signs, too
    origin: NDArray[np.float64]  # (3,): Where that origin is in the network's own coordinates [m]
    whole: bool  # True if nothing has been left out


def surroundings(network: RoadNetwork, signs: SignMap, line: Points) -> Surroundings:
    """Surroundings of a line, as a rule the route (`line` (n, 3) [m])."""
    plane = line[:, :2]
    origin = np.append(np.round(0.5 * (plane.min(axis=0) + plane.max(axis=0)) / _ORIGINS) * _ORIGINS, 0.0)
    near = Corridor(line, REACH)
    lanes = _chosen(network.lanes, near.reaches([lane.centreline for lane in network.lanes]))
    areas = _chosen(network.areas, near.reaches([area.outline for area in network.areas]))
    posts = _chosen(signs.signs, near.reaches([np.array([sign.position]) for sign in signs.signs]))
    beside = _chosen(network.structures, near.reaches([one.line for one in network.structures]))
    heads = _chosen(network.signal_heads, near.reaches([np.array([head.post]) for head in network.signal_heads]))
    if origin.any():
        lanes = [replace(lane, centreline=lane.centreline - origin) for lane in lanes]
        areas = [replace(area, outline=area.outline - origin) for area in areas]
        beside = [replace(one, line=one.line - origin) for one in beside]
        heads = [replace(h, position=_moved(h.position, origin), post=_moved(h.post, origin)) for h in heads]
    return Surroundings(
        replace(
            network,
            lanes=tuple(lanes),
            route=network.route - origin,
            areas=tuple(areas),
            structures=tuple(beside),
            signal_heads=tuple(heads),
        ),
        SignMap(tuple(replace(sign, position=_moved(sign.position, origin)) for sign in posts)),
        origin,
        whole=(len(lanes), len(areas), len(beside), len(posts))
        == (len(network.lanes), len(network.areas), len(network.structures), len(signs.signs)),
    )


def _chosen(things: Sequence[T], kept: Sequence[bool]) -> list[T]:
    return [thing for thing, is_kept in zip(things, kept, strict=True) if is_kept]


def _moved(position: tuple[float, float, float], origin: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = (np.array(position) - origin).tolist()
    return x, y, z


class Corridor:
    """Places near a line (`line` (n, 3) [m], `reach` [m])."""

    def __init__(self, line: Points, reach: float) -> None:
        corner = line[:, :2].min(axis=0) - reach - _SQUARE
        size = np.ceil((line[:, :2].max(axis=0) + reach + _SQUARE - corner) / _SQUARE).astype(int)
        self._corner = corner
        self._near = np.zeros(size, np.bool_)
        wide = int(np.ceil(reach / _SQUARE))
        i, j = np.mgrid[-wide : wide + 1, -wide : wide + 1]
        around = np.column_stack((i.ravel(), j.ravel()))[np.hypot(i, j).ravel() * _SQUARE <= reach + _SQUARE]
        for square in np.unique(self._squares(_dense(line)), axis=0):
            column, row = np.clip(square + around, 0, size - 1).T
            self._near[column, row] = True

    def _squares(self, places: NDArray[np.float64]) -> NDArray[np.int64]:
        return np.asarray(np.floor((places[:, :2] - self._corner) / _SQUARE), np.int64)

    def contains(self, places: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which places are near (`places` (n, 2 or 3) [m])."""
        squares = self._squares(places)
        inside = np.all((squares >= 0) & (squares < self._near.shape), axis=1)
        result = np.zeros(len(places), np.bool_)
        result[inside] = self._near[squares[inside, 0], squares[inside, 1]]
        return result

    def reaches(self, lines: Sequence[NDArray[np.float64]]) -> list[bool]:
        """Which lines have any part near (`lines` (n, 2 or 3) [m])."""
        if not lines:
            return []
        dense = _dense_lines(lines)
        near = self.contains(np.concatenate([points[:, :2] for points in dense]))
        first = np.cumsum([0, *map(len, dense[:-1])])
        found: list[bool] = np.logical_or.reduceat(near, first).tolist()
        return found


Nearness = Corridor
"""The old name."""


def _dense_lines(lines: Sequence[NDArray[np.float64]]) -> list[NDArray[np.float64]]:
    """Lines as from `_dense`: few are so long that they need it."""
    places = np.concatenate([line[:, :2] for line in lines])
    owner = np.repeat(np.arange(len(lines)), [len(line) for line in lines])
    far = (np.abs(np.diff(places, axis=0)) > _SQUARE).any(axis=1) & (owner[1:] == owner[:-1])
    dense = list(lines)
    for number in np.unique(owner[1:][far]).tolist():
        dense[number] = _dense(dense[number])
    return dense


def _dense(line: NDArray[np.float64]) -> NDArray[np.float64]:
    """A line with points enough that none of the squares that it crosses is stepped over."""
    if len(line) < 2 or np.max(np.abs(np.diff(line[:, :2], axis=0))) <= _SQUARE:
        return line
    pieces = [
        start + np.linspace(0.0, 1.0, int(np.max(np.abs(step[:2])) / _SQUARE) + 2)[:, None] * step
        for start, step in zip(line[:-1], np.diff(line, axis=0), strict=True)
    ]
    return np.concatenate(pieces)
