"""What of a script was not played, and why; each pair of vehicles collides once, however often it is reported."""

from typing import Any

import gymnasium
import highway_env  # noqa: F401 - registers its environments

from fogsim.scenario import build, scenario_from_config
from fogsim.traffic import BrakeEvent, Event, LaneChangeEvent, Trigger
from fogsim.traffic.highway import HighwayTraffic
from fogsim.traffic.setup import CollisionLog
from fogsim.values import Collision, Command, Reason, Unplayed, UnplayedEvent
from tests.traffic.common import DATA, running

GRID = DATA / "grid" / "grid.sumocfg"
EGO = "veh18"
NOW = Trigger(at_time=0.0, name="now")


def test_sumo_tells_what_came_of_a_script() -> None:
    events = (
        f"{{kind: lamps_fail, vehicle: {EGO}, at_time_s: 0}}",
        f"{{kind: change_lane, vehicle: {EGO}, lanes: 4, at_time_s: 0.5}}",
        f"{{kind: change_lane, vehicle: {EGO}, lanes: -4, at_time_s: 0.5}}",
        "{kind: brake, vehicle: veh0, at_position_m: 5000}",
        "{kind: break_down, vehicle: veh99, at_time_s: 1, lamps: false}",
    )
    settings = f"traffic.events=[{', '.join(events)}]", "traffic.keep_lane=[veh0, veh99, veh98]"
    # Without a look into the files, which would refuse some of these events at once.
    scenario = scenario_from_config(GRID, EGO, ["fog.visibility_m=120", *settings], others_add_vehicles=True)
    with running(build.traffic_setup(scenario)) as traffic:
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


def test_highway_env_tells_it_too_and_without_a_script_whom_it_keeps_in_lane() -> None:
    config = {"vehicles_count": 0, "lanes_count": 2, "initial_lane_id": 0}
    events: list[Event] = [BrakeEvent("lead", NOW), LaneChangeEvent("ego", Trigger(at_time=0.0, name="over"), 1)]
    reasons = UnplayedEvent("now", Reason.NEVER_SEEN), UnplayedEvent("over", Reason.NO_LANE)
    for script, keep_lane, told in ((events, ["ego"], reasons), ([], ["ego", "lead"], ())):
        environment: Any = gymnasium.make("highway-v0", config=config).unwrapped
        traffic = HighwayTraffic(environment, None, events=script, keep_lane=keep_lane)
        traffic.start(1)
        traffic.advance(Command())
        assert traffic.unplayed() == Unplayed(told, ("lead",))


def test_a_pair_collides_once_whoever_is_the_collider_and_is_given_once() -> None:
    log = CollisionLog()
    first, other = Collision(1.0, "a", "b", 5.0), Collision(1.1, "b", "c", 2.0)
    log.add([first])
    log.add([Collision(1.1, "b", "a", 4.0), other])
    assert log.take() == (first, other)
    log.add([Collision(1.2, "a", "b", 3.0)])
    assert log.take() == ()
