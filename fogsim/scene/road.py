"""Pavement: lanes with the attributes of their painted lines, shoulders, verges and embankments."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.chainage import Chainage
from fogsim.scene.polyline import LaneIndex, cleaned, left_normals, parallel, refined
from fogsim.scene.solids import Material, grid, mesh
from fogsim.values.road import Lane, LaneMarking
from fogsim.values.scene import Mesh, Surface

ROAD = 2
"""Instance id of the road (see `View.instance`)."""

FAST = 22.0
"""Speed limit from which a road has wide shoulders, guard rails and delineators [m/s]."""

ASPHALT = Material((0.088, 0.088, 0.090), Surface.ROAD)
SHOULDER = Material((0.097, 0.096, 0.094), Surface.ROAD)
GRAVEL = Material((0.115, 0.105, 0.085))
BANK = Material((0.062, 0.085, 0.034))

_STEP = 40.0  # longest piece of a strip [m]: short enough to follow curves and to be culled in pieces
_OVERLAP = 0.03  # neighbouring lanes overlap by this much on each side [m], so that no gap shows between them
# Shoulders lie this much lower [m], so that a lane that crosses one covers it; more would hide the line beside them.
_SHOULDER_DROP = 0.002
_LINE_CODE = {LaneMarking.NONE: 0, LaneMarking.SOLID: 1, LaneMarking.DASHED: 2}


def shoulder_width(lane: Lane, side: int) -> float:
    """Width of the paved shoulder [m] on the left (side 1) or right (side −1) of a lane."""
    if lane.speed_limit < FAST:
        return 0.5
    return 2.5 if side < 0 else 1.0


def lane_mesh(lane: Lane, chainage: Chainage) -> Mesh:
    """One lane as a strip with its road attributes."""
    centre = refined(cleaned(lane.centreline), _STEP)
    half = lane.width / 2
    lines = 3 * _LINE_CODE[lane.left] + _LINE_CODE[lane.right]
    # Lanes without lines are what runs across junctions; where they overlap others, the painted ones shall show.
    lift = 0.0 if lines else -0.001
    return _strip(centre, (half + _OVERLAP, -half - _OVERLAP), (lift, lift), half, lines, chainage.along(lane, centre))


def _strip(
    line: NDArray[np.float64],
    left: tuple[float, float],
    lift: tuple[float, float],
    half: float,
    lines: int,
    along: NDArray[np.float64],
    material: Material = ASPHALT,
    middle: float = 0.0,
) -> Mesh:
    points = np.stack([parallel(line, side, up) for side, up in zip(left, lift, strict=True)], axis=1)
    road = np.empty((*points.shape[:2], 4))
    road[..., 0] = along[:, None]
    road[..., 1] = np.asarray(left) - middle
    road[..., 2:] = half, lines
    return grid(points, material, (0, 0, 1), road=road.reshape(-1, 4), instance=ROAD)


def free_edges(lane: Lane, index: LaneIndex) -> Iterator[tuple[int, NDArray[np.float64]]]:
    """Stretches of a lane's sides with nothing paved beside them.

    Yields
    ------
    tuple of int and (n, 3) float64
        1 for the left or −1 for the right side, and the lane's centreline along the free stretch [m].
    """
    centre = refined(cleaned(lane.centreline), _STEP)
    for side in (1, -1):
        if side < 0 and not lane.outermost:
            continue
        beside = parallel(centre, side * (lane.width / 2 + 0.6))
        free = index.clearance(beside, same_level=2.5) > 0.2
        changes = np.flatnonzero(np.diff(np.concatenate(([0], free.astype(int), [0]))))
        for start, end in changes.reshape(-1, 2).tolist():
            if end - start >= 2:
                yield side, centre[start:end]


def edge_meshes(lane: Lane, side: int, line: NDArray[np.float64], chainage: Chainage, ground: float) -> list[Mesh]:
    """Shoulder, gravel verge and, where the road lies high, embankment along one free side.

    Parameters
    ----------
    lane, side, line
        As from `free_edges`.
    chainage : Chainage
        Distances along the lanes.
    ground : float
        Height of the terrain [m].
    """
    inner = lane.width / 2
    width = shoulder_width(lane, side)
    marking = _LINE_CODE[lane.left if side > 0 else lane.right]
    # The shoulder shows its half of the lane's line: on its right if it lies to the left of the lane.
    lines = marking if side > 0 else 3 * marking
    drop = -_SHOULDER_DROP
    shoulder = _strip(
        line,
        (side * (inner - 0.02), side * (inner + width)),
        (drop, drop),
        width / 2,
        lines,
        chainage.along(lane, line),
        SHOULDER,
        middle=side * (inner + width / 2),
    )
    outer = inner + width
    height = np.maximum(line[:, 2] + drop - 0.06 - ground, 0.0)
    rows = [
        parallel(line, side * (outer - 0.02), drop - 0.001),
        parallel(line, side * (outer + 0.7), drop - 0.06),
        parallel(line, side * (outer + 0.7 + 1.5 * height)),
    ]
    rows[2][:, 2] = np.minimum(ground, rows[1][:, 2])
    verge = grid(np.stack(rows[:2], axis=1), GRAVEL, (0, 0, 1))
    if not np.any(height > 0.1):
        return [shoulder, verge]
    return [shoulder, verge, grid(np.stack(rows[1:], axis=1), BANK, (0, 0, 1))]


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


def guard_rail(line: NDArray[np.float64], side: int, distance: float) -> Mesh:
    """W-beam along a line, facing the road.

    Parameters
    ----------
    line : (n, 3) float64
        Centreline of the lane [m].
    side : int
        1 left, −1 right of the lane.
    distance : float
        From the centreline to the beam's face [m].
    """
    # Depth behind the face and height of the folds of the beam [m].
    profile = [(0.05, 0.76), (0.0, 0.69), (0.08, 0.60), (0.01, 0.46)]
    # What faces down gets little light; a fold's own shade makes the beam read as a W from afar.
    shade = np.array([1.05, 0.95, 0.6, 0.85])
    points = np.stack([parallel(line, side * (distance + depth), height) for depth, height in profile], axis=1)
    normals = left_normals(line) * -side
    facing = np.column_stack((normals, np.full(len(line), 0.2)))
    galvanised = np.array([0.34, 0.35, 0.36])
    reflectance = np.broadcast_to(shade[None, :, None] * galvanised, points.shape).reshape(-1, 3)
    rail = grid(points, Material((0.34, 0.35, 0.36)), facing[0], reflectance=reflectance)
    vertical = np.repeat(facing, len(profile), axis=0)
    return mesh(
        points, rail.faces, vertical + 0.4 * rail.normals, Material((0.34, 0.35, 0.36)), reflectance=reflectance
    )
