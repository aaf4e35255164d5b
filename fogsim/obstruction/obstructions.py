"""What stands next to roads and over them, as something that lines of sight end at."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogsim.obstruction.box_kernels import NUMBERS, add_ways_inside, find_hidden
from fogsim.values.road import Structure

_STRAIGHT = 0.01
"""Points of a line that are no farther from the straight one without them are left out [m]."""

_SHORTEST = 1e-6
"""Pieces of a line that are shorter than this in plan have no direction [m]."""


class Obstructions:
    """Boxes that hide what is behind them; ``bool`` of it is false where there are none (`boxes` (m, 10))."""

    def __init__(self, boxes: NDArray[np.float64]) -> None:
        self._boxes = boxes
        self._bounds = _bounds(boxes)

    def __len__(self) -> int:
        """Number of boxes."""
        return len(self._boxes)

    def hide(self, eyes: ArrayLike, targets: ArrayLike) -> NDArray[np.bool_]:
        """Whether targets are hidden: each of their points, from where they are looked at.

        Returns the same if eyes and a single point change places (n,) bool. Takes `eyes` (n, 3) [m], `targets` (n, k,
        3) [m].
        """
        starts = np.asarray(eyes, np.float64).reshape(-1, 3)
        hidden = np.zeros(len(starts), np.bool_)
        if len(self._boxes) and len(starts):
            points = np.ascontiguousarray(targets, np.float64).reshape(len(starts), -1, 3)
            find_hidden(np.ascontiguousarray(starts), points, self._boxes, self._bounds, hidden)
        return hidden

    def way_through(self, starts: ArrayLike, ends: ArrayLike) -> NDArray[np.float64]:
        """How much of straight lines lies inside [m].

        Returns where boxes overlap, what is in both counts twice (n,). Takes `starts`, `ends` (n, 3) [m].
        """
        first, last = (np.ascontiguousarray(points, np.float64).reshape(-1, 3) for points in (starts, ends))
        ways = np.zeros(len(first))
        if len(self._boxes):
            add_ways_inside(first, last, self._boxes, ways)
        return ways


def _bounds(boxes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Least and most of x, and of y, that each box has (m, 4) [m]."""
    aside = boxes[:, 7, None] * np.abs(boxes[:, [4, 3]])
    ends = np.stack([boxes[:, :2], boxes[:, :2] + boxes[:, 6, None] * boxes[:, 3:5]])
    low, high = ends.min(axis=0) - aside, ends.max(axis=0) + aside
    return np.stack([low[:, 0], high[:, 0], low[:, 1], high[:, 1]], axis=1)


CLEAR_SIGHT = Obstructions(np.zeros((0, NUMBERS)))
"""Nothing stands anywhere."""


def obstructions_of(structures: Iterable[Structure]) -> Obstructions:
    """Obstructions that structures are."""
    boxes = [box for one in structures for box in box_rows(one.line, 0.5 * one.width, (one.bottom, one.top))]
    return Obstructions(np.array(boxes)) if boxes else CLEAR_SIGHT


def box_rows(line: NDArray[np.float64], half_width: float, heights: tuple[float, float]) -> list[tuple[float, ...]]:
    """A box for each piece of a line that is straight to a centimetre; where two pieces meet, no one looks between.

    Takes `line` (n, 3) [m], `half_width` [m], `heights` [m].
    """
    line = _straightened(line)
    found, steps = list[tuple[float, ...]](), np.diff(line, axis=0).tolist()
    for start, (step_x, step_y, rise) in zip(line[:-1].tolist(), steps, strict=True):
        length = float(np.hypot(step_x, step_y))
        if length > _SHORTEST:
            direction = (step_x / length, step_y / length, rise / length)
            found.append((*start, *direction, length, half_width, *heights))
    return found


def _straightened(line: NDArray[np.float64]) -> NDArray[np.float64]:
    """A line without the points that it does not need (Douglas & Peucker 1973)."""
    along, places = line[-1] - line[0], line - line[0]
    share = (places * along).sum(axis=1) / max(float((along * along).sum()), _SHORTEST**2)
    off = places - share.clip(0.0, 1.0)[:, None] * along
    away = (off * off).sum(axis=1)
    farthest = int(away.argmax())
    if away[farthest] <= _STRAIGHT**2:
        return line[[0, -1]]
    return np.concatenate([_straightened(line[: farthest + 1])[:-1], _straightened(line[farthest:])])
