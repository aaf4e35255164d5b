"""Post-encroachment times of vehicles whose ways cross: figures by hand."""

import dataclasses
import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest

from fogsim.metrics.crossing import TrafficEncroachment
from fogsim.metrics.crossing.tracks import crossing_pieces
from fogsim.metrics.metric import JsonValue
from fogsim.values import TrafficState
from tests.metrics.roads import lanes, watched

MINIMUM = "traffic_minimum_post_encroachment_time_s"
BELOW_5 = "traffic_post_encroachments_below_5_s_per_vehicle_km"
BELOW_1 = "traffic_post_encroachments_below_1_s_per_vehicle_km"
SPEED = 10.0
WIDTH, LENGTH = 1.8, 5.0

Course = Callable[[float], tuple[float, float]]
"""Place of the front from the middle of the junction [m] and speed [m/s], over time [s]."""


def evenly(at: float, speed: float = SPEED) -> Course:
    """The front is in the middle at that time."""
    return lambda time: (speed * (time - at), speed)


def stands(place: float, since: float, until: float) -> Course:
    """Drives at 10 m/s but for a while in which the front stands at a place."""

    def course(time: float) -> tuple[float, float]:
        if since < time < until:
            return place, 0.0
        return place + SPEED * (time - (since if time <= since else until)), SPEED

    return course


@dataclasses.dataclass(frozen=True)
class Driver:
    """One who drives through the junction J, 10 m to either side of its middle, at a heading, perhaps to its left."""

    course: Course
    heading: float = 0.0
    aside: Callable[[float], float] = lambda _: 0.0
    ways: tuple[str, str, str] = ("W_0", ":J_0_0", "E_0")
    until: float = math.inf

    def at(self, time: float) -> tuple[float, float, float, str]:
        """East, north, speed, lane."""
        along, speed = self.course(time)
        lane = self.ways[0] if along < -10.0 else self.ways[1] if along <= 10.0 else self.ways[2]
        cosine, sine, aside = math.cos(self.heading), math.sin(self.heading), self.aside(along)
        return along * cosine - aside * sine, along * sine + aside * cosine, speed, lane


NORTHWARDS = ("S_0", ":J_1_0", "N_0")


def road(time: float, drivers: dict[str, Driver]) -> TrafficState:
    there = {name: driver for name, driver in drivers.items() if time < driver.until}
    x, y, speed, lane = zip(*(driver.at(time) for driver in there.values()), strict=True)
    return dataclasses.replace(
        lanes(*((name, 0.0, v) for name, v in zip(lane, speed, strict=True))),
        ids=tuple(there),
        position=np.stack((x, y, np.zeros(len(x))), axis=1),
        heading=np.array([driver.heading for driver in there.values()]),
    )


def measured(step: float = 0.1, duration: float = 12.0, **drivers: Driver) -> dict[str, JsonValue]:
    """What the metric says, in spans of two steps."""
    times = step * np.arange(round(duration / step) + 1)
    roads = [(0.0 if not i else step, road(float(time), drivers)) for i, time in enumerate(times)]
    return dict(watched(TrafficEncroachment(), roads))


def times_on_area(first: float, second: float, angle: float, speeds: tuple[float, float]) -> float:
    """Least time between, over points 2 cm apart that both bodies sweep; their fronts are in the middle then."""
    u, v = np.array([1.0, 0.0]), np.array([math.cos(angle), math.sin(angle)])
    grid = np.array(list(itertools.product(np.linspace(-6.0, 6.0, 601), repeat=2)))
    beside_u, beside_v = grid[:, 1], grid @ np.array([-v[1], v[0]])
    both = grid[(np.abs(beside_u) <= WIDTH / 2) & (np.abs(beside_v) <= WIDTH / 2)]
    left = first + (LENGTH + both @ u) / speeds[0]
    came = second + both @ v / speeds[1]
    return float((came - left).min())


@pytest.mark.parametrize("degrees", [30.0, -145.0])
def test_time_between_two_that_cross_aslant(degrees: float) -> None:
    angle = math.radians(degrees)
    found = measured(a=Driver(evenly(3.0)), b=Driver(evenly(6.5, 7.0), angle, ways=NORTHWARDS))
    assert found[MINIMUM] == pytest.approx(times_on_area(3.0, 6.5, angle, (SPEED, 7.0)), abs=0.015)


@pytest.mark.parametrize("step", [0.1, 0.5, 1.0])
def test_steps_are_interpolated(step: float) -> None:
    found = measured(step, a=Driver(evenly(3.13)), b=Driver(evenly(4.79), math.pi / 2, ways=NORTHWARDS))
    assert found[MINIMUM] == pytest.approx(1.66 - 0.68)
    assert found[BELOW_1] == found[BELOW_5]


def test_others_do_not_cross() -> None:
    for other in [
        Driver(evenly(4.0), aside=lambda _: 3.5, ways=("W_1", ":J_0_1", "E_1")),
        Driver(evenly(4.0), math.radians(15.0), ways=("W_1", ":J_0_1", "E_1")),
        Driver(evenly(4.0), math.pi, ways=("E_0", ":J_1_0", "W_0")),
        Driver(evenly(4.0), math.pi / 2, ways=("S_0", ":J_1_0", "E_0")),
        Driver(evenly(4.0), math.pi / 2, ways=("W_0", ":J_1_0", "N_0")),
        Driver(evenly(4.0), math.pi / 2, ways=("S_0", ":K_1_0", "N_0")),
        Driver(evenly(4.0), math.pi / 2, ways=("S_0", "S_0", "N_0")),
        Driver(evenly(19.0), math.pi / 2, ways=NORTHWARDS),
    ]:
        found = measured(duration=25.0, a=Driver(evenly(3.0)), b=other)
        assert found == {MINIMUM: None, BELOW_5: 0.0, BELOW_1: 0.0}


def test_one_who_stands_on_the_crossing_leaves_it_when_it_drives_on() -> None:
    """The front stands 4 m beyond the middle, for longer than passers are remembered."""
    found = measured(
        duration=25.0,
        a=Driver(stands(4.0, 3.0, 17.0)),
        b=Driver(evenly(19.0), math.pi / 2, ways=NORTHWARDS),
        later=Driver(evenly(30.0), math.pi / 2, ways=NORTHWARDS),
    )
    assert found[MINIMUM] == pytest.approx(19.0 - 0.09 - (17.0 + 0.19))


def test_who_comes_while_another_is_there_has_no_time() -> None:
    found = measured(a=Driver(stands(2.0, 3.0, 9.0)), b=Driver(evenly(6.0), math.pi / 2, ways=NORTHWARDS))
    assert found[MINIMUM] == 0.0
    assert found[BELOW_1] == found[BELOW_5] > 0.0


def test_who_is_taken_away_is_gone() -> None:
    found = measured(a=Driver(stands(2.0, 3.0, 20.0), until=4.25), b=Driver(evenly(6.0), math.pi / 2, ways=NORTHWARDS))
    assert found[MINIMUM] == pytest.approx(6.0 - 0.09 - 4.2)


def test_each_pair_counts_once_with_its_least_time() -> None:
    """The second, which is faster, comes from the right to the left and back, and crosses the first one's way twice."""
    swerving = Driver(evenly(5.0, 20.0), aside=lambda along: 3.0 - abs(along), ways=("W_1", ":J_0_1", "E_1"))
    found = measured(a=Driver(evenly(3.0)), b=swerving)
    least = times_on_area(3.3, 5.15, math.radians(-45.0), (SPEED, 20.0 * math.sqrt(2.0)))
    assert found[MINIMUM] == pytest.approx(least, abs=0.015)
    assert found[BELOW_5] == pytest.approx(1 / (0.12 + 0.24))


def test_pairs_are_found_across_the_borders_of_what_is_compared_at_once() -> None:
    """Every 10 s all who were there are compared.

    The first one's rear is gone 5 + 0.9 m after the middle, the second comes 0.9 m before it.
    """
    for first in (8.1, 8.6, 9.1, 9.6, 10.1):
        a, b = Driver(evenly(first)), Driver(evenly(first + 2.0), math.pi / 2, ways=NORTHWARDS)
        found = measured(duration=25.0, a=a, b=b)
        assert found[MINIMUM] == pytest.approx(2.0 - 0.68)
        assert found[BELOW_5] == pytest.approx(1 / (2 * 0.25))
        assert found[BELOW_1] == 0.0


def test_who_is_put_elsewhere_crosses_nothing() -> None:
    def put(time: float) -> tuple[float, float]:
        return (-9.0, SPEED) if time < 4.0 else (9.0, SPEED)

    found = measured(a=Driver(evenly(3.0)), b=Driver(put, math.pi / 2, ways=NORTHWARDS))
    assert found[MINIMUM] is None


def test_what_is_said_does_not_change_by_being_asked_again() -> None:
    metric = TrafficEncroachment()
    watched(metric, [(0.0, road(3.0, {"a": Driver(evenly(3.0))}))])
    assert metric.result() == {MINIMUM: None, BELOW_5: None, BELOW_1: None}
    drivers = {"a": Driver(evenly(3.0)), "b": Driver(evenly(5.0), math.pi / 2, ways=NORTHWARDS)}
    first = watched(metric, [(0.5, road(0.5 * i, drivers)) for i in range(24)])
    assert metric.result() == first
    assert first[MINIMUM] == pytest.approx(1.32)


def test_all_of_many_pieces_that_cross_are_found() -> None:
    """A grid of 12 by 12 lines of 13 m with 1 m between them; half of them lie in another junction."""
    at = np.arange(1.0, 13.0)
    begin = np.concatenate((np.stack((0 * at, at), axis=1), np.stack((at, 0 * at), axis=1)))
    way = np.repeat([[13.0, 0.0], [0.0, 13.0]], 12, axis=0)
    begin, way = np.concatenate((begin, begin)), np.concatenate((way, way))
    junction = np.repeat([3, 4], 24)
    found = crossing_pieces(begin, way, junction, np.arange(48), 0.3)
    expected = {(24 * k + i, 24 * k + 12 + j) for k in range(2) for i in range(12) for j in range(12)}
    assert {(int(i), int(j)) for i, j, _, _ in found} == expected
    assert len(found) == 288
    assert (begin + found[0, 2] * way)[int(found[0, 0])] == pytest.approx((begin + found[0, 3] * way)[int(found[0, 1])])
