"""Who hears advice, where, and for how long."""

import math
from collections.abc import Collection

import pytest

from fogsim.traffic.drivers.advice_hearing import AdviceHearing
from fogsim.values import Command, Display, SpeedAdvice, Stretch, StretchAdvice

SPEED = 30.0
HERE = Stretch(1000.0, 2000.0)


class Road:
    """A road on which vehicles are put by hand; the ego drives at 0 m."""

    def __init__(self, **positions: float) -> None:
        self.positions = positions

    def on_stretch(self, stretch: Stretch, among: Collection[str] | None = None) -> dict[str, float]:
        inside = {v: x - stretch.start for v, x in self.positions.items() if stretch.start <= x < stretch.end}
        return {v: past for v, past in inside.items() if among is None or v in among}

    def near_ego(self, distance: float, among: Collection[str] | None = None) -> list[str]:
        return [v for v, x in self.positions.items() if x <= distance and (among is None or v in among)]

    def speed(self, vehicle: str) -> float:  # noqa: ARG002 - all drive the same
        return SPEED


def drive(road: Road, hearing: AdviceHearing, *speeds: float, display: Display) -> list[dict[str, float]]:
    """What is heard second by second, while everybody drives on and these speeds are shown; nan for nothing."""
    heard = []
    for speed in speeds:
        told = () if math.isnan(speed) else (StretchAdvice(speed, HERE, display),)
        heard.append(hearing.listen(Command(stretches=told), 1.0).get(display, {}))
        road.positions = {v: x + SPEED for v, x in road.positions.items()}
    return heard


def test_in_the_car_advice_is_heard_wherever_on_the_stretch_one_is_as_long_as_it_is_in_force() -> None:
    road = Road(ahead=980.0, on=1500.0, leaving=1980.0, beyond=2500.0)
    heard = drive(road, AdviceHearing(road), 20.0, 15.0, math.nan, display=Display.IN_CAR)
    assert heard == [{"on": 20.0, "leaving": 20.0}, {"ahead": 15.0, "on": 15.0}, {}]


def test_a_sign_is_read_where_the_stretch_begins_and_kept_in_mind_to_its_end() -> None:
    road = Road(first=980.0, second=950.0, on=1500.0)
    hearing = AdviceHearing(road)
    heard = drive(road, hearing, 20.0, 20.0, 15.0, math.nan, display=Display.MESSAGE_SIGN)
    # The one who was past the sign has not read it; what it shows later is read by those who come later.
    assert heard == [{}, {"first": 20.0}, {"first": 20.0, "second": 15.0}, {"first": 20.0, "second": 15.0}]
    road.positions["first"] = 2001.0
    assert hearing.listen(Command(), 1.0) == {Display.MESSAGE_SIGN: {"second": 15.0}}
    road.positions["second"] = 2001.0
    assert hearing.listen(Command(), 1.0) == {}
    road = Road(first=980.0)
    hearing = AdviceHearing(road)
    drive(road, hearing, 20.0, display=Display.MESSAGE_SIGN)
    road.positions["ramp"] = 1600.0  # who comes from a ramp has not passed the sign
    assert drive(road, hearing, 20.0, display=Display.MESSAGE_SIGN) == [{"first": 20.0}]


@pytest.mark.parametrize("display", Display)
def test_who_enters_the_road_on_the_stretch_hears_what_is_in_force(display: Display) -> None:
    road = Road(new=1500.0, elsewhere=2500.0, old=1400.0)
    hearing = AdviceHearing(road)
    command = Command(stretches=(StretchAdvice(20.0, HERE, display),))
    assert hearing.enter(command, ["new", "elsewhere"]) == {display: {"new": 20.0}}
    assert hearing.listen(command, 0.0)[display]["new"] == 20.0
    road.positions["new"] = 2100.0
    assert "new" not in hearing.listen(command, 1.0).get(display, {})


def test_the_egos_advice_is_passed_on_as_far_as_it_reaches() -> None:
    road = Road(near=200.0, far=400.0, new=100.0)
    hearing = AdviceHearing(road)
    command = Command(SpeedAdvice(20.0), advice_reach=300.0)
    assert hearing.enter(command, ["new"]) == {Display.IN_CAR: {"new": 20.0}}
    assert hearing.listen(command, 1.0) == {Display.IN_CAR: {"near": 20.0, "new": 20.0}}
    assert hearing.listen(Command(SpeedAdvice(20.0)), 1.0) == {}


def test_the_lowest_advice_counts_and_none_is_none() -> None:
    road = Road(one=1500.0, other=1500.0)
    stretches = (StretchAdvice(25.0, HERE), StretchAdvice(22.0, HERE), StretchAdvice(math.inf, HERE))
    command = Command(advised_speeds={"one": 18.0, "nobody": math.inf}, stretches=stretches, advice_reach=9000.0)
    hearing = AdviceHearing(road)
    heard = {Display.IN_CAR: {"one": 18.0, "other": 22.0}}
    assert hearing.listen(command, 1.0) == hearing.enter(command, ["one", "other"]) == heard
