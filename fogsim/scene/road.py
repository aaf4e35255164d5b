"""Pavement: lanes with the attributes of their painted lines, transverse markings, footways, sides that are free."""

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.lane_index import LaneIndex
from fogsim.scene.polyline import (
    Chainage,
    Points,
    arc_length,
    at_distance,
    cleaned,
    left_normals,
    parallel,
    refined,
    true_spans,
)
from fogsim.scene.solids import Material, folds, grid, grid_faces, grid_normals, mesh
from fogsim.values.road import Lane, LaneEnd, LaneKind, LaneMarking
from fogsim.values.scene import Instance, Mesh, Surface

FAST = 22.0
"""Speed limit from which a road has wide shoulders, guard rails and delineators [m/s]."""

TOWN = 16.7
"""Speed limit up to which a road is a street, with kerbs and footways in place of shoulders [m/s]."""

KERB = 0.12
"""Height of a footway above the street [m]."""

ASPHALT = Material((0.088, 0.088, 0.090), Surface.ROAD)
FLAGSTONES = Material((0.155, 0.152, 0.146))
_KERBSTONE = Material((0.21, 0.208, 0.20))

LINE_CODE = {LaneMarking.NONE: 0, LaneMarking.SOLID: 1, LaneMarking.DASHED: 2, LaneMarking.DOUBLE: 1}
"""Lines by their number in the road attributes of a mesh."""

LONGEST = 40.0
"""Longest piece of a strip [m]: short enough to be culled in pieces."""

_LINE_WIDTH = 0.2
"""Width of the line that road attributes stand for [m]."""

_LOOK = 2.0  # whether a side is free is looked at every so many metres
_CLOSER = 8  # and so many times as closely where that changes
_OVERLAP = 0.03  # neighbouring lanes overlap by this much on each side [m], so that no gap shows between them
_LONGER = 0.1  # lanes reach this far beyond their ends [m], for junctions' outlines may leave gaps of centimetres
_LIFT = 0.002  # above the lane [m]
_STOP_WIDTH, _YIELD_WIDTH = 0.5, 0.35  # along the road [m]
_SETBACK = 0.4  # from the lane's end [m]
_INSET = 0.16  # the middle of each of two lines between directions lies this far inside its lane [m]


def lane_mesh(lane: Lane, chainage: Chainage) -> Mesh:
    """One lane as a strip with its road attributes."""
    centre = refined(cleaned(lane.centreline), LONGEST)
    placed = lengthened(np.column_stack((centre, chainage.along(lane, centre))))
    half = lane.width / 2
    lines = 3 * LINE_CODE[lane.left] + LINE_CODE[lane.right]
    # Lanes without lines are what runs across junctions; where they overlap others, the painted ones must show.
    lift = 0.0 if lines else -0.001
    # Where both directions of a road overlap, one of them must show: otherwise their dashes end in combs in bends.
    lift -= 0.0005 * chainage.follows(lane)
    left, right = (_INSET * (marking is LaneMarking.DOUBLE) for marking in (lane.left, lane.right))
    return strip(
        placed[:, :3],
        (half + _OVERLAP, -half - _OVERLAP),
        lift,
        half - 0.5 * (left + right),
        lines,
        placed[:, 3],
        middle=0.5 * (right - left),
    )


def lengthened(line: NDArray[np.float64]) -> NDArray[np.float64]:
    """A line a little longer at both ends (`line` (n, 3 or more) [m])."""
    longer = line.copy()
    for end, inner in ((0, 1), (-1, -2)) if len(line) > 1 else ():
        step = line[end] - line[inner]
        longer[end] += _LONGER / np.hypot(step[0], step[1]) * step
    return longer


def strip(
    line: Points,
    left: tuple[float | NDArray[np.float64], float | NDArray[np.float64]],
    lift: float,
    half: float,
    lines: int,
    along: NDArray[np.float64],
    material: Material = ASPHALT,
    middle: float = 0.0,
) -> Mesh:
    """Strip of road along a line.

    Takes `line` (n, 3) [m], `left` (n,) [m], `lift` [m], `half`, `lines`, `along` [m], `middle` [m].
    """
    points = np.stack([parallel(line, side, lift) for side in left], axis=1)
    road = np.empty((*points.shape[:2], 4))
    road[..., 0] = along[:, None]
    road[:, 0, 1], road[:, 1, 1] = left[0] - middle, left[1] - middle
    road[..., 2:] = half, lines
    return grid(points, material, (0, 0, 1), road=road.reshape(-1, 4), instance=Instance.ROAD)


def footway_mesh(line: Points, left: tuple[float, float | NDArray[np.float64]]) -> Mesh:
    """Footway with kerbs along a line, `KERB` above it (`line` (n, 3) [m], `left` (n,) [m])."""
    low, high = np.minimum(left[0], left[1]), np.maximum(left[0], left[1])
    stone = np.minimum(0.13, (high - low) / 2)
    # A kerbstone on each side, and how far above the line each fold of the profile lies.
    profile = [(low, -0.05), (low, KERB), (low + stone, KERB), (high - stone, KERB), (high, KERB), (high, -0.05)]
    rows = np.stack([parallel(line, offset, lift) for offset, lift in profile])
    side = parallel(line, 1.0)[0, :2] - line[0, :2]
    toward = np.array([[*(s * side), u] for s, u in ((-1, 0), (0, 1), (0, 1), (0, 1), (1, 0))])
    return folds(rows, (_KERBSTONE, _KERBSTONE, FLAGSTONES, _KERBSTONE, _KERBSTONE), toward)


def free_edges(lane: Lane, index: LaneIndex) -> Iterator[tuple[int, NDArray[np.float64]]]:
    """Spans of a lane's sides with nothing paved next to them.

    Yields 1 for the left or −1 for the right side, and the lane's centreline along the free span [m], with a vertex at
    least every 2 m (n, 3).
    """
    centre = refined(cleaned(lane.centreline), _LOOK)
    for side in (1, -1):
        if side < 0 and not lane.outermost and lane.kind is not LaneKind.FOOTWAY:
            continue
        fine, free = _looked_at(centre, side * (lane.width / 2 + 0.6), index)
        for start, end in true_spans(free, least=2):
            yield side, fine[start:end]


def _looked_at(line: Points, left: float, index: LaneIndex) -> tuple[Points, NDArray[np.bool_]]:
    """Which points of a line have no lane at a distance to their left [m], with more points where that changes."""
    free = index.clearance(parallel(line, left), same_level=2.5, within=1.0) > 0.2
    before = np.flatnonzero(free[1:] != free[:-1])
    if not len(before):
        return line, free
    share = np.arange(1, _CLOSER)[:, None] / _CLOSER
    between = line[before, None] + share * (line[before + 1] - line[before])[:, None]
    closer = np.insert(line, np.repeat(before + 1, _CLOSER - 1), between.reshape(-1, 3), axis=0)
    return closer, index.clearance(parallel(closer, left), same_level=2.5, within=1.0) > 0.2


def transverse_markings(lanes: Sequence[Lane]) -> list[Mesh]:
    """Stop lines, lines to give way at, and zebra crossings of all lanes."""
    parts = []
    for lane in lanes:
        line = cleaned(lane.centreline)
        if lane.kind is LaneKind.CROSSING:
            parts.append(_zebra(line, lane.width))
        elif lane.end is LaneEnd.STOP:
            parts.append(_bars(line, lane.width, _STOP_WIDTH, [(-0.5, 0.5)]))
        elif lane.end is LaneEnd.YIELD:
            count = max(round(lane.width / 0.75), 2)
            edges = [(i / count - 0.5 + 0.17 / count, i / count - 0.5 + 0.83 / count) for i in range(count)]
            parts.append(_bars(line, lane.width, _YIELD_WIDTH, edges))
    return parts


def _bars(line: Points, width: float, thick: float, pieces: Sequence[tuple[float, float]]) -> Mesh:
    """Bars across the end of a lane; pieces reach from its right (−1/2) to its left (1/2)."""
    length = float(arc_length(line)[-1])
    near, far = (at_distance(line, np.array([max(length - _SETBACK - d, 0.0)]))[0] for d in (thick, 0.0))
    left = np.append(left_normals(line)[-1], 0.0)
    ends = (0.98 * width * np.array(pieces))[:, :, None] * left
    return _painted(np.stack((near + ends, far + ends), axis=2))


def _zebra(line: Points, width: float) -> Mesh:
    """Stripes along the carriageway, across the way of the pedestrians."""
    length = float(arc_length(line)[-1])
    left = np.append(left_normals(line)[0], 0.0)
    starts = np.arange(0.25, max(length - 0.5, 0.3), 1.0)
    ends = np.stack((at_distance(line, starts), at_distance(line, starts + 0.5)), axis=1)
    return _painted(np.stack((ends + -width / 2 * left, ends + width / 2 * left), axis=1))


def _painted(corners: Points) -> Mesh:
    """Patches of paint: corners (k, 2, 2, 3), whose third index runs across the line that road attributes stand for.

    Only part of the attributes' line is as wide as its patch, so that its edges are smoothed like those of any line.
    """
    middle = corners.mean(axis=2, keepdims=True)
    lifted = middle + 1.5 * (corners - middle) + np.array([0.0, 0.0, _LIFT])
    road = np.zeros((*corners.shape[:3], 4))
    road[:, 1, :, 0] = np.array([math.dist(near[0], far[0]) for near, far in corners.tolist()])[:, None]
    road[..., 1] = 1.0 + 0.75 * _LINE_WIDTH * np.array([-1.0, 1.0])
    road[..., 2], road[..., 3] = 1.0, 3.0
    normals = np.stack([grid_normals(patch, (0, 0, 1)) for patch in lifted])
    faces = grid_faces(2, 2) + 4 * np.arange(len(corners))[:, None, None]
    return mesh(lifted, faces, normals, ASPHALT, road=road, instance=Instance.ROAD)
