"""What of a script was not played, and why."""

import contextlib
from pathlib import Path
from typing import Any

import gymnasium
import highway_env  # noqa: F401 - registers its environments

from fogsim.scenario import build, scenario_from_config
from fogsim.traffic import BrakeEvent, Event, LaneChangeEvent, Traffic, Trigger, libsumo_traffic
from fogsim.traffic.highway import HighwayTraffic
from fogsim.values import Command, Reason, Unplayed, UnplayedEvent

GRID = Path(__file__).resolve().parents[1] / "data" / "grid" / "grid.sumocfg"
EGO = "veh18"
NOW = Trigger(at_time=0.0, name="now")


def town(*settings: str) -> Traffic:
    # Without a look into the files, which would refuse some of these events at once.
    scenario = scenario_from_config(GRID, EGO, ["fog.visibility_m=120", *settings], others_add_vehicles=True)
    traffic = libsumo_traffic(build.traffic_setup(scenario))
    traffic.start(1)
    return traffic


def test_sumo_tells_what_came_of_a_script() -> None:
    events = (
        f"{{kind: lamps_fail, vehicle: {EGO}, at_time_s: 0}}",
        f"{{kind: change_lane, vehicle: {EGO}, lanes: 4, at_time_s: 0.5}}",
        f"{{kind: change_lane, vehicle: {EGO}, lanes: -4, at_time_s: 0.5}}",
        "{kind: brake, vehicle: veh0, at_position_m: 5000}",
        "{kind: break_down, vehicle: veh99, at_time_s: 1, lamps: false}",
    )
    with contextlib.closing(
        town(f"traffic.events=[{', '.join(events)}]", "traffic.keep_lane=[veh0, veh99, veh98]")
    ) as traffic:
        for _ in range(10):
            traffic.advance(Command())
        told = traffic.unplayed()
    assert [(event.name, event.reason) for event in told.events] == [
        (f"traffic.events.1 (change_lane of {EGO} at_time_s=0.5)", Reason.NO_LANE),
        (f"traffic.events.2 (change_lane of {EGO} at_time_s=0.5)", Reason.NO_LANE),
        ("traffic.events.3 (brake of veh0 at_position_m=5000)", Reason.NOT_REACHED),
        ("traffic.events.4 (break_down of veh99 at_time_s=1)", Reason.NEVER_SEEN),
    ]
    assert told.vehicles == ("veh98", "veh99")


def test_sumo_changes_to_a_lane_that_is_there() -> None:
    traffic = town("traffic.keep_lane=[]")
    snapshot = traffic.observe()
    traffic.close()
    assert snapshot is not None
    lane = int(snapshot.state.lane[snapshot.ego][-1])
    to_the_other = 1 if lane == 0 else -1
    with contextlib.closing(
        town(f"traffic.events=[{{kind: change_lane, vehicle: {EGO}, lanes: {to_the_other}, at_time_s: 0}}]")
    ) as traffic:
        for _ in range(5):
            traffic.advance(Command())
        assert not traffic.unplayed()
        moved = traffic.observe()
    assert moved is not None
    assert int(moved.state.lane[moved.ego][-1]) == lane + to_the_other


def test_highway_env_tells_it_too() -> None:
    environment: Any = gymnasium.make(
        "highway-v0", config={"vehicles_count": 0, "lanes_count": 2, "initial_lane_id": 0}
    ).unwrapped
    events: list[Event] = [BrakeEvent("lead", NOW), LaneChangeEvent("ego", Trigger(at_time=0.0, name="over"), 1)]
    traffic = HighwayTraffic(environment, None, events=events, keep_lane=["ego"])
    traffic.start(1)
    traffic.advance(Command())
    told = traffic.unplayed()
    traffic.close()
    assert told.events == (UnplayedEvent("now", Reason.NEVER_SEEN), UnplayedEvent("over", Reason.NO_LANE))
    assert told.vehicles == ("lead",)


def test_highway_env_without_a_script_knows_whom_it_keeps_in_lane() -> None:
    environment: Any = gymnasium.make("highway-v0", config={"vehicles_count": 0, "lanes_count": 1}).unwrapped
    traffic = HighwayTraffic(environment, None, keep_lane=["ego", "lead"])
    traffic.start(1)
    assert traffic.unplayed() == Unplayed(vehicles=("lead",))
    traffic.close()
