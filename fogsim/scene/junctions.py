"""Paved areas where roads meet: their pavement, and which parts of their borders are free."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.scene.edges import Edge, border_edge
from fogsim.scene.lane_index import LaneIndex
from fogsim.scene.polyline import Points, cleaned, refined, true_spans
from fogsim.scene.road import ASPHALT, FLAGSTONES, KERB
from fogsim.scene.solids import concave_faces, mesh
from fogsim.values.road import Lane, LaneKind, PavedArea
from fogsim.values.scene import Instance, Mesh

_BELOW = 0.003  # junctions lie this far below the lanes that lead to them [m], so that lines end at full width
_PIECE = 1.0  # longest piece of a border that is free or not as a whole [m]
_MEETS = 1.5  # a border begins at the lane whose edge ends no farther away than this [m]
_LAP = 0.3  # length by which what lies along a border overlaps what lies along the roads that lead to it [m]
_TOUCHING = 6.0  # lanes that end no farther than this from a corner lead to the junction [m]


def area_mesh(area: PavedArea) -> Mesh | None:
    """Pavement of an area without a hole; None where the area is too narrow to see."""
    outline = _counterclockwise(area)
    if len(outline) < 3 or abs(_area(outline)) < 0.05:
        return None
    footway = area.kind is LaneKind.FOOTWAY
    points = outline + np.array([0.0, 0.0, KERB if footway else -_BELOW])
    faces, up = concave_faces(outline[:, :2]), np.broadcast_to((0.0, 0.0, 1.0), outline.shape)
    if footway:
        return mesh(points, faces, up, FLAGSTONES)
    road = np.zeros((len(points), 4))
    road[:, :2] = outline[:, :2] - outline[:, :2].min(axis=0)
    # Far from the middle of any lane, so that no wheel has worn a track.
    road[:, 1] += 100.0
    road[:, 2] = 1.75
    return mesh(points, faces, up, ASPHALT, road=road, instance=Instance.ROAD)


def walkable(areas: Sequence[PavedArea], lanes: Sequence[Lane]) -> list[PavedArea]:
    """Areas without those for walking that vehicles drive over, as where a footway ends at a junction."""
    if not lanes or not any(area.kind is LaneKind.FOOTWAY for area in areas):
        return list(areas)
    places = np.concatenate([refined(cleaned(lane.centreline), _PIECE)[:, :2] for lane in lanes])
    places = places[np.argsort(places[:, 0], kind="stable")]
    return [area for area in areas if area.kind is not LaneKind.FOOTWAY or not _any_within(places, area)]


def _any_within(places: NDArray[np.float64], area: PavedArea) -> bool:
    """Whether an area has one of some places (n, 2), which are sorted by x."""
    outline = _counterclockwise(area)[:, :2]
    (west, south), (east, north) = outline.min(axis=0), outline.max(axis=0)
    near = places[np.searchsorted(places[:, 0], west) : np.searchsorted(places[:, 0], east)]
    near = near[(near[:, 1] > south) & (near[:, 1] < north)]
    return len(near) > 0 and bool(np.any(_within(near, outline)))


def _area(outline: Points) -> float:
    x, y = outline[:, 0], outline[:, 1]
    return float(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def _counterclockwise(area: PavedArea) -> Points:
    outline = cleaned(area.outline)
    if len(outline) > 1 and np.hypot(*(outline[0, :2] - outline[-1, :2])) < 0.05:
        outline = outline[:-1]
    return outline if _area(outline) >= 0 else outline[::-1]


def free_borders(areas: Sequence[PavedArea], lanes: Sequence[Lane], everything: LaneIndex) -> Iterator[Edge]:
    """Parts of the borders of junctions where no road leads on."""
    index, ends = LaneIndex(lanes), _Ends(lanes)
    for outline in map(_counterclockwise, areas):
        if len(outline) > 2:
            speed_limit = ends.speed_limit(outline)
            if speed_limit > 0:
                for line in _free_parts(outline, index, everything):
                    longer, footways = ends.led_on(line)
                    yield border_edge(longer, speed_limit, footways, index)


class _Ends:
    """Both ends of lanes."""

    def __init__(self, lanes: Sequence[Lane]) -> None:
        lines = [cleaned(lane.centreline) for lane in lanes]
        place = np.array([line[[0, -1], :2] for line in lines]).reshape(-1, 2)
        out = np.array([(line[1, :2] - line[0, :2], line[-2, :2] - line[-1, :2]) for line in lines]).reshape(-1, 2)
        order = np.argsort(place[:, 0], kind="stable")
        self._place, self._out = place[order], (out / np.hypot(*out.T)[:, None])[order]
        self._half, self._limit, self._footway = (
            np.repeat(values, 2)[order]
            for values in (
                [0.5 * lane.width for lane in lanes],
                [lane.speed_limit for lane in lanes],
                [lane.kind is LaneKind.FOOTWAY for lane in lanes],
            )
        )

    def _near(self, west: float, east: float) -> slice:
        return slice(*np.searchsorted(self._place[:, 0], (west, east)).tolist())

    def speed_limit(self, outline: Points) -> float:
        """Highest speed limit of the lanes that lead to a junction [m/s]; 0 if none does."""
        near = self._near(outline[:, 0].min() - _TOUCHING, outline[:, 0].max() + _TOUCHING)
        apart = np.abs(self._place[near, None] - outline[None, :, :2]).sum(axis=2).min(axis=1)
        return float(self._limit[near][apart < _TOUCHING].max(initial=0.0))

    def led_on(self, line: Points) -> tuple[Points, bool]:
        """A part of a border with short pieces along the roads at its ends, and whether one of those is a footway."""
        parts, footways = [line], False
        for at, where in ((0, 0), (-1, len(line))):
            near = self._near(line[at, 0] - _TOUCHING, line[at, 0] + _TOUCHING)
            out, offset = self._out[near], line[at, :2] - self._place[near]
            along = np.abs(np.sum(offset * out, axis=1))
            aside = np.abs(np.abs(offset[:, 0] * out[:, 1] - offset[:, 1] * out[:, 0]) - self._half[near])
            if len(out) and np.min(along + aside) < _MEETS:
                chosen = int(np.argmin(along + aside))
                footways |= bool(self._footway[near][chosen])
                parts.insert(min(where, len(parts)), line[at] + np.append(_LAP * out[chosen], 0.0)[None, :])
        return np.concatenate(parts), footways


def _free_parts(corners: Points, index: LaneIndex, everything: LaneIndex) -> Iterator[Points]:
    # In short pieces, since a road may lead on from the middle of a long side.
    outline = refined(np.concatenate((corners, corners[:1])), _PIECE)[:-1]
    following = np.roll(outline, -1, axis=0)
    step = following - outline
    outward = np.column_stack((step[:, 1], -step[:, 0])) / np.hypot(step[:, 0], step[:, 1])[:, None]
    beside = 0.5 * (outline + following)
    beside[:, :2] += 0.4 * outward
    free = index.clearance(beside, same_level=2.5, within=1.0) > 0.1
    free &= everything.clearance(beside, same_level=2.5, within=1.0) > -0.1
    for span in _spans_around(free):
        line = np.concatenate((outline[span], following[span[-1:]]))
        if np.sum(np.hypot(*np.diff(line[:, :2], axis=0).T)) > 0.1:
            yield line


def _spans_around(chosen: NDArray[np.bool_]) -> list[NDArray[np.int64]]:
    """Spans of neighbours that are chosen on a ring; a ring that is chosen whole is one span."""
    count = len(chosen)
    if chosen.all():
        return [np.arange(count)]
    first = int(np.argmin(chosen))
    order = (np.arange(count) + first) % count
    return [order[start:end] for start, end in true_spans(chosen[order])]


class Areas:
    """Which places lie on a paved area."""

    def __init__(self, areas: Sequence[PavedArea]) -> None:
        outlines = [_counterclockwise(area)[:, :2] for area in areas]
        self._corners = np.concatenate([np.zeros((0, 2)), *outlines])
        self._first = np.cumsum([0, *map(len, outlines)])

    def cover_all(self, lines: Sequence[Points]) -> list[bool]:
        """Whether one area has all points of a line inside or on its border, for each of some lines.

        Takes `lines` (n, 3) [m].
        """
        points = np.concatenate([np.zeros((0, 2)), *(line[:, :2] for line in lines)])
        covered: list[bool] = _covered(points, np.cumsum([0, *map(len, lines)]), self._corners, self._first).tolist()
        return covered


@kernel
def _covered(
    points: NDArray[np.float64], first: NDArray[np.int64], corners: NDArray[np.float64], begin: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Which lines (points from `first` on) lie within one of some outlines (corners from `begin` on)."""
    result = np.zeros(len(first) - 1, np.bool_)
    low, high = np.empty((len(begin) - 1, 2)), np.empty((len(begin) - 1, 2))
    for area in range(len(begin) - 1):
        low[area], high[area] = _extremes(corners[begin[area] : begin[area + 1]])
    for line in range(len(first) - 1):
        own = points[first[line] : first[line + 1]]
        west_south, east_north = _extremes(own)
        middle_x, middle_y = 0.0, 0.0
        for i in range(len(own)):
            middle_x, middle_y = middle_x + own[i, 0], middle_y + own[i, 1]
        middle_x, middle_y = middle_x / len(own), middle_y / len(own)
        # Points on the border, where lanes begin, count: they are moved a little towards the middle of all.
        drawn_in = np.empty((len(own), 2))
        for i in range(len(own)):
            drawn_in[i, 0] = own[i, 0] + 0.02 * (middle_x - own[i, 0])
            drawn_in[i, 1] = own[i, 1] + 0.02 * (middle_y - own[i, 1])
        for area in range(len(low)):
            if (
                low[area, 0] < west_south[0] + 0.1
                and low[area, 1] < west_south[1] + 0.1
                and east_north[0] - 0.1 < high[area, 0]
                and east_north[1] - 0.1 < high[area, 1]
                and _lie_within(drawn_in, corners[begin[area] : begin[area + 1]]).all()
            ):
                result[line] = True
                break
    return result


@kernel
def _extremes(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Least and greatest coordinates of points (n, 2)."""
    low, high = points[0].copy(), points[0].copy()
    for i in range(1, len(points)):
        for axis in range(2):
            low[axis], high[axis] = min(low[axis], points[i, axis]), max(high[axis], points[i, axis])
    return low, high


def _within(points: NDArray[np.float64], outline: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which points (n, 2) lie within an outline (m, 2)."""
    return _lie_within(np.ascontiguousarray(points), np.ascontiguousarray(outline))


@kernel
def _lie_within(points: NDArray[np.float64], outline: NDArray[np.float64]) -> NDArray[np.bool_]:
    """From which points (n, 2) a ray to the east crosses an outline (m, 2) an odd number of times."""
    result = np.zeros(len(points), np.bool_)
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        for j in range(len(outline)):
            k = j + 1 if j + 1 < len(outline) else 0
            if (outline[j, 1] > y) != (outline[k, 1] > y):
                share = (y - outline[j, 1]) / (outline[k, 1] - outline[j, 1])
                if x < outline[j, 0] + share * (outline[k, 0] - outline[j, 0]):
                    result[i] = not result[i]
    return result
