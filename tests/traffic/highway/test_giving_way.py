"""Right of way at highway-env's junctions, as far as drivers see who comes."""

import math
from types import SimpleNamespace
from typing import Any

import gymnasium
import numpy as np
import pytest
from highway_env.road.lane import StraightLane
from highway_env.road.regulation import RegulatedRoad
from highway_env.road.road import RoadNetwork as HighwayRoads
from highway_env.vehicle.behavior import IDMVehicle

from fogsim.traffic import DriverSight
from fogsim.traffic.highway import Fleet, HighwayTraffic, limit_sight
from tests.traffic.common import driven, even, hits_of

DAY = 10_000.0


def crossing(apart: float) -> tuple[Any, Any, Any]:
    """A main and a minor road, and a vehicle on each, so far from where they cross."""
    roads = HighwayRoads()
    roads.add_lane("w", "e", StraightLane((-200.0, 0.0), (200.0, 0.0), priority=1, speed_limit=15.0))
    roads.add_lane("s", "n", StraightLane((0.0, 200.0), (0.0, -200.0), priority=0, speed_limit=15.0))
    road = RegulatedRoad(roads)
    main = IDMVehicle(road, np.array([-apart, 0.0]), speed=15.0, target_speed=15.0)
    minor = IDMVehicle(road, np.array([0.0, apart]), heading=-math.pi / 2, speed=15.0, target_speed=15.0)
    road.vehicles += [main, minor]
    return road, main, minor


def stepped(road: Any) -> Any:
    """What a fleet asks of an environment."""
    return SimpleNamespace(road=road, steps=0, config={"simulation_frequency": 15})


def gives_way(apart: float, visibility: float, waited: int = 0) -> bool:
    """Whether the vehicle on the minor road gives way, having looked some steps ago."""
    road, main, minor = crossing(apart)
    environment = stepped(road)
    limit_sight(even(visibility), Fleet(environment, main), DriverSight(DAY))
    assert RegulatedRoad.respect_priorities(main, minor) is minor
    road.respect_priorities(main, minor)
    environment.steps = waited
    return road.respect_priorities(main, minor) is minor


def test_nobody_gives_way_to_whom_they_do_not_see() -> None:
    """Vehicles 30 m before a crossing are 42 m from each other."""
    assert gives_way(30.0, 2000.0)
    assert not gives_way(30.0, 20.0)
    assert not gives_way(30.0, 20.0, waited=60)
    assert gives_way(5.0, 20.0)


def test_who_comes_into_view_is_given_way_to_after_the_reaction_time() -> None:
    road, main, minor = crossing(30.0)
    environment = stepped(road)
    limit_sight(even(20.0), Fleet(environment, main), DriverSight(DAY))
    assert road.respect_priorities(main, minor) is None
    main.position, minor.position = np.array([-5.0, 0.0]), np.array([0.0, 5.0])
    answers = []
    for step in (5, 14, 15, 30):
        environment.steps = step
        answers.append(road.respect_priorities(main, minor))
    assert answers == [None, None, minor, minor]


@pytest.mark.parametrize(("visibility", "collides"), [(2000.0, False), (15.0, True)])
@pytest.mark.filterwarnings("ignore:.*is out of date. You should consider upgrading:DeprecationWarning")
def test_who_crosses_unseen_is_hit(visibility: float, collides: bool) -> None:
    """The ego comes from the south, where it has to give way to who comes from the west."""
    made: Any = gymnasium.make("highway_env:intersection-v1", config={"initial_vehicle_count": 0, "destination": "o2"})
    environment = made.unwrapped
    traffic = HighwayTraffic(environment, DriverSight(DAY))
    traffic.start(1)
    road, ego = environment.road, environment.vehicle
    # Both have the same way to the middle of the junction, 111 m from where their roads begin.
    other = IDMVehicle.make_on_lane(road, ("o1", "ir1", 0), longitudinal=111.0 - ego.position[1], speed=10.0)
    other.plan_route_to("o3")
    road.vehicles[:] = [ego, other]
    traffic.enter_fog(even(visibility))
    assert bool(hits_of(driven(traffic, 8 * 15))) == collides
