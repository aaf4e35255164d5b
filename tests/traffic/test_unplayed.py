"""What of a script was not played, and why; each pair of vehicles collides once, however often it is reported."""

from typing import Any

import gymnasium
import highway_env  # noqa: F401 - registers its environments

from fogsim.traffic import BrakeEvent, Event, LaneChangeEvent, Trigger
from fogsim.traffic.highway import HighwayTraffic
from fogsim.traffic.setup import CollisionLog
from fogsim.values import Collision, Command, Reason, Unplayed, UnplayedEvent

NOW = Trigger(at_time=0.0, name="now")


def test_highway_env_tells_it_and_without_a_script_whom_it_keeps_in_lane() -> None:
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
