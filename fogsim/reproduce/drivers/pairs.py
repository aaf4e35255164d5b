"""Drivers who follow one leader each, as in simulators, and whether they keep it in sight."""

import math
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.reproduce.drivers.road import passed
from fogsim.traffic import BrakeEvent, Trigger

_APART, _BEHIND = 120.0, 3.0
"""Time from one leader to the next, and from a leader to its follower, as they enter [s]."""


class PairMeasures(NamedTuple):
    """What is measured of followers; NaN where nothing was there to be measured."""

    out_of_sight: float  # share with a gap longer than V_met [-]
    headway: float  # median [s]
    headway_in_sight: float  # mean where the gap is at most V_met [s]


def follow(overrides: tuple[str, ...], leader_speed: float, visibility: float, seed: int, count: int) -> PairMeasures:
    """Measure drivers behind leaders of a given speed [m/s] after 2.5 km in fog of a visibility [m]."""
    rows = "".join(
        f'<vehicle id="leader{i}" type="car" route="r" depart="{_APART * (i + 1)}" departSpeed="{leader_speed}"/>'
        f'<vehicle id="behind{i}" type="car" route="r" depart="{_APART * (i + 1) + _BEHIND}" departSpeed="max"/>'
        for i in range(count)
    )
    demand = f'<vType id="car" vClass="passenger" tau="1.2" speedFactor="normc(1,0.1,0.7,1.3)"/>{rows}'
    events = tuple(BrakeEvent(f"leader{i}", Trigger(at_position=0.0), to_speed=leader_speed) for i in range(count))
    seen = passed(overrides, 1, demand, visibility, seed, _APART * (count + 4), events=events)
    return measured_pairs(seen, visibility)


def measured_pairs(events: Iterable[Mapping[str, str]], visibility: float) -> PairMeasures:
    """Measure followers (``behind…``) and leaders (``leader…``) by the events of loops."""
    left: dict[str, float] = {}
    rows: list[tuple[float, float]] = []
    for event in events:
        name, time = event["vehID"], float(event["time"])
        if event["state"] == "leave":
            left[name] = time
        leader = name.replace("behind", "leader")
        if event["state"] == "enter" and leader != name and leader in left:
            rows.append((time - left[leader], (time - left[leader]) * float(event["speed"])))
    headway, gap = np.array(rows, np.float64).reshape(-1, 2).T
    in_sight: NDArray[np.bool_] = gap <= visibility
    return PairMeasures(
        out_of_sight=float(np.mean(~in_sight)) if len(gap) else math.nan,
        headway=float(np.median(headway)) if len(gap) else math.nan,
        headway_in_sight=float(np.mean(headway[in_sight])) if in_sight.any() else math.nan,
    )
