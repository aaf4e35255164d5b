"""Vehicles on straight lanes, and what metrics make of them."""

import dataclasses
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from fogsim.metrics.metric import JsonValue
from fogsim.metrics.traffic_span import TrafficGathering, TrafficMetric
from fogsim.values import Cohort, Collision, TrafficState
from tests.helpers.vehicles import vehicles
from tests.recorders.synthetic import make_step


def lanes(*cars: tuple[str, float, float], heading: float = 0.0) -> TrafficState:
    """Vehicles of 5 m by lane, place of the front bumper along the road [m], and speed [m/s]."""
    lane, along, speed = zip(*cars, strict=True) if cars else ((), (), ())
    places = np.outer(along, (np.cos(heading), np.sin(heading), 0.0))
    return vehicles(places, heading=heading, speed=speed, size=(5.0, 1.8, 1.5), lane=lane)


def watched(
    metric: TrafficMetric,
    roads: Iterable[tuple[float, TrafficState]],
    extinctions: NDArray[np.float64] | None = None,
    collisions: tuple[Collision, ...] = (),
    cohort: Cohort | None = None,
) -> Mapping[str, JsonValue]:
    """What a metric says of states that each held for a time [s], with collisions in the last; in spans of two."""
    roads, gathering = list(roads), TrafficGathering()
    for number, (elapsed, road) in enumerate(roads):
        step = make_step(number, collisions=collisions if number == len(roads) - 1 else ())
        truth = dataclasses.replace(step.truth, vehicle_extinctions=extinctions)
        gathering.add(dataclasses.replace(step, traffic=road, truth=truth, cohort=cohort), elapsed)
        if number % 2 or number == len(roads) - 1:
            span = gathering.take()
            metric.add(span)
    assert gathering.take() is None
    return metric.result()
