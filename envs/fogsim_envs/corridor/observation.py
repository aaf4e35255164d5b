"""What is known at a message sign: its loops, its visibility meter, and what it and its neighbours show."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from fogsim.units import KMH_PER_MPS, visibility_from_extinction
from fogsim.values import RoadSection
from fogsim_envs.corridor.loops import LoopReading
from fogsim_envs.spaces import SPEED_SCALE, scaled_visibility

SHOWN_SPEEDS = (*(kmh / KMH_PER_MPS for kmh in (40, 60, 80, 100, 120)), math.inf)
"""Speed that each level shows [m/s]; the last shows none."""

_FLOW_SCALE = 2500.0
"""Vehicles per hour and lane that are 1: about what a motorway lane carries [1/h]."""

_METER_RANGE = 2000.0
"""Largest visibility that a meter reports [m], as forward scatter sensors of roads do."""

_METER_DEVIATION = 0.1
"""Standard deviation of a meter's value, in ln V [-]; FogSim's own choice."""

CORRIDOR_FEATURES = (
    "upstream_flow",
    "upstream_speed",
    "upstream_passed",
    "downstream_flow",
    "downstream_speed",
    "downstream_passed",
    "visibility",
    "shown_speed",
    "shown_speed_upstream",
    "shown_speed_downstream",
    "speed_limit",
    "place",
    "time_left",
)
"""Meaning of the entries of an observation."""


def corridor_space() -> spaces.Box:
    """Space of what one sign observes."""
    return spaces.Box(0.0, 1.0, (len(CORRIDOR_FEATURES),), np.float32)


@dataclass(frozen=True, slots=True)
class RoadKnowledge:
    """What is known along the road at one instant."""

    loops: tuple[LoopReading, ...]  # Loops before the first sign, between two each, and behind the last
    visibilities: Sequence[float]  # What the visibility meters at the signs tell [m]
    shown: Sequence[float]  # Speeds that the signs have shown till now [m/s]; ``inf`` for none
    lanes: int  # Number of lanes
    time_left: float  # Share of the episode that is left [-]


def loop_places(starts: Sequence[float], length: float) -> tuple[float, ...]:
    """Places of loops: before the first sign, between two each, and behind the last (n + 1,) [m]."""
    ends = (0.0, *starts, length)
    return tuple(0.5 * (before + behind) for before, behind in itertools.pairwise(ends))


def measured_visibilities(sections: Sequence[RoadSection], rng: np.random.Generator) -> list[float]:
    """Readings of the meters at the signs [m]."""
    errors = rng.normal(0.0, _METER_DEVIATION, len(sections)).tolist()
    true = (visibility_from_extinction(section.extinction) for section in sections)
    return [min(visibility * math.exp(error), _METER_RANGE) for visibility, error in zip(true, errors, strict=True)]


def sign_observation(sign: int, known: RoadKnowledge, section: RoadSection, length: float) -> NDArray[np.float32]:
    """Entries of `CORRIDOR_FEATURES` for a sign, 0 … 1 (`length` [m])."""
    shown = (math.inf, *known.shown, math.inf)
    values = (
        *_loop(known.loops[sign], known.lanes),
        *_loop(known.loops[sign + 1], known.lanes),
        scaled_visibility(known.visibilities[sign]),
        *(_scaled_speed(shown[neighbour]) for neighbour in (sign + 1, sign, sign + 2)),
        _scaled_speed(section.speed_limit),
        section.stretch.start / length,
        known.time_left,
    )
    return np.clip(np.array(values, dtype=np.float32), 0.0, 1.0)


def _loop(reading: LoopReading, lanes: int) -> tuple[float, float, float]:
    flow = reading.flow / (_FLOW_SCALE * lanes)
    return (flow, 0.0, 0.0) if reading.speed is None else (flow, reading.speed / SPEED_SCALE, 1.0)


def _scaled_speed(speed: float) -> float:
    return min(speed / SPEED_SCALE, 1.0)
