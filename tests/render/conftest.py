"""The motorway of the catalogue with vehicles and signs in view, without SUMO running (for benchmarks too)."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from fogsim.scene import build_scene
from fogsim.traffic.road.network import read_net, road_network
from fogsim.values import Camera, CameraPose, Lamp, RoadNetwork, Scene, Sign, SignMap, TrafficState
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
        (x, y, z), direction = along(own[0].centreline, at + 35.0 + 30.0 * i)
        right = own[0].width / 2 + 4.2
        position = (x + right * math.sin(direction), y - right * math.cos(direction), z + 2.4)
        board.append(Sign(f"s{i}", "speed_limit", (80, 100, 120)[i % 3] / 3.6, position, direction, 0.75))
    scene = build_scene(network, SignMap(tuple(board)), np.random.default_rng(5))
    pose = CameraPose((float(eye[0]), float(eye[1]), float(eye[2]) + 1.38), heading)
    return Place(network, scene, traffic(places), pose)


def along(line: np.ndarray, distance: float) -> tuple[np.ndarray, float]:
    """Point at a distance along a polyline, and the direction there."""
    length = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(line[:, :2], axis=0).T))))
    point = np.array([np.interp(distance, length, line[:, axis]) for axis in range(3)])
    i = min(int(np.searchsorted(length, distance, side="right")), len(line) - 1)
    step = line[i] - line[i - 1]
    return point, math.atan2(step[1], step[0])


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
def place() -> Place:
    return motorway()
