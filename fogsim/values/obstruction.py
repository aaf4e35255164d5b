"""What stands next to roads and over them, as something that lines of sight end at."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogsim.core.jit import kernel
from fogsim.values.road import Structure, StructureKind

_NUMBERS = 10
"""Numbers of a box."""

_Array = NDArray[np.float64]


@kernel
def _share_inside(start: _Array, end: _Array, box: _Array) -> float:
    """Share of a line (3,) [m] inside a box (10,) [-], the same from either end; 0 if it touches it."""
    # Rounding must not depend on who looks at whom.
    if (start[0], start[1], start[2]) > (end[0], end[1], end[2]):
        start, end = end, start
    x, y, step_x, step_y = start[0] - box[0], start[1] - box[1], end[0] - start[0], end[1] - start[1]
    along, step_along = x * box[3] + y * box[4], step_x * box[3] + step_y * box[4]
    across, step_across = y * box[3] - x * box[4], step_y * box[3] - step_x * box[4]
    above, step_above = start[2] - box[2] - box[5] * along, end[2] - start[2] - box[5] * step_along
    enters, leaves = 0.0, 1.0
    for place, step, low, high in (
        (along, step_along, 0.0, box[6]),
        (across, step_across, -box[7], box[7]),
        (above, step_above, box[8], box[9]),
    ):
        if step == 0.0:
            if not low < place < high:
                return 0.0
        else:
            first, last = (low - place) / step, (high - place) / step
            enters, leaves = max(enters, min(first, last)), min(leaves, max(first, last))
            if enters >= leaves:
                return 0.0
    return leaves - enters


@kernel
def _add_ways_inside(starts: _Array, ends: _Array, boxes: _Array, ways: _Array) -> None:
    """Add to each line's way (n,) [m] what of it lies inside boxes (m, 10)."""
    for line in range(len(starts)):
        x, y, z = ends[line] - starts[line]
        length = np.sqrt(x * x + y * y + z * z)
        for box in boxes:
            ways[line] += _share_inside(starts[line], ends[line], box) * length


@kernel
def _find_hidden(eyes: _Array, targets: _Array, boxes: _Array, bounds: _Array, hidden: NDArray[np.bool_]) -> None:
    """Find for each pair of eyes whether boxes hide all points of its target.

    Takes `eyes` (n, 3) [m], `targets` (n, k, 3) [m], `boxes` (m, 10) from west to east, their `bounds` (5, m), least
    and most of x and of y that each has, and most of x of those up to it [m], and `hidden` (n,) bool.
    """
    near = np.empty(len(boxes), np.int64)
    for one in range(len(eyes)):
        count = _boxes_near(eyes[one], targets[one], bounds, near)
        hidden[one] = count > 0
        for point in targets[one]:
            is_free = True
            for number in near[:count]:
                if _share_inside(eyes[one], point, boxes[number]) > 0.0:
                    is_free = False
                    break
            if is_free:
                hidden[one] = False
                break


@kernel
def _find_near(eyes: _Array, targets: _Array, reaches: _Array, bounds: _Array, found: NDArray[np.bool_]) -> None:
    """Find (n,) whether boxes may be between eyes and what reaches so far about a target [m]; `bounds` (5, m)."""
    near, ends = np.empty(bounds.shape[1], np.int64), np.empty((2, 3))
    for one in range(len(eyes)):
        ends[0], ends[1] = targets[one] - reaches[one], targets[one] + reaches[one]
        found[one] = _boxes_near(eyes[one], ends, bounds, near) > 0


@kernel
def _boxes_near(eyes: _Array, points: _Array, bounds: _Array, near: NDArray[np.int64]) -> int:
    """Write the numbers of those boxes that may be between eyes and points; returns how many."""
    west = east = eyes[0]
    south = north = eyes[1]
    for point in points:
        west, east = min(west, point[0]), max(east, point[0])
        south, north = min(south, point[1]), max(north, point[1])
    count = 0
    # No box before this one comes as far as the westernmost point.
    for number in range(np.searchsorted(bounds[4], west), bounds.shape[1]):
        if bounds[0, number] > east:
            break
        if bounds[1, number] >= west and bounds[2, number] <= north and bounds[3, number] >= south:
            near[count] = number
            count += 1
    return count


_STRAIGHT = 0.01
"""Points of a line that are no farther from the straight one without them are left out [m]."""

_SHORTEST = 1e-6
"""Pieces of a line that are shorter than this in plan have no direction [m]."""


class Obstructions:
    """Boxes that hide what is behind them; ``bool`` of it is false where there are none (`boxes` (m, 10))."""

    def __init__(self, boxes: NDArray[np.float64]) -> None:
        self._boxes = boxes
        bounds = _bounds(boxes)
        order = bounds[:, 0].argsort(kind="stable")
        self._from_west, bounds = boxes[order], bounds[order]
        self._bounds = np.stack([*bounds.T, np.maximum.accumulate(bounds[:, 1])])

    def __len__(self) -> int:
        """Number of boxes."""
        return len(self._boxes)

    def hide(self, eyes: ArrayLike, targets: ArrayLike) -> NDArray[np.bool_]:
        """Whether targets' points (n, k, 3) are all hidden from eyes (n, 3) [m]; the same the other way round."""
        starts = np.ascontiguousarray(eyes, np.float64).reshape(-1, 3)
        hidden = np.zeros(starts.shape[0], np.bool_)
        if self._boxes.size and hidden.size:
            points = np.ascontiguousarray(targets, np.float64).reshape(hidden.size, -1, 3)
            _find_hidden(starts, points, self._from_west, self._bounds, hidden)
        return hidden

    def are_near(self, eyes: _Array, targets: _Array, reaches: _Array) -> NDArray[np.bool_]:
        """Whether anything may be between eyes (n, 3) and what reaches so far (n,) about a target [m]."""
        found = np.empty(len(eyes), np.bool_)
        _find_near(eyes, targets, reaches, self._bounds, found)
        return found

    def way_through(self, starts: ArrayLike, ends: ArrayLike) -> NDArray[np.float64]:
        """How much of straight lines (n, 3) [m] lies inside (n,) [m]; where boxes overlap, it counts twice."""
        first, last = (np.ascontiguousarray(points, np.float64).reshape(-1, 3) for points in (starts, ends))
        ways = np.zeros(len(first))
        if len(self._boxes):
            _add_ways_inside(first, last, self._boxes, ways)
        return ways


def _bounds(boxes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Least and most of x, and of y, that each box has (m, 4) [m]."""
    aside = boxes[:, 7, None] * np.abs(boxes[:, [4, 3]])
    ends = np.stack([boxes[:, :2], boxes[:, :2] + boxes[:, 6, None] * boxes[:, 3:5]])
    low, high = ends.min(axis=0) - aside, ends.max(axis=0) + aside
    return np.stack([low[:, 0], high[:, 0], low[:, 1], high[:, 1]], axis=1)


CLEAR_SIGHT = Obstructions(np.zeros((0, _NUMBERS)))
"""Nothing stands anywhere."""


def obstructions_of(structures: Iterable[Structure]) -> Obstructions:
    """Obstructions that structures are."""
    boxes = [box for one in structures for box in _box_rows(one.line, 0.5 * one.width, (one.bottom, one.top))]
    return Obstructions(np.array(boxes)) if boxes else CLEAR_SIGHT


def _box_rows(line: NDArray[np.float64], half_width: float, heights: tuple[float, float]) -> list[tuple[float, ...]]:
    """A box for each piece of a line (n, 3) [m] that is straight to a centimetre, without gaps between them."""
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


_LEAST_HEIGHT = 2.0
"""A roof is a structure of kind tunnel whose underside is higher than this above its line [m]."""

_SKIN, _END = 0.1, 0.02
"""How far a space reaches into the roof over it and stays within it to the sides, and ends before its portals [m].

So what is seen of ceiling and walls from within is in it, and what is seen from without is not, rounding or no.
"""


@dataclass(frozen=True, slots=True)
class Tunnel:
    """A space with a roof and walls, open at both ends."""

    line: NDArray[np.float64]  # (n, 3): Its middle on the road, from one portal to the other [m]
    half_width: float  # Half of its width, walls included [m]
    height: float  # Height of its ceiling above the road [m]

    @property
    def length(self) -> float:
        """Length along its line in plan [m]."""
        steps = np.diff(self.line[:, :2], axis=0)
        return float(np.sqrt(np.einsum("ij,ij->i", steps, steps)).sum())

    def boxes(self) -> NDArray[np.float64]:
        """Its space as boxes (m, 10), in order along its line; see `fogsim.values.obstruction`."""
        rows = np.array(_box_rows(self.line, self.half_width - _SKIN, (-1.0, self.height + _SKIN)))
        # The first begins, and the last ends, behind the portal.
        rows[0, :3] += _END * np.append(rows[0, 3:5], rows[0, 5])
        rows[0, 6] -= _END
        rows[-1, 6] -= _END
        return rows


def tunnels_of(structures: Iterable[Structure]) -> tuple[Tunnel, ...]:
    """Tunnels among structures: what is under their roofs."""
    return tuple(
        Tunnel(one.line, 0.5 * one.width, one.bottom)
        for one in structures
        if one.kind is StructureKind.TUNNEL and one.bottom > _LEAST_HEIGHT
    )
