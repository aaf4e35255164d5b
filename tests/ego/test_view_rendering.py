"""The same world wherever it lies, and around the ego wherever it drives."""

import numpy as np
import pytest

import fogsim
from fogsim.camera import mounted_pose
from fogsim.scenario import build
from fogsim.simulation.ego import view_rendering
from fogsim.simulation.ego.view_rendering import ViewRenderer
from fogsim.values import Lane, LaneMarking, RoadNetwork, SignMap, Structure, StructureKind, TrafficState
from tests.helpers.vehicles import vehicles

SETTINGS = ("renderer=cpu", "camera.width=80", "camera.height=60", "fog={visibility_m: 200}")


def road(start: tuple[float, float], length: float, name: str) -> Lane:
    line = np.array([[*start, 0.0], [start[0] + length, start[1], 0.0]])
    return Lane(name, name, line, 3.5, 25.0, LaneMarking.SOLID, LaneMarking.SOLID, outermost=True)


def two_cars(x: float, y: float) -> TrafficState:
    places = [[x, y, 0.0], [x + 27.3, y + 0.4, 0.0]]
    return vehicles(places, ids=("ego", "other"), speed=20.0, size=(4.5, 1.8, 1.5), paint=0.4)


def drawing(scenario: fogsim.Scenario, *lanes: Lane, structures: tuple[Structure, ...] = ()) -> ViewRenderer:
    """A renderer of a network whose route leads along its lanes."""
    route = np.concatenate([lane.centreline for lane in lanes])
    network = RoadNetwork(lanes, route, structures=structures)
    return ViewRenderer(build.world_config(scenario), build.camera_config(scenario), network, SignMap())


def seen(view_renderer: ViewRenderer, scenario: fogsim.Scenario, state: TrafficState) -> tuple[np.ndarray, np.ndarray]:
    pose = mounted_pose(
        build.camera_config(scenario).on(), state.position[0], 0.0, build.camera_config(scenario).mount().setback
    )
    view, radiance = view_renderer.render(state, 0, pose, 0.0)
    return view.instance.copy(), radiance.copy()


def test_a_camera_beside_the_road_sees_every_vehicle(scenario: fogsim.Scenario) -> None:
    view_renderer, state = drawing(scenario, road((0.0, 0.0), 900.0, "a")), two_cars(100.0, 0.0)
    pose = mounted_pose(build.camera_config(scenario).on(), np.array([60.0, 0.0, 0.0]), 0.0, 0.0)
    seen_by = {ego: set(view_renderer.render(state, ego, pose, 0.0)[0].instance.ravel()) for ego in (None, 0)}
    # One hides the other.
    assert 16 in seen_by[None]
    assert 16 not in seen_by[0] >= {17}
    view_renderer.close()


@pytest.fixture(scope="module")
def scenario() -> fogsim.Scenario:
    return fogsim.load_scenario("motorway_fog_bank", list(SETTINGS))


def test_a_million_metres_from_the_origin_the_picture_is_the_same(scenario: fogsim.Scenario) -> None:
    pictures = []
    for x, y in ((0.0, 0.0), (1.0e6, 5.5e6)):
        view_renderer = drawing(scenario, road((x, y), 900.0, "a"))
        pictures.append(seen(view_renderer, scenario, two_cars(x + 100.13, y + 0.17)))
        view_renderer.close()
    assert (pictures[0][0] >= 16).sum() > 10
    assert np.mean(pictures[0][0] == pictures[1][0]) > 0.999
    # The grain of asphalt and grass lies elsewhere, and trees are the same.
    assert pictures[1][1].mean() == pytest.approx(pictures[0][1].mean(), rel=0.01)


def test_where_the_ego_leaves_its_route_there_is_a_road_too(scenario: fogsim.Scenario) -> None:
    lanes = road((0.0, 0.0), 900.0, "a"), road((0.0, 9000.0), 900.0, "b")
    view_renderer = ViewRenderer(
        build.world_config(scenario), build.camera_config(scenario), RoadNetwork(lanes, lanes[0].centreline), SignMap()
    )
    shares = [np.mean(seen(view_renderer, scenario, two_cars(100.0, y))[0] == 2) for y in (0.0, 9000.0, 0.0)]
    assert shares[0] > 0.2
    assert shares[1:] == pytest.approx([shares[0]] * 2, abs=0.02)
    view_renderer.close()


def test_a_large_network_looks_as_if_it_were_built_whole(
    scenario: fogsim.Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    lanes = [road((900.0 * number, 0.0), 900.0, str(number)) for number in range(5)]
    pictures = []
    for few in (0, 2000):
        monkeypatch.setattr(view_rendering, "FEW_LANES", few)
        view_renderer = drawing(scenario, *lanes)
        pictures.append([seen(view_renderer, scenario, two_cars(x, 0.1)) for x in (100.0, 2100.0)])
        view_renderer.close()
    for there, here in zip(*pictures, strict=True):
        np.testing.assert_array_equal(there[0], here[0])
        np.testing.assert_array_equal(there[1], here[1])


def test_a_closed_view_renderer_says_so(scenario: fogsim.Scenario) -> None:
    view_renderer = drawing(scenario, road((0.0, 0.0), 100.0, "a"))
    view_renderer.close()
    with pytest.raises(fogsim.FogSimError, match="closed"):
        seen(view_renderer, scenario, two_cars(10.0, 0.0))


def test_lamps_in_tunnels_shine_by_day_as_at_dusk_on_the_bonnet_too() -> None:
    settings = [*SETTINGS[:3], "fog={visibility_m: inf}", "camera.bonnet=true"]
    dim = fogsim.load_scenario("motorway_fog_bank", settings)
    lane = road((0.0, 0.0), 900.0, "a")
    roof = Structure("t", StructureKind.TUNNEL, lane.centreline, 12.0, 5.2, 6.0)
    view_renderer = drawing(dim, lane, structures=(roof,))
    state, camera = two_cars(400.0, 0.0), build.camera_config(dim)
    pose = mounted_pose(camera.on(), state.position[0], 0.0, camera.mount().setback)
    day, dusk = (view_renderer.render(state, 0, pose, 0.0, illuminance=light)[1].copy() for light in (10_000.0, 100.0))
    view = view_renderer.render(state, 0, pose, 0.0)[0]
    bonnet, middle = view.instance == 16, (view.distance < 25.0) & (np.abs(np.arange(80) - 40) < 5)
    view_renderer.close()
    for part in (bonnet, middle & ~bonnet):
        assert part.sum() > 50
        assert day[part].mean() == pytest.approx(dusk[part].mean(), rel=0.05)
