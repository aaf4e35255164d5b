"""Both ways to draw show the same."""

import dataclasses
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from fogsim.render import Renderer, make_renderer
from fogsim.scene import build_scene, vehicle_batches
from fogsim.traffic.road.network import read_net, road_network
from fogsim.values import Batch, Camera, CameraPose, Scene, SignMap, View
from tests.render.conftest import Place, along, traffic, walls

ROOT = Path(__file__).resolve().parents[2]
ILLUMINANCE = 18e3
LARGE = Camera(640, 480, 577.0, (320.0, 240.0), 1.38, pitch=math.radians(2.0))
SMALL = Camera(160, 120, 144.25, (80.0, 60.0), 1.38, pitch=math.radians(2.0))
TILTED = dataclasses.replace(SMALL, pitch=0.1, roll=0.15)

Pair = tuple[Renderer, Renderer]


def pair(scene: Scene) -> Iterator[Pair]:
    made = (make_renderer("opengl", scene, ILLUMINANCE), make_renderer("cpu", scene, ILLUMINANCE))
    yield made
    for one in made:
        one.close()


@pytest.fixture(scope="module")
def route() -> np.ndarray:
    net = read_net(ROOT / "scenarios" / "motorway_fog_bank" / "motorway.net.xml")
    return road_network(net, ["approach", "bank", "exit"]).route


@pytest.fixture(scope="module")
def drawn(opengl: None, place: Place) -> Iterator[Pair]:
    yield from pair(place.scene)


@pytest.fixture(scope="module")
def town(opengl: None) -> Iterator[Pair]:
    network = road_network(read_net(ROOT / "tests" / "data" / "grid" / "grid.net.xml"), ["A0B0"])
    yield from pair(build_scene(network, SignMap(), np.random.default_rng(1)))


def pose_at(route: np.ndarray, station: float) -> CameraPose:
    (x, y, z), heading = along(route, station)
    return CameraPose((float(x), float(y), float(z) + 1.38), heading)


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


def test_on_the_motorway(drawn: Pair, route: np.ndarray) -> None:
    seen = set()
    for station in [250.0, 1700.0, 3000.0]:
        for camera in [LARGE, SMALL, TILTED]:
            view = assert_same(drawn, (), camera, pose_at(route, station))
            assert {0, 1, 2, 3} <= set(np.unique(view.instance))
            seen.update(np.unique(view.instance).tolist())
    assert 4 in seen


@pytest.mark.parametrize(("camera", "gap"), [(LARGE, 30.0), (SMALL, 4.0)])
def test_with_a_truck_ahead_and_others_beside(drawn: Pair, route: np.ndarray, camera: Camera, gap: float) -> None:
    places = [(15.5, 3.5), (60.0, 0.0), (34.0, -3.5), (90.0, 3.5), (gap, 0.0)]  # by their kinds: the last is a truck
    ahead = vehicle_batches(traffic([along(route, 100.0 + further, left) for further, left in places]), None)
    view = assert_same(drawn, ahead, camera, pose_at(route, 100.0))
    assert {16, 20} <= set(np.unique(view.instance))


def test_at_junctions_of_a_town(town: Pair) -> None:
    for place in [(0.0, 0.0, 0.0), (60.0, -4.0, 0.0), (30.0, 30.0, 2.0)]:
        for camera in [LARGE, SMALL]:
            x, y, heading = place
            view = assert_same(town, (), camera, CameraPose((x, y, 1.38), heading))
            assert len(np.unique(view.instance)) > 2


@pytest.mark.usefixtures("opengl")
def test_a_wall_is_as_far_as_it_is_and_hides_what_is_hardly_farther() -> None:
    for renderer in ["opengl", "cpu"]:
        for distance, tolerance in [(10.0, 0.002), (30.0, 0.002), (100.0, 0.002), (300.0, 0.002), (1000.0, 0.01)]:
            one = make_renderer(renderer, walls((1.0 + tolerance) * distance, distance), ILLUMINANCE)
            level = dataclasses.replace(LARGE, pitch=0.0)
            view = one.render((), level, CameraPose((0.0, 0.0, 0.0), 0.0))
            one.close()
            across, down = (np.arange(640) - 320.0) / 577.0, (np.arange(480) - 240.0) / 577.0
            exact = distance * np.sqrt(1.0 + across[None, :] ** 2 + down[:, None] ** 2)
            assert (view.instance == 4).all()
            np.testing.assert_allclose(view.distance, exact, rtol=0.1 * tolerance)
