"""Both ways to draw show the same."""

import dataclasses
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from fogsim.errors import MissingDependencyError
from fogsim.render import Renderer, gl_report, make_renderer
from fogsim.scene import build_scene, vehicle_batches
from fogsim.traffic.road.network import read_net, road_network
from fogsim.values import Batch, Camera, CameraPose, Lamp, Mesh, Scene, Sign, SignMap, View
from tests.helpers.vehicles import vehicles

ROOT = Path(__file__).resolve().parents[2]
ILLUMINANCE = 18e3
LARGE = Camera(640, 480, 577.0, (320.0, 240.0), 1.38, pitch=math.radians(2.0))
SMALL = Camera(160, 120, 144.25, (80.0, 60.0), 1.38, pitch=math.radians(2.0))
TILTED = dataclasses.replace(SMALL, pitch=0.1, roll=0.15)

Pair = tuple[Renderer, Renderer]


def pair(scene: Scene) -> Iterator[Pair]:
    try:
        gl_report()
    except MissingDependencyError as error:
        pytest.skip(str(error))
    made = (make_renderer("opengl", scene, ILLUMINANCE), make_renderer("cpu", scene, ILLUMINANCE))
    yield made
    for one in made:
        one.close()


@pytest.fixture(scope="module")
def route() -> np.ndarray:
    net = read_net(ROOT / "scenarios" / "motorway_fog_bank" / "motorway.net.xml")
    return road_network(net, ["approach", "bank", "exit"]).route


@pytest.fixture(scope="module")
def motorway(route: np.ndarray) -> Iterator[Pair]:
    net = read_net(ROOT / "scenarios" / "motorway_fog_bank" / "motorway.net.xml")
    signs = []
    for number in range(8):
        (x, y, z), heading = along(route, 40.0 + 30.0 * number, -7.0)
        signs.append(Sign(f"s{number}", "speed_limit", 100 / 3.6, (x, y, z + 2.2), heading, 0.75))
    network = road_network(net, ["approach", "bank", "exit"])
    yield from pair(build_scene(network, SignMap(tuple(signs)), np.random.default_rng(1)))


@pytest.fixture(scope="module")
def town() -> Iterator[Pair]:
    network = road_network(read_net(ROOT / "tests" / "data" / "grid" / "grid.net.xml"), ["A0B0"])
    yield from pair(build_scene(network, SignMap(), np.random.default_rng(1)))


def along(route: np.ndarray, station: float, left: float = 0.0) -> tuple[np.ndarray, float]:
    """Point at a distance along a polyline and to its left, and the direction there."""
    stations = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(route[:, :2], axis=0), axis=1))))
    here, ahead = (np.array([np.interp(s, stations, route[:, i]) for i in range(3)]) for s in (station, station + 1.0))
    heading = math.atan2(ahead[1] - here[1], ahead[0] - here[0])
    return here + left * np.array([-math.sin(heading), math.cos(heading), 0.0]), heading


def pose_at(route: np.ndarray, station: float, left: float = 0.0) -> CameraPose:
    (x, y, z), heading = along(route, station, left)
    return CameraPose((float(x), float(y), float(z) + 1.38), heading)


def vehicles_at(route: np.ndarray, ahead: dict[float, tuple[str, float]]) -> tuple[Batch, ...]:
    """Vehicles by station of their front, each with its kind and how far to the left it is."""
    sizes = {"car": (4.5, 1.8, 1.5), "truck": (16.5, 2.5, 4.0), "van": (5.9, 2.0, 2.6), "bus": (12.0, 2.55, 3.2)}
    places = [along(route, station, left) for station, (_, left) in ahead.items()]
    kinds = tuple(kind for kind, _ in ahead.values())
    state = vehicles(
        [place for place, _ in places],
        ids=map(str, range(len(kinds))),
        kinds=kinds,
        heading=[heading for _, heading in places],
        size=[sizes[kind] for kind in kinds],
        lamps=int(Lamp.POSITION | Lamp.STOP),
    )
    return vehicle_batches(state, None)


def assert_same(renderers: Pair, vehicles: tuple[Batch, ...], camera: Camera, pose: CameraPose) -> View:
    by_opengl, by_numba = (one.render(vehicles, camera, pose) for one in renderers)
    sky = np.isinf(by_opengl.distance)
    assert np.mean(sky == np.isinf(by_numba.distance)) > 0.995
    with np.errstate(invalid="ignore"):
        off = np.abs(by_opengl.distance / by_numba.distance - 1.0)
    assert np.mean((off < 0.005) | (sky & np.isinf(by_numba.distance))) >= 0.99
    difference = np.abs(by_opengl.radiance - by_numba.radiance)
    assert np.mean(np.all(difference <= 0.01 * by_numba.radiance + 1.0, axis=-1)) >= 0.99
    assert np.mean(by_opengl.instance == by_numba.instance) >= 0.99
    return by_opengl


def test_on_the_motorway(motorway: Pair, route: np.ndarray) -> None:
    for station in [20.0, 1700.0, 3000.0]:
        for camera in [LARGE, SMALL, TILTED]:
            view = assert_same(motorway, (), camera, pose_at(route, station))
            assert {0, 1, 2, 3} <= set(np.unique(view.instance))


@pytest.mark.parametrize(("camera", "gap"), [(LARGE, 30.0), (SMALL, 4.0)])
def test_with_a_truck_ahead_and_others_beside(motorway: Pair, route: np.ndarray, camera: Camera, gap: float) -> None:
    ahead = {100.0 + gap + 16.5: ("truck", 0.0), 120.0: ("car", 3.5), 140.0: ("van", -3.5), 200.0: ("bus", 3.5)}
    view = assert_same(motorway, vehicles_at(route, ahead), camera, pose_at(route, 100.0))
    assert 16 in view.instance
    assert 17 in view.instance


def test_at_junctions_of_a_town(town: Pair) -> None:
    for place in [(0.0, 0.0, 0.0), (60.0, -4.0, 0.0), (30.0, 30.0, 2.0)]:
        for camera in [LARGE, SMALL]:
            x, y, heading = place
            view = assert_same(town, (), camera, CameraPose((x, y, 1.38), heading))
            assert len(np.unique(view.instance)) > 2


def walls(*distances: float) -> Scene:
    """Walls across the x axis that fill the picture, with instance ids from 3 on."""
    corners = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    positions = np.concatenate([np.column_stack((np.full(4, d), d * corners)) for d in distances]).astype(np.float32)
    n = len(distances)
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
    ground = Mesh(
        positions=positions,
        normals=np.tile(np.float32([-1, 0, 0]), (4 * n, 1)),
        reflectance=np.full((4 * n, 3), 0.5, np.float32),
        surface=np.zeros(4 * n, np.int32),
        road=np.zeros((4 * n, 4), np.float32),
        instance=np.repeat(np.arange(3, 3 + n, dtype=np.int32), 4),
        faces=np.concatenate([faces + 4 * i for i in range(n)]),
    )
    return Scene(ground=ground, shapes={}, scenery=())


@pytest.mark.parametrize("renderer", ["opengl", "cpu"])
@pytest.mark.parametrize(
    ("distance", "tolerance"), [(10.0, 0.002), (30.0, 0.002), (100.0, 0.002), (300.0, 0.002), (1000.0, 0.01)]
)
def test_a_wall_is_as_far_as_it_is_and_hides_what_is_hardly_farther(
    renderer: str, distance: float, tolerance: float
) -> None:
    try:
        one = make_renderer(renderer, walls((1.0 + tolerance) * distance, distance), ILLUMINANCE)
    except MissingDependencyError as error:
        pytest.skip(str(error))
    level = dataclasses.replace(LARGE, pitch=0.0)
    view = one.render((), level, CameraPose((0.0, 0.0, 0.0), 0.0))
    one.close()
    across = (np.arange(640) - 320.0) / 577.0
    down = (np.arange(480) - 240.0) / 577.0
    exact = distance * np.sqrt(1.0 + across[None, :] ** 2 + down[:, None] ** 2)
    assert (view.instance == 4).all()
    np.testing.assert_allclose(view.distance, exact, rtol=0.1 * tolerance)
