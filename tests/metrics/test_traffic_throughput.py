"""Vehicles that pass cross sections of a road: figures by hand."""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from fogsim.metrics.traffic_span import TrafficGathering
from fogsim.metrics.traffic_throughput import TrafficThroughput
from fogsim.values import TrafficState, TrafficStep
from tests.metrics.roads import lanes
from tests.recorders.synthetic import make_step, make_traffic_step

FLOW = "traffic_flow_vehicles_per_h"
ROAD = np.array([[0.0, 0.0, 0.0], [1000.0, 0.0, 0.0]])
"""Its sections lie at 125, 375, 625 and 875 m."""

Place = tuple[float, float]


def traffic(places: Mapping[str, Place]) -> TrafficState:
    position = np.array([(x, y, 0.0) for x, y in places.values()]).reshape(-1, 3)
    return dataclasses.replace(lanes(*(("a_0", 0.0, 20.0) for _ in places)), ids=tuple(places), position=position)


def on_road(step: TrafficStep, places: Mapping[str, Place], road: NDArray[np.float64] | None) -> TrafficStep:
    return dataclasses.replace(step, traffic=traffic(places), truth=dataclasses.replace(step.truth, route=road))


def flow(steps: Iterable[TrafficStep], elapsed: float, together: int = 3) -> object:
    """What the metric says of steps that are so far apart [s], of so many at once."""
    gathering, metric = TrafficGathering(), TrafficThroughput()
    for number, step in enumerate(steps):
        gathering.add(step, elapsed if number else 0.0)
        if number % together == 0 and (span := gathering.take()) is not None:
            metric.add(span)
    if (span := gathering.take()) is not None:
        metric.add(span)
    return metric.result()[FLOW]


def alone(places: Sequence[Mapping[str, Place]], road: NDArray[np.float64] | None = ROAD) -> list[TrafficStep]:
    return [on_road(make_traffic_step(i), there, road) for i, there in enumerate(places)]


def test_who_drives_along_the_road_passes_its_sections() -> None:
    """In 20 s one passes 125 and 375 m; the others drive the other way, on another road, or across."""
    for together in [1, 5]:
        for elapsed in [0.1, 1.0, 4.0, 20.0]:
            times = elapsed * np.arange(round(20.0 / elapsed) + 1)
            places = [
                {
                    "along": (100.0 + 20.0 * t, 3.0),
                    "back": (500.0 - 20.0 * t, 3.0),
                    "beside": (100.0 + 20.0 * t, 25.0),
                    "across": (360.0 + 1.0 * t, -30.0 + 3.0 * t),
                }
                for t in times.tolist()
            ]
            assert flow(alone(places), elapsed, together) == pytest.approx(3600.0 * 2 / (4 * 20.0))


def test_sections_lie_along_a_road_that_bends() -> None:
    """One drives round the bend, and passes its four sections; another goes straight on after it, and two."""
    road = np.array([[0.0, 0.0, 0.0], [500.0, 0.0, 0.0], [500.0, 500.0, 0.0]])
    ways = np.arange(0.0, 1001.0, 50.0).tolist()
    places = [{"round": (min(way, 500.0), max(way - 500.0, 0.0)), "on": (way, 0.0)} for way in ways]
    assert flow(alone(places, road), 2.0) == pytest.approx(3600.0 * 6 / (4 * 40.0))


def test_who_is_seen_on_either_side_only_was_put_there() -> None:
    places = [{"a": (100.0, 0.0)}, {"a": (120.0, 0.0)}, {}, {"a": (140.0, 0.0)}, {"a": (160.0, 0.0), "b": (130.0, 0.0)}]
    assert flow(alone(places), 1.0) == 0.0


def test_an_egos_sections_count_while_they_are_read() -> None:
    """Of 280 m all but a second's 80: 125 m until the ego is at 320 m (16 s), 375 m from 180 m on (12 s).

    One ahead passes both, one far ahead the second one too early, and one behind the first; the ego does not count.
    """
    ego_at = 20.0 * np.arange(21)
    ahead = {"near": 100.0, "ego": 0.0, "far": 300.0, "behind": -150.0}
    steps = [
        on_road(
            dataclasses.replace(make_step(i), reading_radius=280.0), {k: (at + v, 0.0) for k, v in ahead.items()}, ROAD
        )
        for i, at in enumerate(ego_at.tolist())
    ]
    assert flow(steps, 1.0) == pytest.approx(3600.0 * 3 / 28.0)


def test_without_a_road_or_time_nothing_is_said() -> None:
    assert flow(alone([{"a": (100.0, 0.0)}, {"a": (140.0, 0.0)}], None), 1.0) is None
    assert flow(alone([{}]), 1.0) is None
    assert flow(alone([{}, {}]), 1.0) == 0.0
