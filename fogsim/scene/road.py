"""Pavement: lanes with the attributes of their painted lines, footways, and which of their sides are free."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.chainage import Chainage
from fogsim.scene.lane_index import LaneIndex
from fogsim.scene.polyline import Points, cleaned, parallel, refined
from fogsim.scene.solids import Material, grid, merge, mesh
from fogsim.values.road import Lane, LaneKind, LaneMarking
from fogsim.values.scene import Mesh, Surface

ROAD = 2
"""Instance id of the road (see `View.instance`)."""

FAST = 22.0
"""Speed limit from which a road has wide shoulders, guard rails and delineators [m/s]."""

TOWN = 16.7
"""Speed limit up to which a road is a street, with kerbs and footways in place of shoulders [m/s]."""

KERB = 0.12
"""Height of a footway above the street [m]."""

ASPHALT = Material((0.088, 0.088, 0.090), Surface.ROAD)
FLAGSTONES = Material((0.155, 0.152, 0.146))
KERBSTONE = Material((0.21, 0.208, 0.20))

LINE_CODE = {LaneMarking.NONE: 0, LaneMarking.SOLID: 1, LaneMarking.DASHED: 2, LaneMarking.DOUBLE: 1}
"""Lines by their number in the road attributes of a mesh."""

LONGEST = 40.0
"""Longest piece of a strip [m]: short enough to be culled in pieces."""

_LOOK = 2.0  # whether a side is free is looked at every so many metres
_CLOSER = 8  # and so many times as closely where that changes
_OVERLAP = 0.03  # neighbouring lanes overlap by this much on each side [m], so that no gap shows between them
_INSET = 0.16  # the middle of each of two lines between directions lies this far inside its lane [m]


def lane_mesh(lane: Lane, chainage: Chainage) -> Mesh:
    """One lane as a strip with its road attributes."""
    centre = refined(cleaned(lane.centreline), LONGEST)
    half = lane.width / 2
    lines = 3 * LINE_CODE[lane.left] + LINE_CODE[lane.right]
    # Lanes without lines are what runs across junctions; where they overlap others, the painted ones shall show.
    lift = 0.0 if lines else -0.001
    # Where both directions of a road overlap, one of them shall show, lest their dashes end in combs in bends.
    lift -= 0.0005 * chainage.follows(lane)
    left, right = (_INSET * (marking is LaneMarking.DOUBLE) for marking in (lane.left, lane.right))
    return strip(
        centre,
        (half + _OVERLAP, -half - _OVERLAP),
        lift,
        half - 0.5 * (left + right),
        lines,
        chainage.along(lane, centre),
        middle=0.5 * (right - left),
    )


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

    Parameters
    ----------
    line : (n, 3) float64
        The line [m].
    left : tuple of float or (n,) float64
        How far to the left of it the strip's two edges lie [m].
    lift : float
        How far above it [m].
    half, lines, along
        Road attributes: half the width between the painted lines [m], their code, distance along the road [m].
    material : Material
        A ROAD material.
    middle : float
        How far to the left of the line the middle between the painted lines lies [m].
    """
    points = np.stack([parallel(line, side, lift) for side in left], axis=1)
    road = np.empty((*points.shape[:2], 4))
    road[..., 0] = along[:, None]
    road[:, 0, 1], road[:, 1, 1] = left[0] - middle, left[1] - middle
    road[..., 2:] = half, lines
    return grid(points, material, (0, 0, 1), road=road.reshape(-1, 4), instance=ROAD)


def footway_mesh(line: Points, left: tuple[float, float | NDArray[np.float64]]) -> Mesh:
    """Footway with kerbs along a line, between distances to its left [m]; it lies `KERB` above the line."""
    low, high = np.minimum(left[0], left[1]), np.maximum(left[0], left[1])
    stone = np.minimum(0.13, (high - low) / 2)
    # A kerbstone on each side, and how far above the line each fold of the profile lies.
    profile = [(low, -0.05), (low, KERB), (low + stone, KERB), (high - stone, KERB), (high, KERB), (high, -0.05)]
    rows = [parallel(line, offset, lift) for offset, lift in profile]
    faces = zip(rows[:-1], rows[1:], (KERBSTONE, KERBSTONE, FLAGSTONES, KERBSTONE, KERBSTONE), strict=True)
    side = parallel(line, 1.0)[0, :2] - line[0, :2]
    toward = [np.array([*(s * side), u]) for s, u in ((-1, 0), (0, 1), (0, 1), (0, 1), (1, 0))]
    return merge(
        [
            grid(np.stack((a, b), axis=1), material, facing)
            for (a, b, material), facing in zip(faces, toward, strict=True)
        ]
    )


def free_edges(lane: Lane, index: LaneIndex) -> Iterator[tuple[int, NDArray[np.float64]]]:
    """Stretches of a lane's sides with nothing paved beside them.

    Yields
    ------
    tuple of int and (n, 3) float64
        1 for the left or −1 for the right side, and the lane's centreline along the free stretch [m], with a vertex at
        least every 2 m.
    """
    centre = refined(cleaned(lane.centreline), _LOOK)
    for side in (1, -1):
        if side < 0 and not lane.outermost and lane.kind is not LaneKind.FOOTWAY:
            continue
        fine, free = _looked_at(centre, side * (lane.width / 2 + 0.6), index)
        changes = np.flatnonzero(np.diff(np.concatenate(([0], free.astype(int), [0]))))
        for start, end in changes.reshape(-1, 2).tolist():
            if end - start >= 2:
                yield side, fine[start:end]


def _looked_at(line: Points, left: float, index: LaneIndex) -> tuple[Points, NDArray[np.bool_]]:
    """Which points of a line have no lane at a distance to their left [m], with more points where that changes."""
    free = index.clearance(parallel(line, left), same_level=2.5) > 0.2
    before = np.flatnonzero(free[1:] != free[:-1])
    if not len(before):
        return line, free
    share = np.arange(1, _CLOSER)[:, None] / _CLOSER
    between = line[before, None] + share * (line[before + 1] - line[before])[:, None]
    closer = np.insert(line, np.repeat(before + 1, _CLOSER - 1), between.reshape(-1, 3), axis=0)
    return closer, index.clearance(parallel(closer, left), same_level=2.5) > 0.2


def terrain(lanes: Sequence[Lane], ground: float) -> Mesh:
    """Level grassland around all lanes, as two triangles that reach beyond the horizon.

    Parameters
    ----------
    lanes : sequence of Lane
        The lanes.
    ground : float
        Its height [m].
    """
    everything = np.concatenate([lane.centreline[:, :2] for lane in lanes])
    low, high = everything.min(axis=0) - 40e3, everything.max(axis=0) + 40e3
    corners = [(low[0], low[1]), (high[0], low[1]), (low[0], high[1]), (high[0], high[1])]
    points = np.array([(x, y, ground) for x, y in corners])
    normals = np.broadcast_to((0.0, 0.0, 1.0), (4, 3))
    grass = Material((0.064, 0.088, 0.036), Surface.TERRAIN)
    return mesh(points, [[0, 1, 2], [1, 3, 2]], normals, grass, instance=1)
