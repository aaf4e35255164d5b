"""Vehicles on straight lanes, and what metrics make of them."""

import dataclasses
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from fogsim.metrics.metric import JsonValue
from fogsim.metrics.traffic_span import TrafficGathering, TrafficMetric
from fogsim.values import Cohort, Collision, TrafficState
from tests.recorders.synthetic import make_step


def lanes(*vehicles: tuple[str, float, float], heading: float = 0.0) -> TrafficState:
    """Vehicles of 5 m by lane, place of the front bumper along the road [m], and speed [m/s]."""
    n = len(vehicles)
    along = np.array([v[1] for v in vehicles], dtype=np.float64)
    return TrafficState(
        time=0.0,
        ids=tuple(f"v{i}" for i in range(n)),
        types=("car",) * n,
        position=np.stack((along * np.cos(heading), along * np.sin(heading), np.zeros(n)), axis=-1),
        heading=np.full(n, heading),
        speed=np.array([v[2] for v in vehicles], dtype=np.float64),
        acceleration=np.zeros(n),
        length=np.full(n, 5.0),
        width=np.full(n, 1.8),
        height=np.full(n, 1.5),
        lane=tuple(v[0] for v in vehicles),
        lamps=np.zeros(n, np.int32),
        paint=np.full((n, 3), 0.5),
    )


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
            assert span is not None
            metric.add(span)
    assert gathering.take() is None
    return metric.result()
