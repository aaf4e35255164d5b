"""Arrays that hold many episodes at once, and the numbers that kernels share with the task on SUMO."""

from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.parameters import Range
from fogsim.fusion.grid_filter import LOG_HIGH, LOG_LOW
from fogsim.traffic import SPEED_CHOICES
from fogsim.traffic.drivers.speed_choice import UNAFFECTED_ABOVE, speed_share

STEP = 0.5
"""Decision period and step of the traffic [s]."""

LENGTH, DURATION, BEGIN, END = 2000.0, 260.0, 100.0, 1940.0
"""Length of the road [m], longest time [s], and where the ego begins and arrives [m]: those of the Fast task."""

CELL, CELLS_AHEAD = 10.0, 321
"""Grid of the optical depth along the road [m]; beyond it the fog is as at its end."""

CELLS = 160
LOG_EXTINCTION = np.linspace(LOG_LOW, LOG_HIGH, CELLS)
"""Cells of the belief: the grid filter's, half as fine."""

OTHERS, MOST_DEMAND = 16, 1200.0
"""Most other vehicles of an episode, and most demand, for which SUMO has some more on the road [1/h]."""

DRIVERS = ("unaffected", "observed", "too_fast", "within_sight")
"""Drivers' choices of speed by number."""

_CHOICES = [SPEED_CHOICES[one]() for one in DRIVERS]
_VISIBILITIES = np.arange(int(UNAFFECTED_ABOVE) + 1.0)
CHOSEN_SPEED = np.array([[min(one(v), 1e3) for v in _VISIBILITIES.tolist()] for one in _CHOICES])
CHOSEN_SHARE = np.array([[speed_share(one, v) for v in _VISIBILITIES.tolist()] for one in _CHOICES])
"""Speed [m/s] and share of the speed in clear air that each driver chooses, by whole metres of visibility."""

RUNNING, ARRIVED, TIME, COLLISION = range(4)
ENDINGS = ("", "arrived", "time", "collision")
"""Why an episode is over, by number."""

TERMS = (
    "progress", "time", "arrival", "overdriving", "conflict", "discomfort", "collision", "rear_fog_lamp",
    "front_fog_lamp",
)  # fmt: skip
"""Terms of the reward in the kernel's order, which is that of `TaskWeights`."""

_FLOATS = (
    "time", "position", "speed", "acceleration", "driver", "illuminance", "light",
    "airlight", "luminance", "eye_threshold", "flux_root", "luminance_root",  # Adaptation of the drivers' eyes
    "gap", "leader_speed", "seen_for", "pressed", "since_change",  # Leader [m, m/s]; how long it is seen, slower [s]
    "brakes_from", "braking", "hold",  # Where the lead brakes [m], how hard [m/s²], for how long it stands
    "visibility", "visibility_ahead",
    "common", "error", "width",  # The surrogate's normal deviates
    "estimate", "estimate_deviation", "evidence",  # Latest estimate [1/m]; time of the latest valid one [s]
    "quantile_5", "quantile_25", "quantile_50", "quantile_75", "quantile_95",  # Of the visibility [m]
    "belief_deviation", "fog_deviation",  # Of ln k; of ln k with visibilities above 1 km as 1 km
    "advised", "lead_distance", "lead_speed",
    "rule_speed", "raise_since",
)  # fmt: skip
_INTEGERS = ("lane", "lanes", "lamps", "valid", "lead_present", "rule_lamps", "ending", "struck")
EPISODE = np.dtype([(n, "f8") for n in _FLOATS] + [(n, "i8") for n in _INTEGERS] + [("random", "u8")])
"""One episode: the ego, what it knows, and what the fog is where it is."""

DRAWN = np.dtype(
    [
        (n, "f8")
        for n in (
            "lanes", "demand", "trucks", "vans", "driver", "illuminance", "light",
            "airlight", "luminance", "eye_threshold", "flux_root", "luminance_root",
            "outside", "start_0", "end_0", "edge_0", "extra_0", "start_1", "end_1", "edge_1", "extra_1",
            "strength", "correlation",
            "actor_position", "actor_speed", "actor_length", "brakes_from", "braking", "hold",
        )
    ]
    + [("seed", "u8")]
)  # fmt: skip
"""What is drawn of an episode at its beginning: fog [1/m], [m], and traffic [1/h], [m], [m/s]."""

OTHER = np.dtype(
    [(n, "f8") for n in ("position", "speed", "wanted", "factor", "length", "headway", "power", "braking", "dawdling")]
    + [("lane", "i8")]
)
"""Another vehicle: speed that it wants in clear air [m/s], factor on the speed chosen in fog, and how it drives."""


class Episodes(NamedTuple):
    """N episodes."""

    ego: NDArray[np.void]  # (n,) of `EPISODE`
    others: NDArray[np.void]  # (n, OTHERS) of `OTHER`; a length of 0 is no vehicle
    depth: NDArray[np.float64]  # (n, CELLS_AHEAD): Optical depth from the road's beginning [-]
    belief: NDArray[np.float64]  # (n, CELLS): Probability of each cell
    terms: NDArray[np.float64]  # (n, 9): Terms of the reward of the latest step
    state: NDArray[np.float32]  # (n, 22): What the agent observes

    @classmethod
    def empty(cls, number: int) -> "Episodes":
        """Arrays for so many episodes."""
        return cls(
            np.zeros(number, EPISODE),
            np.zeros((number, OTHERS), OTHER),
            np.zeros((number, CELLS_AHEAD)),
            np.zeros((number, CELLS)),
            np.zeros((number, len(TERMS))),
            np.zeros((number, 22), np.float32),
        )


class SurrogateArrays(NamedTuple):
    """A `SurrogateTable` for kernels."""

    edges: NDArray[np.float64]
    stays_valid: NDArray[np.float64]
    becomes_valid: NDArray[np.float64]
    none_seen: NDArray[np.float64]
    error: NDArray[np.float64]
    deviation: NDArray[np.float64]
    none_deviation: NDArray[np.float64]
    episode_share: float
    persistence: float


KNOWN_QUANTILES = (0.05, 0.25, 0.5, 0.75)
"""Quantiles of the believed visibility by which the built-in adviser can go."""


class RuleConstants(NamedTuple):
    """Constants of the built-in adviser, those of `fogsim.advice.StoppingSightDistance`.

    Attributes
    ----------
    quantile : float
        Quantile of the believed visibility that counts: 0.05, 0.25, 0.5 or 0.75.
    fallback : float
        Speed while the belief says too little [m/s]; inf keeps the advice in force.
    widest : float
        Standard deviation of ln k above which the belief says too little [-].
    sight_share : float
        Share of the visibility that may be needed to stop [-].
    hold : float
        Time before the advice rises [s].
    """

    quantile: float = 0.25
    fallback: Annotated[float, Range(0.0, np.inf, "m/s")] = np.inf
    widest: Annotated[float, Range(0.01, 10.0)] = 0.7
    sight_share: Annotated[float, Range(0.01, 1.0)] = 1.0
    hold: Annotated[float, Range(0.0, 3600.0, "s")] = 3.0
