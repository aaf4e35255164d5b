"""highway-env's drivers: the speeds that they choose in fog, how they follow advice, what they misjudge."""

import math
from collections.abc import Sequence
from typing import Any

import gymnasium
import highway_env  # noqa: F401 - registers its environments
import numpy as np
import pytest
from highway_env.vehicle.behavior import IDMVehicle

from fogsim.core.kinematics import safe_speed
from fogsim.errors import InputError
from fogsim.traffic import Compliance, DriverSetup, DriverSight
from fogsim.traffic.drivers.sight import leader_reach
from fogsim.traffic.drivers.speed_choice import SpeedChoice, driver_traits, too_fast, unaffected, within_sight
from fogsim.traffic.highway import HighwayTraffic
from fogsim.values import Command, Display, SpeedAdvice, Stretch, StretchAdvice
from tests.traffic.common import even, heard, seen

DAY = 10_000.0
FAST = 30.0
# Far apart, so that nobody is held up by anybody.
CONFIG = {"vehicles_count": 12, "lanes_count": 4, "vehicles_density": 0.3}


class Road:
    """Vehicles that drive 30 m/s by themselves, in fog or none."""

    def __init__(
        self, setup: DriverSetup, visibility: float = math.inf, seed: int = 3, sight: DriverSight | None = None
    ) -> None:
        self.environment: Any = gymnasium.make("highway-v0", config=CONFIG).unwrapped
        self.traffic = HighwayTraffic(self.environment, sight, drivers=setup)
        if math.isfinite(visibility):
            self.traffic.enter_fog(even(visibility))
        self.traffic.start(seed)
        for vehicle in self.others:
            vehicle.target_speed = FAST

    @property
    def others(self) -> Sequence[Any]:
        return [v for v in self.environment.road.vehicles if v is not self.environment.vehicle]

    @property
    def ids(self) -> list[str]:
        return [v for v in seen(self.traffic).state.ids if v != "ego"]

    def drive(self, seconds: float, command: Command | None = None) -> "Road":
        for _ in range(round(seconds / self.traffic.step_length)):
            self.traffic.advance(command or Command())
        return self

    def targets(self) -> list[float]:
        return [float(v.target_speed) for v in self.others]

    def speeds(self) -> list[float]:
        return [float(v.speed) for v in self.others]


def exact(choice: SpeedChoice = unaffected, **compliance: float) -> DriverSetup:
    return DriverSetup(choice, spread=0.0, compliance=Compliance(**compliance))


def test_uninformed_drivers_are_faster_than_their_sight_allows() -> None:
    safe = safe_speed(100.0, 2.5, 3.4)
    # (−2.5 + √(2.5² + 2 · 100 / 3.4)) · 3.4
    assert safe == pytest.approx(18.93, abs=0.01)
    hasty = Road(exact(too_fast), 100.0).drive(15.0).speeds()
    assert max(hasty) == pytest.approx(1.4 * safe, abs=0.3)
    assert min(hasty) > safe


def test_the_unaffected_drive_as_in_clear_air() -> None:
    clear, foggy = ([v.position for v in Road(exact(), v).drive(2.0).others] for v in (math.inf, 100.0))
    assert np.array_equal(foggy, clear)


def test_they_slow_down_gently_and_speed_up_where_the_fog_ends() -> None:
    road = Road(exact(within_sight), 10_000.0).drive(6.0)
    road.traffic.enter_fog(even(60.0))
    hardest = 0.0
    for _ in range(180):
        road.drive(road.traffic.step_length)
        hardest = min(hardest, *(v.action["acceleration"] for v in road.others))
    assert max(road.speeds()) == pytest.approx(safe_speed(60.0, 2.5, 3.4), abs=0.3)
    # Some follow one another, so that IDM itself brakes a little harder.
    assert -3.0 < hardest < -1.8
    road.traffic.enter_fog(even(10_000.0))
    assert road.drive(1.0).targets() == [FAST] * len(road.others)


def test_every_driver_has_a_factor_of_their_own() -> None:
    assert len(set(Road(DriverSetup(too_fast, spread=0.2), 80.0).drive(9.0).targets())) > 6


def advised(road: Road, speed: float = 15.0) -> Command:
    return Command(advised_speeds=dict.fromkeys(road.ids, speed))


def test_advice_that_all_follow_sets_every_target_speed_after_the_delay() -> None:
    road = Road(exact(rate=1.0, strength=1.0, delay=4.0))
    command = advised(road)
    assert road.drive(3.8, command).targets() == [FAST] * len(road.others)
    assert max(road.drive(1.4, command).targets()) < FAST
    assert road.drive(8.0, command).targets() == pytest.approx([15.0] * len(road.others))
    # And who is no longer advised drives as before.
    assert road.drive(1.5).targets() == [FAST] * len(road.others)


def test_those_whom_it_reaches_and_who_follow_are_the_share_that_is_asked_for() -> None:
    setup = exact(reached_share=0.5, rate=0.5)
    road = Road(setup)
    traits = [driver_traits(setup, name, 3) for name in road.ids]
    followers = [driver.follows(setup.compliance) for driver in traits]
    reached = [name for name, driver in zip(road.ids, traits, strict=True) if driver.hears(setup.compliance)]
    assert 0 < sum(followers) < len(reached) < len(traits)
    targets = road.drive(12.0, advised(road)).targets()
    assert targets == pytest.approx([15.0 if follows else FAST for follows in followers])
    assert heard(seen(road.traffic).state) == dict.fromkeys(reached, 15.0)


def test_advice_to_all_on_a_stretch_is_heard_there() -> None:
    road = Road(exact(delay=0.0))
    places = {
        name: v.lane.local_coordinates(v.position)[0] + v.LENGTH / 2
        for name, v in zip(road.ids, road.others, strict=True)
    }
    start, end = sorted(places.values())[2] - 1.0, sorted(places.values())[7] + 1.0
    for stretch in (Stretch(start, end), Stretch(start, end, ("0>1",))):
        road = Road(exact(delay=0.0))
        heard = road.drive(0.1, Command(stretches=(StretchAdvice(15.0, stretch),))).targets()
        assert [target < FAST for target in heard] == [start < x < end for x in places.values()]


def test_a_sign_is_read_in_passing_and_its_advice_ends_with_the_stretch() -> None:
    road = Road(exact(delay=0.0))
    front = max(v.position[0] for v in road.others)
    sign = StretchAdvice(25.0, Stretch(front + 50.0, front + 150.0), Display.MESSAGE_SIGN)
    first = max(road.others, key=lambda v: v.position[0])
    road.drive(1.0, Command(stretches=(sign,)))
    assert first.target_speed == FAST
    road.drive(3.0, Command(stretches=(sign,)))
    assert 24.0 < first.target_speed < FAST
    road.drive(6.0)
    assert first.target_speed == FAST


def test_the_egos_advice_reaches_those_near_it() -> None:
    road = Road(exact(delay=0.0))
    ego = road.environment.vehicle.position
    apart = [float(np.linalg.norm(v.position - ego)) for v in road.others]
    reach = sorted(apart)[5] + 1.0
    targets = road.drive(0.1, Command(SpeedAdvice(15.0), advice_reach=reach)).targets()
    assert [target < FAST for target in targets] == [distance <= reach for distance in apart]
    assert heard(seen(road.traffic).state) == dict.fromkeys(
        ["ego", *(v for v, d in zip(road.ids, apart, strict=True) if d <= reach)], 15.0
    )


@pytest.mark.parametrize(
    ("stretch", "message"),
    [(Stretch(edges=("0>2",)), "no edge '0>2'; .*0>1"), (Stretch(20_000.0), "the ego's route is 10000 m long")],
)
def test_a_stretch_that_the_road_does_not_have_is_refused(stretch: Stretch, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Road(exact()).drive(0.1, Command(stretches=(StretchAdvice(15.0, stretch),)))


def test_who_misjudges_distances_keeps_a_shorter_headway(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(IDMVehicle, "DISTANCE_WANTED", 10.0)  # which intersections change for all
    setup = DriverSetup(unaffected, spread=0.0, misjudgement=0.6)
    sight = DriverSight(0.1)
    road = Road(setup, 30.0, sight=sight)
    speeds = [float(v.speed) for v in road.others]
    road.drive(0.2)
    # IDM's wanted headway is 1.5 s, its gap at a standstill 10 m; at night the outline is seen up to some 14 m.
    outline = leader_reach(sight, 30.0).by_body
    assert outline == pytest.approx(14.0, abs=3.0)
    kept = [max((1.5 * v + 10.0) / 1.6, outline) for v in speeds]
    wanted = [(gap - 10.0) / v for gap, v in zip(kept, speeds, strict=True)]
    assert [v.TIME_WANTED for v in road.others] == pytest.approx(wanted, rel=0.01)
    assert max(wanted) < 1.0
    road.traffic.enter_fog(even(math.inf))
    assert [v.TIME_WANTED for v in road.drive(1.5).others] == pytest.approx([1.5] * len(road.others))
    assert road.environment.vehicle.TIME_WANTED == 1.5


@pytest.mark.parametrize(("kind", "stays"), [("in_sight", True), ("out_of_sight", False)])
def test_fog_parts_drivers_behind_a_fast_leader(kind: str, stays: bool) -> None:
    """Broughton, Switzer & Scott 2007; the leader is the ego, which drives 22.4 m/s in fog of 40 m."""
    sight = DriverSight(DAY)
    road = Road(DriverSetup(spread=0.0, following={kind: 1.0}), 40.0, sight=sight)
    ego, follower = road.environment.vehicle, road.others[0]
    follower.position = ego.position - np.array([35.0, 0.0])
    follower.heading, follower.lane_index, follower.target_lane_index = ego.heading, ego.lane_index, ego.lane_index
    # A car and its IDM; the others are out of the way.
    road.environment.road.vehicles[:] = [ego, follower]
    for vehicle in (ego, follower):
        vehicle.speed = vehicle.target_speed = 22.4
        vehicle.enable_lane_change = False
    follower.target_speed = FAST
    road.drive(30.0, Command(SpeedAdvice(22.4)))
    gap = float(ego.position[0] - follower.position[0]) - 5.0
    assert (gap < leader_reach(sight, 40.0).farthest) == stays
    # IDM wants 1.5 s in clear air.
    assert (follower.TIME_WANTED < 1.5) == stays
