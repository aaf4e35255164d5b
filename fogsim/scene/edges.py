"""What lies along the free sides of roads: shoulders, verges, kerbs and footways, embankments, bridges, rails."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.scene.lane_index import LaneIndex
from fogsim.scene.polyline import Points, arc_length, left_normals, parallel, refined, true_spans
from fogsim.scene.road import FAST, KERB, LINE_CODE, LONGEST, TOWN, footway_mesh, lengthened, strip
from fogsim.scene.solids import Material, grid, mesh
from fogsim.scene.terrain import Terrain
from fogsim.values.road import Lane, LaneKind, LaneMarking
from fogsim.values.scene import Mesh, Surface

_SHOULDER = Material((0.097, 0.096, 0.094), Surface.ROAD)
_GRAVEL = Material((0.115, 0.105, 0.085))
_BANK = Material((0.062, 0.085, 0.034))
_CONCRETE = Material((0.24, 0.238, 0.23))

# Shoulders lie this much lower [m], so that a lane that crosses one covers it; more would hide the line next to them.
_SHOULDER_DROP = 0.002
_LEVEL = 2.5  # roads higher or lower than this pass over or under one another [m]
_VERGE = 0.7  # width of the gravel next to a shoulder [m]
_FOOTWAY = 2.2  # width of a street's footway [m]
_SPAN = 5.0  # a bridge spans this much on either side of the lanes that pass below it [m]
_DECK = 1.0  # height of a bridge's deck as seen from the side [m]


@dataclass(frozen=True, slots=True)
class Edge:
    """One free side of a lane or of a junction."""

    line: Points  # (n, 3): Line along it in the direction of travel [m]
    side: int  # 1 if the land lies to the left of it, −1 if to the right
    inner: float  # Distance from the line to where the pavement ends [m]
    speed_limit: float  # Speed limit of the road [m/s]
    shoulder: float  # Width of the paved shoulder, or of a street's footway, where there is room for it [m]
    # (n,): How far from the pavement there is room for shoulder and verge at each of the line's points [m]
    room: NDArray[np.float64]
    marking: LaneMarking = LaneMarking.NONE  # Line painted where the pavement ends


def lane_edge(lane: Lane, side: int, line: Points, index: LaneIndex) -> Edge:
    """Free side of a lane, as from `free_edges`.

    Next to a footway there is nothing more, and of the room up to another lane each side gets half.

    Takes `line` (n, 3) [m].
    """
    width = 0.0 if lane.kind is LaneKind.FOOTWAY else _shoulder_width(lane.speed_limit, side)
    inner, marking = lane.width / 2, lane.left if side > 0 else lane.right
    room = _room_beside(line, side * inner, width + _VERGE, index, 0.5)
    along, there = _thinned(line, room)
    return Edge(along, side, inner, lane.speed_limit, width, there, marking)


def border_edge(line: Points, speed_limit: float, footways: bool, index: LaneIndex) -> Edge:
    """Free part of a junction's border, with the land on its right (`line` (n, 3) [m], `speed_limit` [m/s])."""
    width = 0.0 if footways else _shoulder_width(speed_limit, -1)
    along, there = _thinned(line, _room_beside(line, -0.0, width + _VERGE, index, 1.0))
    return Edge(along, -1, 0.0, speed_limit, width, there)


def _room_beside(line: Points, inner: float, most: float, index: LaneIndex, share: float) -> NDArray[np.float64]:
    """Room next to the points of a line [m], at least 0.1 m, at most `most`.

    It begins at `inner` to the left of the line (to the right if that is negative, −0.0 included); of the gap up to
    another lane a share counts.
    """
    side = np.copysign(1.0, inner)
    gap = index.room(parallel(line, inner), side * left_normals(line), most / share, _LEVEL)
    return np.maximum(share * gap, 0.1)


def _thinned(line: Points, room: NDArray[np.float64]) -> tuple[Points, NDArray[np.float64]]:
    """A line and the room next to it, without the points between which it is straight and widens evenly."""
    corners = refined(line[_corners(np.ascontiguousarray(line), room)], LONGEST)
    return corners, np.interp(arc_length(corners), arc_length(line), room)


@kernel
def _corners(line: Points, room: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which points of a line are its ends, or where it bends or its room changes unevenly."""
    kept = np.ones(len(line), np.bool_)
    before = line[1] - line[0]
    before /= np.sqrt((before * before).sum())
    for i in range(1, len(line) - 1):
        step = line[i + 1] - line[i]
        step /= np.sqrt((step * step).sum())
        turned = step - before
        uneven = abs((room[i + 1] - room[i]) - (room[i] - room[i - 1]))
        kept[i] = np.sqrt((turned * turned).sum()) > 1e-6 or uneven > 0.03
        before = step
    return kept


def _shoulder_width(speed_limit: float, side: int) -> float:
    """Width of the paved shoulder, or of a street's footway [m], on the left (side 1) or right (side −1) of a road."""
    if speed_limit <= TOWN:
        return _FOOTWAY
    if speed_limit < FAST:
        return 0.5
    return 2.5 if side < 0 else 1.0


def edge_meshes(edge: Edge, terrain: Terrain, index: LaneIndex, along: NDArray[np.float64] | None = None) -> list[Mesh]:
    """Shoulder and gravel verge or kerb and footway, and what leads from there down to the land (`along` (n,) [m])."""
    distance = arc_length(edge.line) if along is None else along
    paved = edge.inner + np.minimum(edge.shoulder, edge.room)
    if edge.speed_limit <= TOWN:
        footway = footway_mesh(edge.line, (edge.side * edge.inner, edge.side * paved))
        return [*([footway] if edge.shoulder > 0 else []), *_down(edge, paved, KERB, terrain, index)]
    outer, placed = edge.inner + edge.room, lengthened(np.column_stack((edge.line, distance)))
    rows = [
        parallel(placed[:, :3], edge.side * (paved - 0.02), -_SHOULDER_DROP - 0.001),
        parallel(placed[:, :3], edge.side * outer, -0.06),
    ]
    verge = grid(np.stack(rows, axis=1), _GRAVEL, (0, 0, 1))
    return [_shoulder(edge, paved, placed), verge, *_down(edge, outer, -0.06, terrain, index)]


def _shoulder(edge: Edge, paved: NDArray[np.float64], placed: NDArray[np.float64]) -> Mesh:
    """Shoulder along a line and the distance along it (`placed` (n, 4) [m])."""
    marking = LINE_CODE[edge.marking]
    return strip(
        placed[:, :3],
        (edge.side * (edge.inner - 0.02), edge.side * paved),
        -_SHOULDER_DROP,
        edge.shoulder / 2,
        # It shows its half of the line next to it: on its right if it lies to the left of the road.
        marking if edge.side > 0 else 3 * marking,
        placed[:, 3],
        _SHOULDER,
        middle=edge.side * (edge.inner + edge.shoulder / 2),
    )


def _down(edge: Edge, distance: NDArray[np.float64], lift: float, terrain: Terrain, index: LaneIndex) -> list[Mesh]:
    """Embankment from distances next to the line down to the land, or the side of a bridge."""
    line = edge.line
    if np.max(line[:, 2] - terrain.height(line)) > 3.0:
        line = refined(line, 6.0)
        distance = np.interp(arc_length(line), arc_length(edge.line), distance)
    top = parallel(line, edge.side * distance, lift)
    deep = np.maximum(top[:, 2] - terrain.height(top), 0.0)
    foot = parallel(line, edge.side * (distance + 0.3 + 1.5 * deep))
    foot[:, 2] = np.minimum(terrain.height(foot), top[:, 2]) - 0.03
    if not np.any(deep > 0.1) and lift < 0:
        return []
    bridge = _over_road(top, foot, deep, index)
    parts = []
    for start, end in true_spans(~bridge, least=2):
        parts.append(grid(np.stack((top[start:end], foot[start:end]), axis=1), _BANK, (0, 0, 1)))
    for first, after in true_spans(bridge):
        # A bridge reaches a vertex farther on either side.
        start, end = max(first - 1, 0), min(after + 1, len(line))
        deck = np.stack((top[start:end], top[start:end] - (0.0, 0.0, _DECK)), axis=1)
        parts.append(grid(deck, _CONCRETE, np.append(foot[start, :2] - top[start, :2], 0.0)))
    return parts


def _over_road(top: Points, foot: Points, deep: NDArray[np.float64], index: LaneIndex) -> NDArray[np.bool_]:
    """Where a lane passes under the embankment that would be there."""
    if np.max(deep) < 3.0:
        return np.zeros(len(top), np.bool_)
    below = np.zeros(len(top), np.bool_)
    for share in (0.0, 0.5, 1.0):
        places = top + share * (foot - top)
        places[:, 2] = foot[:, 2]
        below |= index.clearance(places, same_level=_LEVEL) < _SPAN
    return np.asarray(below & (deep > 3.0))


def guard_rail(line: NDArray[np.float64], side: int, distance: float) -> Mesh:
    """W-beam along a line, facing the road (`line` (n, 3) [m], `distance` [m])."""
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
