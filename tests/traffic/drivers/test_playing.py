"""Actions that have begun: speeds on the way, stopping at a place, following, lamps; no simulation runs."""

import math

import numpy as np
import pytest

from fogsim.traffic.drivers.playing import Lamps, Motion, Playing, speed_on_the_way
from fogsim.values import Lamp, TrafficState
from fogsim.values.light import ALL_LAMPS, Side, burning, dark_on
from fogsim.values.script import ChangeLane, ChangeSpeed, Follow, SetLamps, Shape, Stop
from tests.helpers.vehicles import vehicles

STEP = 0.1


class Road:
    """Vehicles on one lane, who do exactly what they are told, and drive on when they are free."""

    def __init__(self, **speeds: float) -> None:
        self.speeds = dict(speeds)
        self.driven = dict.fromkeys(speeds, 0.0)
        self.gap = 100.0
        self.time = 0.0
        self.lamps = Lamps()
        self.playing = Playing(self.lamps)

    @property
    def motion(self) -> Motion:
        return Motion(
            self.time, STEP, set(self.speeds), self.driven.__getitem__, self.speeds.__getitem__, lambda *_: self.gap
        )

    def step(self) -> dict[str, float]:
        told = self.playing.speeds(self.motion)
        self.speeds.update({vehicle: speed for vehicle, speed in told.items() if math.isfinite(speed)})
        for vehicle, speed in self.speeds.items():
            self.driven[vehicle] += speed * STEP
        self.gap += (self.speeds.get("b", 0.0) - self.speeds["a"]) * STEP
        self.time += STEP
        return told


@pytest.mark.parametrize(("shape", "halfway", "steepest"), [("linear", 20.0, 5.0), ("sinusoidal", 20.0, 7.8540)])
def test_a_speed_goes_over_in_its_time_and_shape(shape: str, halfway: float, steepest: float) -> None:
    """Half a cosine is steepest in its middle: π/2 times as steep as the straight line."""
    change = ChangeSpeed("a", 30.0, 4.0, Shape(shape))
    assert speed_on_the_way(change, 10.0, 0.0) == pytest.approx(10.0)
    assert speed_on_the_way(change, 10.0, 2.0) == pytest.approx(halfway)
    assert speed_on_the_way(change, 10.0, 4.0) == speed_on_the_way(change, 10.0, 99.0) == pytest.approx(30.0)
    slope = (speed_on_the_way(change, 10.0, 2.001) - speed_on_the_way(change, 10.0, 1.999)) / 0.002
    assert slope == pytest.approx(steepest, rel=1e-4)


def test_a_held_speed_ends_with_a_driver_who_is_free() -> None:
    road = Road(a=20.0)
    road.playing.begin(ChangeSpeed("a", 10.0, 1.0, hold=2.0), road.motion)
    told = [road.step().get("a") for _ in range(22)]
    assert told[9] == pytest.approx(10.0)
    assert told[10:20] == pytest.approx([10.0] * 10)
    assert told[20:] == [math.inf, None]
    assert road.playing.is_idle
    for speed in (12.0, 25.0):
        road.playing.begin(ChangeSpeed("a", speed), road.motion)
    assert road.step() == {"a": 25.0}  # of two actions the last one counts


@pytest.mark.parametrize("speed", [13.0, 30.0])
def test_a_vehicle_stops_where_it_is_told_and_drives_on(speed: float) -> None:
    road = Road(a=speed)
    road.playing.begin(Stop("a", 200.0, 3.0, stand=4.0), road.motion)
    speeds = []
    while not road.playing.is_idle and road.time < 120.0:
        road.step()
        speeds.append(road.speeds["a"])
    assert road.driven["a"] == pytest.approx(200.0, abs=1.0)
    assert road.driven["a"] <= 200.0
    assert np.diff([speed, *speeds]).min() >= -3.0 * STEP - 1e-9
    standing = np.flatnonzero(np.array(speeds) < 0.1)
    assert len(standing) * STEP == pytest.approx(4.0, abs=0.3)


def test_a_follower_comes_to_its_headway_and_keeps_it() -> None:
    road = Road(a=30.0, b=25.0)
    road.playing.begin(Follow("a", "b", 1.2, hold=80.0), road.motion)
    for _ in range(700):
        road.step()
    assert road.gap == pytest.approx(1.2 * 25.0 + 2.0, abs=0.05)
    assert road.speeds["a"] == pytest.approx(25.0, abs=0.02)
    del road.speeds["b"]
    assert road.step() == {"a": math.inf}  # nobody is left to be followed


def state_of(*lamps: Lamp) -> TrafficState:
    return vehicles(np.zeros(len(lamps)), ids=tuple("abc"[: len(lamps)]), lamps=[int(lamp) for lamp in lamps])


def test_lamps_are_lit_dark_failed_and_the_vehicles_own_again() -> None:
    lamps, own = Lamps(), Lamp.POSITION | Lamp.LOW_BEAM | Lamp.STOP

    def shown() -> Lamp:
        state = lamps.shown(state_of(own, own), 0.0)
        assert Lamp(int(state.lamps[1])) == own  # the other's stay
        return Lamp(int(state.lamps[0]))

    lamps.switch(SetLamps("a", lit=Lamp.REAR_FOG, dark=Lamp.LOW_BEAM, failed=Lamp.STOP))
    assert shown() == Lamp.POSITION | Lamp.REAR_FOG
    lamps.switch(SetLamps("a", lit=Lamp.LOW_BEAM | Lamp.STOP, automatic=Lamp.REAR_FOG))
    assert shown() == Lamp.POSITION | Lamp.LOW_BEAM  # what has failed cannot be lit
    assert not lamps.dark
    lamps.switch(SetLamps("a", failed=ALL_LAMPS))
    assert shown() == Lamp.NONE
    assert lamps.dark == {"a"}


def test_single_lamps_fail_side_by_side() -> None:
    lamps, own = Lamps(), Lamp.POSITION | Lamp.LOW_BEAM | Lamp.STOP

    def shown(lit: Lamp = own) -> int:
        return int(lamps.shown(state_of(lit), 0.0).lamps[0])

    lamps.switch(SetLamps("a", failed=Lamp.POSITION, side=Side.LEFT))
    assert shown() == int(own) | dark_on(int(Lamp.POSITION), Side.LEFT)
    assert [burning(shown(), side) for side in Side] == [int(own ^ Lamp.POSITION), int(own), int(Lamp.STOP)]
    lamps.switch(SetLamps("a", lit=Lamp.REAR_FOG, side=Side.RIGHT))
    assert shown() & int(Lamp.REAR_FOG)
    assert not burning(shown(), Side.LEFT) & Lamp.REAR_FOG
    lamps.switch(SetLamps("a", failed=Lamp.POSITION, side=Side.RIGHT))
    assert not shown() & int(Lamp.POSITION)  # with both, the kind is dark as if it had failed as a whole
    assert shown(Lamp.STOP) & int(Lamp.STOP)
    lamps.switch(SetLamps("a", failed=ALL_LAMPS))
    assert shown() == 0


def test_who_indicates_before_a_change_of_lane_does_until_it_is_over() -> None:
    road, change = Road(a=20.0), ChangeLane("a", -1, duration=2.0, indicator=1.0)
    road.playing.begin(change, road.motion)
    made = []
    for _ in range(12):
        made += [(round(road.time, 3), one) for one in road.playing.changes(road.motion)]
        road.step()
    assert made == [(1.0, change)]
    lit = [Lamp(int(road.lamps.shown(state_of(Lamp.POSITION), time).lamps[0])) for time in (0.0, 2.9, 3.0)]
    assert lit == [Lamp.POSITION | Lamp.INDICATOR_RIGHT, Lamp.POSITION | Lamp.INDICATOR_RIGHT, Lamp.POSITION]
