"""The motorway of the catalogue with vehicles and signs in view, without SUMO running (for benchmarks too)."""

import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fogsim.errors import MissingDependencyError
from fogsim.render import gl_report
from fogsim.render.drawing import RECORD, Drawing, MeshTable
from fogsim.scene import build_scene
from fogsim.traffic.road.network import read_net, road_network
from fogsim.values import Camera, CameraPose, Lamp, Mesh, RoadNetwork, Scene, Sign, SignMap, Surface, TrafficState
from fogsim.values.pinhole import ray_from_pixel
from tests.helpers.vehicles import vehicles

NET = Path(__file__).parents[2] / "scenarios" / "motorway_fog_bank" / "motorway.net.xml"
SIZES = {
    "car": (4.6, 1.8, 1.5),
    "van": (5.9, 2.0, 2.6),
    "truck": (16.5, 2.5, 4.0),
    "bus": (12.0, 2.55, 3.2),
    "motorcycle": (2.2, 0.8, 1.6),
}
KINDS = ("car", "car", "van", "car", "truck", "car", "bus", "car", "car", "motorcycle")
PAINTS = ((0.62, 0.63, 0.64), (0.03, 0.03, 0.035), (0.8, 0.8, 0.79), (0.05, 0.09, 0.25), (0.3, 0.03, 0.03))


@dataclasses.dataclass(frozen=True)
class Place:
    """A scene with traffic on it and an eye in the middle lane."""

    network: RoadNetwork
    scene: Scene
    traffic: TrafficState
    pose: CameraPose


def camera(width: int, height: int, roll: float = 0.0) -> Camera:
    """Camera of the catalogue at any size."""
    focal = 0.5 * width / math.tan(math.radians(29.0))
    return Camera(width, height, focal, (width / 2, height / 2), 1.38, pitch=math.radians(2.0), roll=roll)


def motorway(at: float = 250.0, vehicles: int = 30, signs: int = 10, nearest: float = 18.0) -> Place:
    """Motorway with vehicles and signs ahead of an eye `at` metres along the route."""
    net = read_net(NET)
    network = road_network(net, [edge for edge in net.edges if not edge.startswith(":")][:1])
    lanes = [lane for lane in network.lanes if np.linalg.norm(np.diff(lane.centreline, axis=0), axis=1).sum() > 600]
    own = [lane for lane in lanes if lane.edge_id == lanes[0].edge_id]
    eye, heading = along(own[len(own) // 2].centreline, at)
    places = [along(own[i % len(own)].centreline, at + nearest + 9.0 * i + 0.06 * i * i) for i in range(vehicles)]
    board = []
    for i in range(signs):
        (x, y, z), direction = along(own[0].centreline, at + 35.0 + 30.0 * i, -own[0].width / 2 - 4.2)
        board.append(Sign(f"s{i}", "speed_limit", (80, 100, 120)[i % 3] / 3.6, (x, y, z + 2.4), direction, 0.75))
    scene = build_scene(network, SignMap(tuple(board)), np.random.default_rng(5))
    pose = CameraPose((float(eye[0]), float(eye[1]), float(eye[2]) + 1.38), heading)
    return Place(network, scene, traffic(places), pose)


def along(line: np.ndarray, distance: float, left: float = 0.0) -> tuple[np.ndarray, float]:
    """Point at a distance along a polyline and to its left, and the direction there."""
    length = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(line[:, :2], axis=0).T))))
    point = np.array([np.interp(distance, length, line[:, axis]) for axis in range(3)])
    i = min(int(np.searchsorted(length, distance, side="right")), len(line) - 1)
    step = line[i] - line[i - 1]
    aside = np.array((-step[1], step[0], 0.0)) / math.hypot(step[0], step[1])
    return point + left * aside, math.atan2(step[1], step[0])


def traffic(places: list[tuple[np.ndarray, float]]) -> TrafficState:
    """Vehicles of all kinds, whose rears are at places."""
    kinds = tuple(KINDS[i % len(KINDS)] for i in range(len(places)))
    size = np.array([SIZES[kind] for kind in kinds]).reshape(-1, 3)
    heading = np.array([direction for _, direction in places])
    ahead = np.column_stack((np.cos(heading), np.sin(heading), np.zeros(len(heading))))
    lamps = int(Lamp.POSITION | Lamp.LOW_BEAM)
    return vehicles(
        np.array([point for point, _ in places]).reshape(-1, 3) + ahead * size[:, :1],
        kinds=kinds,
        heading=heading,
        speed=25.0,
        size=size,
        lamps=[lamps | (int(Lamp.STOP) if i % 3 == 0 else 0) for i in range(len(places))],
        paint=np.array([PAINTS[i % len(PAINTS)] for i in range(len(places))]).reshape(-1, 3),
    )


@pytest.fixture(scope="session")
def opengl() -> None:
    """Skip what needs OpenGL where there is none."""
    try:
        gl_report()
    except MissingDependencyError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="session")
def place() -> Place:
    return motorway()


def mesh(corners: Any, surface: Surface = Surface.MATT, road: Any = None, instance: int = 3) -> Mesh:
    """Triangles (n, 3, 3) without shared vertices, their normals toward the origin's side of each."""
    points = np.asarray(corners, np.float32).reshape(-1, 3, 3)
    normal = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    normal *= -np.sign(np.sum(normal * points.mean(axis=1), axis=1, keepdims=True))
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    count = 3 * len(points)
    return Mesh(
        positions=points.reshape(-1, 3),
        normals=np.repeat(normal, 3, axis=0).astype(np.float32),
        reflectance=np.full((count, 3), 0.1, np.float32),
        surface=np.full(count, int(surface), np.int32),
        road=np.zeros((count, 4), np.float32) if road is None else np.asarray(road, np.float32).reshape(-1, 4),
        instance=np.full(count, instance, np.int32),
        faces=np.arange(count, dtype=np.uint32).reshape(-1, 3),
    )


def rectangle(a: Any, b: Any, c: Any, d: Any) -> np.ndarray:
    return np.array([[a, b, c], [a, c, d]], float)


def joined(*parts: Mesh) -> Mesh:
    table = MeshTable.of({str(number): part for number, part in enumerate(parts)})
    return Mesh(
        table.positions,
        table.normals,
        table.reflectance,
        table.surface,
        table.road,
        table.instance,
        table.faces.astype(np.uint32),
    )


def rays(camera: Camera, pose: CameraPose) -> np.ndarray:
    """Rays (rows, cols, 3) that are 1 long along the optical axis."""
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    pixels = np.stack((u, v, np.ones_like(u)), axis=-1)
    return np.asarray(pixels @ ray_from_pixel(camera, pose).T)


def drawing_of(table: MeshTable, shapes: Any, transforms: np.ndarray) -> Drawing:
    """Copies of shapes of a table, by their numbers."""
    record = np.zeros(len(shapes), RECORD)
    record["transform"] = transforms
    counts = np.diff(table.first_face)[shapes]
    return Drawing(np.array(shapes, np.int64), record, np.cumsum([0, *counts], dtype=np.int64))


def walls(*distances: float) -> Scene:
    """Walls of reflectance ½ across the x axis that fill the picture, with instance ids from 3 on."""
    sides = [rectangle((d, -d, -d), (d, d, -d), (d, d, d), (d, -d, d)) for d in distances]
    ground = mesh(np.concatenate(sides))
    ground.normals[:], ground.reflectance[:] = (0.0, 0.0, 1.0), 0.5
    ground.instance[:] = np.repeat(np.arange(3, 3 + len(distances)), 6)
    return Scene(ground, {}, ())
