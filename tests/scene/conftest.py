"""A small motorway to build scenes of, and what lies at a place of a scene."""

import numpy as np
import pytest
from numpy.typing import ArrayLike

from fogsim.scene import build_scene
from fogsim.values import Lane, LaneMarking, Mesh, RoadNetwork, Scene, Sign, SignMap, Surface

LIMIT = Sign("s", "speed_limit", 80 / 3.6, (200.0, -6.0, 2.2), 0.0, 0.9)


def carriageway(edge: str, start: tuple[float, float], heading: float, length: float, speed: float) -> list[Lane]:
    """Three parallel straight lanes, the rightmost first."""
    ahead = np.array([np.cos(heading), np.sin(heading), 0.0])
    left = np.array([-np.sin(heading), np.cos(heading), 0.0])
    distance = np.linspace(0.0, length, 7)[:, None]
    solid, dashed = LaneMarking.SOLID, LaneMarking.DASHED
    lines = [np.array([*start, 0.0]) + left * 3.5 * i + ahead * distance for i in range(3)]
    return [
        Lane(f"{edge}_{i}", edge, line, 3.5, speed, dashed if i < 2 else solid, dashed if i else solid, i == 0)
        for i, line in enumerate(lines)
    ]


def street(line: ArrayLike, name: str = "a", speed: float = 13.9, width: float = 3.2) -> Lane:
    """A lane of its own between solid lines, beside which a road ends."""
    line, solid = np.asarray(line, np.float64), LaneMarking.SOLID
    return Lane(name, name, line, width, speed, solid, solid, outermost=True)


def build(network: RoadNetwork, *signs: Sign, street_lamps: bool = False) -> Scene:
    return build_scene(network, SignMap(signs), np.random.default_rng(5), street_lamps=street_lamps)


@pytest.fixture(scope="session")
def motorway() -> RoadNetwork:
    lanes = carriageway("out", (0, 0), 0.0, 600.0, 36.0) + carriageway("back", (600, 20), np.pi, 600.0, 36.0)
    return RoadNetwork(tuple(lanes), lanes[0].centreline)


def road_under(mesh: Mesh, x: float, y: float, surfaces: tuple[Surface, ...] = (Surface.ROAD,)) -> list[float]:
    """Heights of all triangles of some surfaces above or below a place."""
    chosen = np.isin(mesh.surface[mesh.faces[:, 0]], [int(s) for s in surfaces])
    corners = mesh.positions[mesh.faces[chosen]].astype(float)
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    double = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    double = np.where(np.abs(double) > 1e-9, double, np.inf)
    u = ((x - a[:, 0]) * (c[:, 1] - a[:, 1]) - (y - a[:, 1]) * (c[:, 0] - a[:, 0])) / double
    v = ((b[:, 0] - a[:, 0]) * (y - a[:, 1]) - (b[:, 1] - a[:, 1]) * (x - a[:, 0])) / double
    inside = np.isfinite(double) & (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9)
    return list((a[:, 2] + u * (b[:, 2] - a[:, 2]) + v * (c[:, 2] - a[:, 2]))[inside])
