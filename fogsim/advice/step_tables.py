"""Published speed tables: an advised speed for each range of visibility, as on message signs and in traffic laws."""

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated

from fogsim.advice.raising import hold_rises
from fogsim.advice.sight_distance import StoppingSightDistance
from fogsim.errors import InputError
from fogsim.parameters import Range, checked_parameters
from fogsim.units import KMH_PER_MPS, METRES_PER_MILE
from fogsim.values import Belief, SpeedAdvice

_MPH = METRES_PER_MILE / 3600.0
_KMH = 1.0 / KMH_PER_MPS
_CLOSED = 20.0 * _KMH  # A road that is closed is left by its next exit at this speed [m/s]: FogSim's own choice.
_I77_VISIBILITY = 198.1  # 650 ft [m]

Visibilities = Sequence[Annotated[float, Range(1.0, 10_000.0, "m")]]
Speeds = Sequence[Annotated[float, Range(0.1, 140.0, "m/s")]]


@checked_parameters
@dataclass(frozen=True, slots=True)
class StepTable:
    """Advise the speed of the step in which the visibility lies; none at the last step's end and above.

    A lower speed is advised at once; a higher one only after it has been justified for `hold` seconds without a break.

    Attributes
    ----------
    visibilities : sequence of float
        Ends of the steps, ascending [m]: a speed holds below its end; by default those of the A16.
    speeds : sequence of float
        Advised speed of each step, ascending too [m/s].
    quantile : float
        Which quantile of the believed visibility is looked up, 0 … 1; 0.5 is the median, less is careful.
    hold : float
        Time before the advice rises [s].
    widest_belief : float
        Standard deviation of ln k above which a belief says too little to change the advice [-].

    Raises
    ------
    InputError
        If steps and speeds are not as many or do not ascend, or a parameter is out of the range in its annotation.
    """

    visibilities: Visibilities = (70.0, 140.0)
    speeds: Speeds = (60.0 * _KMH, 80.0 * _KMH)
    quantile: Annotated[float, Range(0.0, 1.0)] = 0.5
    hold: Annotated[float, Range(0.0, 3600.0, "s")] = 60.0
    widest_belief: Annotated[float, Range(0.01, 10.0)] = 0.7

    def __post_init__(self) -> None:
        for name, values in (("visibilities", self.visibilities), ("speeds", self.speeds)):
            if any(low >= high for low, high in pairwise(values)):
                raise InputError(f"{type(self).__name__}: {name} must be in ascending order, got {values!r}")
        if len(self.visibilities) != len(self.speeds):
            raise InputError(
                f"{type(self).__name__}: there must be a speed for each visibility, got {len(self.visibilities)} "
                f"visibilities and {len(self.speeds)} speeds"
            )

    def advise(self, belief: Belief, speed_limit: float, time: float, previous: SpeedAdvice) -> SpeedAdvice:
        """Advise a speed; see `Adviser.advise`. No advice (``inf``) where the limit is no higher.

        Parameters
        ----------
        belief, speed_limit, time, previous
            As of `Adviser.advise`.
        """
        if belief.log_standard_deviation > self.widest_belief:
            return SpeedAdvice(previous.speed)
        step = bisect_right(self.visibilities, belief.visibility_quantile(self.quantile))
        speed = (*self.speeds, math.inf)[step]
        return hold_rises(speed if speed < speed_limit else math.inf, time, previous, self.hold)


@checked_parameters
@dataclass(frozen=True, slots=True)
class NetherlandsA16(StepTable):
    """Advise as the A16 near Breda: below 140 m 80 km/h, below 70 m 60 km/h (Hogema & van der Horst 1997)."""


@checked_parameters
@dataclass(frozen=True, slots=True)
class AlabamaI10(StepTable):
    """Advise as I-10 over Mobile Bay: 65, 55, 45, 35 mph below 274, 201, 137, 85 m, closed below 53 m.

    Source: FHWA, Best Practices for Road Weather Management 3.0, table AL-1. Who is on a closed road creeps to the next
    exit, here at 20 km/h.
    """

    visibilities: Visibilities = (53.3, 85.3, 137.2, 201.2, 274.3)
    speeds: Speeds = (_CLOSED, 35.0 * _MPH, 45.0 * _MPH, 55.0 * _MPH, 65.0 * _MPH)


@checked_parameters
@dataclass(frozen=True, slots=True)
class TennesseeI75(StepTable):
    """Advise as I-75 near Calhoun: 50 or 35 mph, closed below 73 m.

    Source: FHWA, Best Practices for Road Weather Management 3.0. Where
    the two speeds begin is not in it: 50 mph below 402 m and 35 mph below 146 m are FogSim's choice.
    """

    visibilities: Visibilities = (73.2, 146.3, 402.3)
    speeds: Speeds = (_CLOSED, 35.0 * _MPH, 50.0 * _MPH)


@checked_parameters
@dataclass(frozen=True, slots=True)
class ChinaArticle81(StepTable):
    """Advise as article 81 of China's road safety regulations: 60, 40, 20 km/h below 200, 100, 50 m."""

    visibilities: Visibilities = (50.0, 100.0, 200.0)
    speeds: Speeds = (20.0 * _KMH, 40.0 * _KMH, 60.0 * _KMH)


@checked_parameters
@dataclass(frozen=True, slots=True)
class FiftyBelowFifty(StepTable):
    """Advise 50 km/h below 50 m: France's Code de la route R413-4, Germany's StVO § 3."""

    visibilities: Visibilities = (50.0,)
    speeds: Speeds = (50.0 * _KMH,)


@checked_parameters
@dataclass(frozen=True, slots=True)
class VirginiaI77:
    """Advise as I-77 at Fancy Gap: below 198 m the speed from which one stops in sight, 30 … 65 mph (VTRC 19-R6, 2018).

    Attributes
    ----------
    quantile : float
        Which quantile of the believed visibility counts as sight distance, 0 … 1; 0.5 is the median, less is careful.
    hold : float
        Time before the advice rises [s].
    widest_belief : float
        Standard deviation of ln k above which a belief says too little to change the advice [-].

    Raises
    ------
    InputError
        If a parameter is out of the range in its annotation.
    """

    quantile: Annotated[float, Range(0.0, 1.0)] = 0.5
    hold: Annotated[float, Range(0.0, 3600.0, "s")] = 60.0
    widest_belief: Annotated[float, Range(0.01, 10.0)] = 0.7

    def advise(self, belief: Belief, speed_limit: float, time: float, previous: SpeedAdvice) -> SpeedAdvice:
        """Advise a speed; see `Adviser.advise`.

        Parameters
        ----------
        belief, speed_limit, time, previous
            As of `Adviser.advise`.
        """
        in_sight = StoppingSightDistance(
            quantile=self.quantile,
            rounding=5.0 * _MPH,
            minimum=30.0 * _MPH,
            hold=self.hold,
            widest_belief=self.widest_belief,
        )
        if belief.visibility_quantile(self.quantile) < _I77_VISIBILITY:
            return in_sight.advise(belief, min(speed_limit, 70.0 * _MPH), time, previous)
        return hold_rises(math.inf, time, previous, self.hold)
