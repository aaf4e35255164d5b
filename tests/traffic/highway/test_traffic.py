"""highway-env as the traffic: geometry, drivers in fog, replay."""

import copy
import math
from typing import Any

import gymnasium
import numpy as np
import pytest
from highway_env.road.lane import CircularLane, LineType, SineLane, StraightLane
from highway_env.road.road import Road
from highway_env.road.road import RoadNetwork as HighwayRoads
from highway_env.vehicle.behavior import IDMVehicle
from highway_env.vehicle.kinematics import Vehicle

from fogsim.errors import InputError, SimulationError
from fogsim.traffic import DriverSight
from fogsim.traffic.drivers.lamp_intensity import rear_intensity
from fogsim.traffic.drivers.sight import inherent_contrast
from fogsim.traffic.highway import HighwayTraffic, OtherRoadsError, road_network
from fogsim.traffic.highway.network import speed_limit, upright
from fogsim.units import extinction_from_visibility
from fogsim.values import Collision, Command, Lamp, LaneMarking, SpeedAdvice
from tests.traffic.common import driven, even, hits_of, seen

DAY = 10_000.0
EMPTY = {"vehicles_count": 0, "initial_lane_id": 2}


def traffic_on(config: dict[str, Any], environment: str = "highway-v0") -> tuple[HighwayTraffic, Any]:
    made = gymnasium.make(f"highway_env:{environment}", config=config).unwrapped
    return HighwayTraffic(made, DriverSight(DAY)), made


def network_of(*lanes: tuple[str, str, Any]) -> Any:
    roads = HighwayRoads()
    for start, end, lane in lanes:
        roads.add_lane(start, end, lane)
    road = Road(roads)
    return road_network(road, Vehicle(road, lanes[0][2].position(0.0, 0.0)))


def beside(vehicle: Any, ahead: float, right: float) -> Any:
    return vehicle.position + np.array((ahead, right))


@pytest.mark.filterwarnings("ignore:.*is out of date. You should consider upgrading:DeprecationWarning")
def test_intersections_change_the_drivers_of_no_other_environment() -> None:
    crossing, roads = traffic_on({"initial_vehicle_count": 4}, "intersection-v1")
    crossing.start(1)
    traffic, environment = traffic_on({"vehicles_count": 4})
    traffic.start(1)
    drivers = [[v for v in one.road.vehicles if isinstance(v, IDMVehicle)] for one in (roads, environment)]
    wanted = [{(v.DISTANCE_WANTED, v.COMFORT_ACC_MAX, v.COMFORT_ACC_MIN) for v in those} for those in drivers]
    assert wanted == [{(7.0, 6.0, -3.0)}, {(10.0, 3.0, -5.0)}]


def test_a_straight_road_with_y_up() -> None:
    traffic, environment = traffic_on(EMPTY)
    traffic.start(1)
    network, signs = traffic.network()
    assert signs.signs == ()
    assert [lane.lane_id for lane in network.lanes] == ["0>1_0", "0>1_1", "0>1_2", "0>1_3"]
    for index, lane in enumerate(network.lanes):
        assert lane.centreline == pytest.approx(np.array([(0.0, -4.0 * index, 0.0), (10_000.0, -4.0 * index, 0.0)]))
        assert (lane.width, lane.speed_limit) == (4.0, 30.0)
    dashed, solid = LaneMarking.DASHED, LaneMarking.SOLID
    assert [(lane.left, lane.right) for lane in network.lanes] == [
        (solid, dashed), (dashed, dashed), (dashed, dashed), (dashed, solid),
    ]  # fmt: skip
    assert [lane.outermost for lane in network.lanes] == [False, False, False, True]
    assert network.route == pytest.approx(network.lanes[2].centreline)
    assert network.route_limits.tolist() == [30.0, 30.0]
    assert environment.vehicle.lane_index == ("0", "1", 2)


def test_points_are_level_and_a_lane_without_a_limit_has_the_highest_speed_of_vehicles() -> None:
    assert upright([[1.0, 2.0], [3.0, -4.0]]).tolist() == [[1.0, -2.0, 0.0], [3.0, 4.0, 0.0]]
    assert not np.signbit(upright([0.0, 0.0])).any()
    lanes = (StraightLane([0, 0], [100, 0], speed_limit=limit) for limit in (20.0, None))
    assert [speed_limit(lane) for lane in lanes] == pytest.approx([20.0, 40.0])


def test_front_bumpers_and_headings() -> None:
    traffic, environment = traffic_on(EMPTY)
    traffic.start(1)
    ego = environment.vehicle
    # On highway-env's screen y points down: this one drives down the screen, which is to the south.
    other = Vehicle(environment.road, (ego.position[0] + 50.0, ego.position[1]), heading=math.pi / 2, speed=7.0)
    other.action["acceleration"] = -3.0
    environment.road.vehicles.append(other)
    snapshot = seen(traffic)
    state, row = snapshot.state, 1 - snapshot.ego
    assert state.position[snapshot.ego] == pytest.approx((ego.position[0] + 2.5, -8.0, 0.0))
    assert state.position[row] == pytest.approx((ego.position[0] + 50.0, -8.0 - 2.5, 0.0))
    assert state.heading == pytest.approx([0.0, -math.pi / 2])
    assert (state.speed[row], state.acceleration[row], state.length[row], state.width[row]) == (7.0, -3.0, 5.0, 2.0)
    assert state.lamps[row] & Lamp.STOP
    assert not state.lamps[snapshot.ego] & Lamp.STOP
    assert snapshot.route_position == pytest.approx(ego.position[0] + 2.5)
    assert snapshot.route_length == pytest.approx(10_000.0)
    assert snapshot.speed_limit == 30.0
    assert snapshot.leader is not None
    assert (snapshot.leader.vehicle_id, snapshot.leader.gap) == (state.ids[row], pytest.approx(45.0))


def test_curves_keep_their_shape() -> None:
    quarter = CircularLane((0.0, 0.0), 20.0, 0.0, math.pi / 2, line_types=(LineType.CONTINUOUS, LineType.NONE))
    network = network_of(("a", "b", quarter))
    line = network.lanes[0].centreline
    assert np.hypot(line[:, 0], line[:, 1]) == pytest.approx(np.full(len(line), 20.0))
    assert line[0] == pytest.approx((20.0, 0.0, 0.0))
    assert line[-1] == pytest.approx((0.0, -20.0, 0.0), abs=1e-9)
    assert np.linalg.norm(np.diff(line, axis=0), axis=1).max() <= 2.0
    assert (network.lanes[0].left, network.lanes[0].right) == (LaneMarking.SOLID, LaneMarking.NONE)
    wave = SineLane((0.0, 0.0), (100.0, 0.0), amplitude=3.0, pulsation=2 * math.pi / 100.0, phase=0.0)
    line = network_of(("a", "b", wave)).lanes[0].centreline
    assert line[:, 1] == pytest.approx(-3.0 * np.sin(2 * math.pi * line[:, 0] / 100.0))


def collisions_of_a_driver(visibility: float) -> tuple[list[Collision], float]:
    """Drive at 25 m/s towards a stopped car 200 m ahead; gives the collisions and the distance at which it shows."""
    traffic, environment = traffic_on(EMPTY)
    traffic.start(1)
    ego, road = environment.vehicle, environment.road
    stopped = Vehicle(road, beside(ego, 200.0, 4.0))
    driver = IDMVehicle(road, beside(ego, 0.0, 4.0), speed=25.0, target_speed=25.0, enable_lane_change=False)
    road.vehicles += [driver, stopped]
    traffic.enter_fog(even(visibility))
    snapshots = driven(traffic, 15 * 15)
    state = snapshots[-1].state
    contrast, lamps = inherent_contrast(tuple(state.paint[2])), rear_intensity(int(state.lamps[2]))
    assert driver.speed < 1.0
    return hits_of(snapshots), DriverSight(DAY).seen_distance(extinction_from_visibility(visibility), contrast, lamps)


def test_in_thin_fog_drivers_stop_and_in_dense_fog_they_hit_what_they_see_too_late() -> None:
    assert collisions_of_a_driver(300.0)[0] == []
    (hit,), shows = collisions_of_a_driver(60.0)
    assert hit.collider.startswith("IDMVehicle")
    assert hit.victim.startswith("Vehicle")
    # After the reaction time of 1 s, IDM brakes at its limit, 6 m/s².
    assert hit.impact_speed == pytest.approx(math.sqrt(25.0**2 - 2 * 6.0 * (shows - 25.0 * 1.0)), abs=1.0)


def test_collisions_are_those_that_the_library_knows() -> None:
    traffic, environment = traffic_on({"vehicles_count": 12, "lanes_count": 2})
    traffic.enter_fog(even(30.0))
    traffic.start(4)
    vehicles = environment.road.vehicles
    for first in vehicles[-2:]:
        first.target_speed = 0.01
    hits = hits_of(driven(traffic, 130))
    names = seen(traffic).state.ids
    crashed = {name for name, vehicle in zip(names, vehicles, strict=True) if vehicle.crashed}
    assert len(crashed) > 2
    assert {name for hit in hits for name in (hit.collider, hit.victim)} == crashed
    assert len({frozenset((hit.collider, hit.victim)) for hit in hits}) == len(hits)


def test_the_egos_driver_is_as_blind_as_the_others() -> None:
    traffic, environment = traffic_on(EMPTY)
    traffic.enter_fog(even(40.0))
    traffic.start(1)
    environment.road.vehicles.append(Vehicle(environment.road, beside(environment.vehicle, 200.0, 0.0)))
    assert any("ego" in (hit.collider, hit.victim) for hit in hits_of(driven(traffic, 12 * 15)))


@pytest.mark.parametrize(("visibility", "pulls_out"), [(2000.0, False), (15.0, True)])
def test_who_comes_from_behind_unseen_holds_no_overtaker_back(visibility: float, pulls_out: bool) -> None:
    """MOBIL refuses to make a new follower brake by more than 2 m/s²; that follower is 40 m behind it and faster."""
    traffic, environment = traffic_on({"vehicles_count": 0, "lanes_count": 2, "initial_lane_id": 0})
    traffic.start(1)
    road, ego = environment.road, environment.vehicle
    slow = IDMVehicle(road, beside(ego, 113.0, 4.0), speed=15.0, target_speed=15.0, enable_lane_change=False)
    driver = IDMVehicle(road, beside(ego, 100.0, 4.0), speed=20.0, target_speed=30.0)
    fast = IDMVehicle(road, beside(ego, 55.0, 0.0), speed=32.0, target_speed=32.0, enable_lane_change=False)
    road.vehicles += [slow, driver, fast]
    traffic.enter_fog(even(visibility))
    lane = driver.lane_index
    driven(traffic, 20)
    assert (driver.target_lane_index != lane) == pulls_out


def test_fog_of_one_environment_stays_there() -> None:
    foggy, in_fog = traffic_on(EMPTY)
    clear, in_clear_air = traffic_on(EMPTY)
    foggy.start(1)
    clear.start(1)
    foggy.enter_fog(even(30.0))
    for environment in (in_fog, in_clear_air):
        road, ego = environment.road, environment.vehicle
        road.vehicles.append(Vehicle(road, beside(ego, 100.0, 0.0)))
    assert in_fog.road.neighbour_vehicles(in_fog.vehicle)[0] is None
    assert in_clear_air.road.neighbour_vehicles(in_clear_air.vehicle)[0] is not None
    # What is hidden from the driver is still there for the snapshot.
    assert seen(foggy).leader is not None


def test_a_copied_environment_keeps_its_fog() -> None:
    """Planners copy highway-env's environments; a copy's drivers must look at the copy's vehicles."""
    traffic, environment = traffic_on(EMPTY)
    traffic.start(1)
    traffic.enter_fog(even(60.0))
    copied = copy.deepcopy(environment)
    far, near = (Vehicle(copied.road, beside(copied.vehicle, ahead, 0.0)) for ahead in (150.0, 20.0))
    copied.road.vehicles.append(far)
    assert copied.road.neighbour_vehicles(copied.vehicle)[0] is None
    copied.road.vehicles.append(near)
    assert copied.road.neighbour_vehicles(copied.vehicle)[0] is near
    assert len(environment.road.vehicles) == 1


def test_advice_sets_the_speed_gently_and_lets_go() -> None:
    traffic, _ = traffic_on(EMPTY)
    traffic.start(1)
    slow = Command(SpeedAdvice(15.0), Lamp.POSITION | Lamp.REAR_FOG)
    speeds, hardest = [], 0.0
    for command in [slow] * 300 + [Command()] * 300:
        traffic.advance(command)
        snapshot = seen(traffic)
        speeds.append(snapshot.state.speed[0])
        hardest = min(hardest, snapshot.state.acceleration[0])
        assert snapshot.state.lamps[0] & ~Lamp.STOP == command.lamps
    assert speeds[299] == pytest.approx(15.0, abs=0.3)
    assert hardest == pytest.approx(-2.0, abs=0.05)
    assert speeds[-1] == pytest.approx(25.0, abs=0.5)


def test_advice_to_drive_faster_changes_nothing() -> None:
    traffic, environment = traffic_on(EMPTY)
    traffic.start(1)
    environment.vehicle.target_speed = 20.0
    assert driven(traffic, 150, Command(SpeedAdvice(30.0)))[-1].state.speed[0] == pytest.approx(20.0, abs=0.2)


def test_misuse_and_an_ego_that_is_gone() -> None:
    with pytest.raises(InputError, match="environment of highway-env"):
        HighwayTraffic(gymnasium.make("CartPole-v1"), None)
    traffic, environment = traffic_on(EMPTY)
    with pytest.raises(SimulationError, match="not been started"):
        traffic.advance(Command())
    traffic.start(1)
    environment.road.vehicles.remove(environment.vehicle)
    assert traffic.observe() is None
    environment.configure({"lanes_count": 5})
    with pytest.raises(OtherRoadsError, match="HighwayEnv has built other roads"):
        traffic.start(2)
    traffic.close()
    traffic.close()
    with pytest.raises(SimulationError, match="closed"):
        traffic.network()
