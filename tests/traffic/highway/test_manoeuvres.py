"""Scripted events, acted out by highway-env's vehicles."""

import copy
import math
from collections.abc import Sequence
from typing import Any

import gymnasium
import highway_env  # noqa: F401 - registers its environments
import numpy as np
import pytest

from fogsim.atmosphere import FieldAccess, airlight_from_illuminance
from fogsim.errors import InputError
from fogsim.traffic import AfterCollision, BrakeEvent, DriverSight, Event, LampFailureEvent, LaneChangeEvent, Trigger
from fogsim.traffic.highway import HighwayTraffic
from fogsim.units import extinction_from_visibility
from fogsim.values import FogField, TrafficSnapshot
from fogsim.values.light import ALL_LAMPS
from fogsim.values.script import ChangeLane, ChangeSpeed, SetLamps, SetSignal
from tests.traffic.common import driven, seen

ONE_LANE = {"vehicles_count": 1, "lanes_count": 1}
THREE_LANES = {"vehicles_count": 1, "lanes_count": 3, "initial_lane_id": 1}
NOW = Trigger(at_time=0.0)


def traffic_of(
    events: Sequence[Event], config: dict[str, Any] | None = None, **options: Any
) -> tuple[HighwayTraffic, Any]:
    environment: Any = gymnasium.make("highway-v0", config=config or ONE_LANE).unwrapped
    return HighwayTraffic(environment, None, events=events, **options), environment


def of(snapshot: TrafficSnapshot, vehicle: str) -> int:
    return snapshot.state.ids.index(vehicle)


def drive(traffic: HighwayTraffic, seconds: float) -> list[TrafficSnapshot]:
    return driven(traffic, round(seconds / traffic.step_length))


def course(snapshots: Sequence[TrafficSnapshot], vehicle: str = "lead") -> tuple[Any, Any, Any]:
    """Times, speeds and accelerations of a vehicle."""
    rows = [(s.state.time, s.state.speed[of(s, vehicle)], s.state.acceleration[of(s, vehicle)]) for s in snapshots]
    return tuple(np.array(rows).T)


def test_of_a_timeline_changes_of_lane_and_failing_lamps_are_played_and_all_else_is_refused() -> None:
    traffic, environment = traffic_of([], THREE_LANES)
    traffic.start(0)
    asked = ChangeLane("ego", 1), ChangeLane("ego", 5), ChangeLane("nobody", 1), SetLamps("ego", failed=ALL_LAMPS)
    assert traffic.begin(asked) == (ChangeLane("nobody", 1),)
    last = drive(traffic, 6.0)[-1]
    assert environment.vehicle.lane_index[2] == 0
    assert last.state.lamps[of(last, "ego")] == 0
    for action in (ChangeSpeed("lead", 5.0), ChangeLane("ego", 1, duration=2.0), SetSignal("C")):
        with pytest.raises(InputError, match=f"vehicles cannot play {type(action).__name__}: only changes of lane"):
            traffic.begin([action])


def test_a_lead_vehicle_brakes_as_hard_as_scripted_and_drives_on() -> None:
    traffic, _ = traffic_of([BrakeEvent("lead", Trigger(at_time=2.0), to_speed=10.0, deceleration=3.0, hold=8.0)])
    traffic.start(1)
    own = seen(traffic).state.speed[of(seen(traffic), "lead")]
    time, speed, acceleration = course(drive(traffic, 25.0))
    begun, over = time[acceleration < -1.0].min(), time[acceleration < -1.0].max()
    assert begun == pytest.approx(2.0, abs=0.1)
    # One step each for the beginning and the end.
    assert over - begun == pytest.approx((own - 10.0) / 3.0, abs=0.25)
    braking = (time >= begun) & (time < over - 0.1)
    assert acceleration[braking] == pytest.approx(np.full(braking.sum(), -3.0), abs=1e-9)
    held = (time > over + 0.1) & (time < 9.9)
    assert speed[held] == pytest.approx(np.full(held.sum(), 10.0), abs=1e-6)
    assert speed[-1] == pytest.approx(own, abs=0.5)


def test_no_vehicle_brakes_harder_than_it_can() -> None:
    traffic, _ = traffic_of([BrakeEvent("lead", NOW, deceleration=20.0)])
    traffic.start(1)
    _, _, acceleration = course(drive(traffic, 5.0))
    assert acceleration.min() == pytest.approx(-6.0)


def test_a_vehicle_that_breaks_down_stops_and_stays() -> None:
    traffic, environment = traffic_of([BrakeEvent("lead", Trigger(at_position=50.0), deceleration=3.0)])
    traffic.start(1)
    lead = next(v for v in environment.road.vehicles if v is not environment.vehicle)
    start, own = lead.position[0], lead.speed
    snapshots = drive(traffic, 24.0)
    _, speed, _ = course(snapshots)
    assert speed.min() >= 0.0
    assert speed[-150:] == pytest.approx(np.zeros(150))
    # Two steps of the way: one to find that 50 m are driven, one of rounding.
    assert lead.position[0] - start == pytest.approx(50.0 + own**2 / 6.0, abs=2.0 * own / 15.0)
    # Its follower, who sees it, stops behind it.
    assert not [c for s in snapshots for c in s.collisions]
    assert snapshots[-1].state.speed[snapshots[-1].ego] < 1.0


def test_a_gap_to_the_ego_begins_it() -> None:
    traffic, environment = traffic_of([BrakeEvent("lead", Trigger(at_gap_to_ego=60.0), to_speed=5.0)])
    traffic.start(1)
    environment.vehicle.target_speed = 30.0
    environment.road.vehicles[1].position[0] += 60.0  # it is farther away than that when it begins
    for snapshot in drive(traffic, 60.0):
        positions = snapshot.state.position
        if snapshot.state.acceleration[of(snapshot, "lead")] < -3.5:
            length = float(snapshot.state.length[of(snapshot, "lead")])
            gap = math.dist(positions[snapshot.ego], positions[of(snapshot, "lead")]) - length
            break
    else:
        pytest.fail("it never braked")
    assert gap == pytest.approx(60.0, abs=1.0)


def test_lamps_that_fail_are_dark_and_at_night_nobody_sees_a_vehicle_whose_lamps_have_failed() -> None:
    """At 80 m in fog of 150 m it is beyond the headlamps' reach, but not its tail lamps': 8 cd e^(−1.6) / 80² lx."""
    environment: Any = gymnasium.make("highway-v0", config=ONE_LANE).unwrapped
    event = LampFailureEvent("lead", Trigger(at_time=0.2))
    traffic = HighwayTraffic(environment, DriverSight(illuminance=0.1), events=[event])
    traffic.enter_fog(FieldAccess(FogField(extinction_from_visibility(150.0), airlight_from_illuminance(0.1))))
    traffic.start(1)
    ego, lead = environment.road.vehicles
    lead.position[:] = ego.position + np.array([85.0, 0.0])
    lead.speed = ego.speed
    assert environment.road.neighbour_vehicles(ego)[0] is lead
    lit = [int(s.state.lamps[of(s, "lead")]) for s in drive(traffic, 0.6)]
    assert sum(lamps != 0 for lamps in lit) == pytest.approx(3, abs=1)
    assert lit[-1] == 0
    assert environment.road.neighbour_vehicles(ego)[0] is None


def test_a_vehicle_cuts_in_and_is_free_again() -> None:
    traffic, environment = traffic_of(
        [LaneChangeEvent("ego", Trigger(at_time=1.0), lanes=1, stay=6.0)], THREE_LANES, keep_lane=["lead"]
    )
    traffic.start(1)
    ego = environment.vehicle
    ego.enable_lane_change = True
    drive(traffic, 0.9)
    assert ego.lane_index[2] == 1
    drive(traffic, 5.0)
    # Lanes are counted from the left, and y points to the right.
    assert (ego.lane_index[2], ego.enable_lane_change) == (0, False)
    assert ego.position[1] == pytest.approx(0.0, abs=0.3)
    drive(traffic, 1.5)
    assert ego.enable_lane_change


def test_a_change_ends_at_the_outermost_lane() -> None:
    traffic, environment = traffic_of([LaneChangeEvent("ego", NOW, -4)], THREE_LANES)
    traffic.start(1)
    drive(traffic, 3.0)
    assert environment.vehicle.lane_index[2] == 2


def test_a_script_replays_and_begins_anew_at_every_start() -> None:
    events = [BrakeEvent("lead", Trigger(at_time=1.0), to_speed=8.0), LaneChangeEvent("ego", NOW, 1)]
    traffic, _ = traffic_of(events, {"vehicles_count": 10, "initial_lane_id": 2})

    def run() -> TrafficSnapshot:
        traffic.start(4)
        return drive(traffic, 3.0)[-1]

    one, again = run(), run()
    assert np.array_equal(one.state.position, again.state.position)
    assert one.state.ids == again.state.ids


def test_a_copied_environment_plays_its_own_script() -> None:
    """Planners copy highway-env's environments; what the copy does must not happen to the original."""
    traffic, environment = traffic_of([BrakeEvent("lead", Trigger(at_time=0.5), to_speed=5.0)])
    traffic.start(1)
    copied = copy.deepcopy(environment)
    before = [v.speed for v in environment.road.vehicles]
    for _ in range(30):
        copied.road.act()
        copied.road.step(1 / 15)
        copied.steps += 1
    assert copied.road.vehicles[1].speed < before[1] - 3.0
    assert [v.speed for v in environment.road.vehicles] == before


def test_vehicles_that_are_not_there_are_told() -> None:
    for event in (LampFailureEvent("leed", NOW), BrakeEvent("IDMVehicle 99", NOW)):
        traffic, _ = traffic_of([event])
        with pytest.raises(InputError, match=rf"no vehicle '{event.vehicle}' in HighwayEnv.*ego, lead"):
            traffic.start(1)
    traffic, _ = traffic_of([], keep_lane=["leed"])
    with pytest.raises(InputError, match=r"traffic\.keep_lane: .*did you mean 'lead'"):
        traffic.start(1)


def test_vehicles_that_have_collided_vanish_if_they_shall() -> None:
    """Two stand in the way of a third; the collision is told all the same."""

    def after(what: AfterCollision) -> tuple[int, int]:
        traffic, environment = traffic_of(
            [BrakeEvent("IDMVehicle 1", NOW, deceleration=6.0)], {"vehicles_count": 2}, after_collision=what
        )
        traffic.start(2)
        first, second = environment.road.vehicles[1:3]
        second.position[:] = first.position - np.array([8.0, 0.0])
        second.speed, second.target_lane_index = 30.0, first.lane_index
        snapshots = drive(traffic, 4.0)
        return sum(len(s.collisions) for s in snapshots), len(snapshots[-1].state.ids)

    assert after(AfterCollision.STOP) == (1, 3)
    assert after(AfterCollision.REMOVE) == (1, 1)
