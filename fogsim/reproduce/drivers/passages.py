"""Passages at a cross-section, and what traffic studies measure of them."""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.kinematics import DECELERATION, REACTION_TIME, safe_speed
from fogsim.units import KMH_PER_MPS

_FREE_ABOVE = 5.0
"""Time headway above which a vehicle is free, and below which it follows [s]."""

THINKING_TIME, BRAKING = 0.67, 6.57
"""Reaction time [s] and deceleration [m/s²] of the Highway Code's stopping distances (50 mph: 15 + 38 m).

By these the Transport and Road Research Laboratory judged what it saw on the M4 (Commercial Motor, 10 December 1976).
"""


class Passages(NamedTuple):
    """Vehicles (n,) at a cross-section in the order in which they came, but for each lane's first."""

    speed: NDArray[np.float64]  # [m/s]
    leader_speed: NDArray[np.float64]  # [m/s]
    headway: NDArray[np.float64]  # between their fronts [s]
    gap: NDArray[np.float64]  # [m]


def passages(events: Iterable[Mapping[str, str]], since: float) -> Passages:
    """Vehicles by the events of SUMO's instantaneous loops from a time on [s]."""
    rows: list[tuple[float, float, float, float]] = []
    before: dict[str, tuple[float, float]] = {}
    left: dict[str, float] = {}
    for event in events:
        lane, time, speed = event["id"], float(event["time"]), float(event["speed"])
        if event["state"] == "leave":
            left[lane] = time
        elif event["state"] == "enter":
            if lane in before and lane in left and time > since:
                entered, leader_speed = before[lane]
                rows.append((speed, leader_speed, time - entered, speed * (time - left[lane])))
            before[lane] = (time, speed)
            left.pop(lane, None)
    return Passages(*np.array(rows, np.float64).reshape(-1, 4).T)


class Measures(NamedTuple):
    """What is measured at one cross-section in one run; NaN where nothing was there to be measured."""

    flow: float  # on both lanes [1/h]
    free_speed: float  # [km/h]
    free_speed_sd: float  # [km/h]
    mean_speed: float  # [km/h]
    speed_sd: float  # [km/h]
    overdriving: float  # share that cannot stop within V_met, by the Highway Code [-]
    overdriving_aashto: float  # by 2.5 s and 3.4 m/s² (AASHTO) [-]
    headway_15: float  # percentile [s]
    headway_below_1: float  # share [-]
    headway_below_2: float  # share [-]
    following_headway: float  # mean [s]
    following_distance: float  # mean [m]
    speed_difference: float  # mean absolute, of those who follow [m/s]
    ttc_15: float  # percentile of those who follow and come closer [s]
    ttc_50: float  # [s]
    ttc_below_10: float  # share of those who follow [-]


def measured(seen: Passages, visibility: float, seconds: float) -> Measures:
    """Measures of the vehicles that passed in fog of a visibility [m] within some seconds."""
    follows = seen.headway < _FREE_ABOVE
    free, closing = seen.speed[~follows], (seen.speed - seen.leader_speed)[follows]
    gap = seen.gap[follows]
    ttc = gap[closing > 0.0] / closing[closing > 0.0]
    return Measures(
        flow=len(seen.speed) / seconds * 3600.0,
        free_speed=_mean(free) * KMH_PER_MPS,
        free_speed_sd=_deviation(free) * KMH_PER_MPS,
        mean_speed=_mean(seen.speed) * KMH_PER_MPS,
        speed_sd=_deviation(seen.speed) * KMH_PER_MPS,
        overdriving=_mean(seen.speed > safe_speed(visibility, THINKING_TIME, BRAKING)),
        overdriving_aashto=_mean(seen.speed > safe_speed(visibility, REACTION_TIME, DECELERATION)),
        headway_15=_percentile(seen.headway, 15.0),
        headway_below_1=_mean(seen.headway < 1.0),
        headway_below_2=_mean(seen.headway < 2.0),
        following_headway=_mean(seen.headway[follows]),
        following_distance=_mean(gap),
        speed_difference=_mean(np.abs(closing)),
        ttc_15=_percentile(ttc, 15.0),
        ttc_50=_percentile(ttc, 50.0),
        ttc_below_10=float(np.sum(ttc < 10.0) / len(gap)) if len(gap) else np.nan,
    )


def _mean(values: NDArray[np.float64] | NDArray[np.bool_]) -> float:
    return float(np.mean(values)) if values.size else np.nan


def _deviation(values: NDArray[np.float64]) -> float:
    return float(np.std(values, ddof=1)) if values.size > 1 else np.nan


def _percentile(values: NDArray[np.float64], share: float) -> float:
    return float(np.percentile(values, share)) if values.size else np.nan
