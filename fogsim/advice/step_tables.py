"""Published speed tables: an advised speed for each range of visibility, as on message signs and in traffic laws."""

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Annotated

from fogsim.advice.presentation import PresentedAdviser
from fogsim.core.kinematics import DECELERATION, REACTION_TIME, safe_speed
from fogsim.core.parameters import Range, checked_parameters
from fogsim.errors import InputError
from fogsim.units import KMH_PER_MPS, METRES_PER_MILE

_MPH = METRES_PER_MILE / 3600.0
_KMH = 1.0 / KMH_PER_MPS
_CLOSED = 20.0 * _KMH  # A road that is closed is left by its next exit at this speed [m/s]: FogSim's own choice.
_I77_VISIBILITY = 198.1  # 650 ft [m]

Visibilities = Sequence[Annotated[float, Range(1.0, 10_000.0, "m")]]
Speeds = Sequence[Annotated[float, Range(0.1, 140.0, "m/s")]]


@checked_parameters
@dataclass(frozen=True, slots=True)
class StepTable(PresentedAdviser):
    """Advise the speed of the step in which the visibility lies; none at the last step's end and above.

    Attributes
    ----------
    visibilities : sequence of float
        Ends of the steps, ascending [m]: a speed holds below its end; by default those of the A16.
    speeds : sequence of float
        Advised speed of each step, ascending too [m/s].
    quantile, widest_belief, fallback, smoothing, hysteresis, rounding, rounded, minimum, hold
        See `PresentedAdviser`.

    Raises
    ------
    InputError
        If steps and speeds are not as many or do not ascend, or a parameter is out of the range in its annotation.
    """

    visibilities: Visibilities = (70.0, 140.0)
    speeds: Speeds = (60.0 * _KMH, 80.0 * _KMH)

    def __post_init__(self) -> None:
        for name, values in (("visibilities", self.visibilities), ("speeds", self.speeds)):
            if any(low >= high for low, high in pairwise(values)):
                raise InputError(f"{type(self).__name__}: {name} must be in ascending order, got {values!r}")
        if len(self.visibilities) != len(self.speeds):
            raise InputError(
                f"{type(self).__name__}: there must be a speed for each visibility, got {len(self.visibilities)} "
                f"visibilities and {len(self.speeds)} speeds"
            )

    def speed_at(self, visibility: float) -> float:
        """Speed of a visibility's step; see `PresentedAdviser.speed_at`.

        Parameters
        ----------
        visibility : float
            Meteorological visibility [m].
        """
        return (*self.speeds, math.inf)[bisect_right(self.visibilities, visibility)]


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
class VirginiaI77(PresentedAdviser):
    """Advise as I-77 at Fancy Gap: below 198 m the speed from which one stops in sight, 30 … 65 mph (VTRC 19-R6, 2018).

    Attributes
    ----------
    quantile, widest_belief, fallback, smoothing, hysteresis, rounding, rounded, minimum, hold
        See `PresentedAdviser`.

    Raises
    ------
    InputError
        If a parameter is out of the range in its annotation.
    """

    rounding: Annotated[float, Range(0.0, 50.0, "m/s")] = field(default=5.0 * _MPH, kw_only=True)
    minimum: Annotated[float, Range(0.0, 100.0, "m/s")] = field(default=30.0 * _MPH, kw_only=True)

    def speed_at(self, visibility: float) -> float:
        """Speed from which one stops in sight; see `PresentedAdviser.speed_at`."""
        if visibility >= _I77_VISIBILITY:
            return math.inf
        in_sight = safe_speed(visibility, REACTION_TIME, DECELERATION)
        return math.inf if in_sight >= 70.0 * _MPH else in_sight
