"""Stopping within the distance that can be seen."""

import math
from dataclasses import dataclass
from typing import Annotated

from fogsim.advice.raising import hold_rises
from fogsim.kinematics import DECELERATION, REACTION_TIME, safe_speed
from fogsim.parameters import Range, checked_parameters
from fogsim.units import GRAVITY, KMH_PER_MPS
from fogsim.values import Belief, SpeedAdvice


@checked_parameters
@dataclass(frozen=True, slots=True)
class StoppingSightDistance:
    """Advise the speed from which a driver can stop within what is visible.

    A lower speed is advised at once; a higher one only after it has been justified for `hold` seconds without a break.

    Attributes
    ----------
    reaction_time : float
        Perception and reaction time [s].
    deceleration : float
        Deceleration while stopping on level road [m/s²].
    friction : float
        Coefficient of friction between tyres and road [-], which no deceleration exceeds; 0.28 … 0.4 on wet roads by
        speed (AASHTO 1990), down to 0.1 on ice.
    grade : float
        Slope of the road [-], positive uphill.
    quantile : float
        Which quantile of the believed visibility counts as sight distance, 0 … 1; 0.5 is the median, less is careful.
    sight_share : float
        Share of the visibility that may be needed to stop [-]; 1 for an obstacle ahead, 0.5 for narrow roads
        where others come the other way (German StVO § 3).
    rounding : float
        The advice is rounded down to a multiple of this [m/s].
    minimum : float
        Lowest speed that is ever advised [m/s].
    hold : float
        Time before the advice rises [s].
    widest_belief : float
        Standard deviation of ln k above which a belief says too little to change the advice [-]: at the start, or
        while nothing but the rear of a truck is to be seen.

    Raises
    ------
    InputError
        If a parameter is out of the range in its annotation.
    """

    reaction_time: Annotated[float, Range(0.0, 60.0, "s")] = REACTION_TIME
    deceleration: Annotated[float, Range(0.1, 15.0, "m/s²")] = DECELERATION
    friction: Annotated[float, Range(0.05, 1.5)] = 1.0
    grade: Annotated[float, Range(-0.2, 0.2)] = 0.0
    quantile: Annotated[float, Range(0.0, 1.0)] = 0.25
    sight_share: Annotated[float, Range(0.01, 1.0)] = 1.0
    rounding: Annotated[float, Range(0.01, 50.0, "m/s")] = 10.0 / KMH_PER_MPS
    minimum: Annotated[float, Range(0.0, 100.0, "m/s")] = 20.0 / KMH_PER_MPS
    hold: Annotated[float, Range(0.0, 3600.0, "s")] = 3.0
    widest_belief: Annotated[float, Range(0.01, 10.0)] = 0.7

    def advise(self, belief: Belief, speed_limit: float, time: float, previous: SpeedAdvice) -> SpeedAdvice:
        """Advise a speed; see `Adviser.advise`. No advice (``inf``) where the limit itself is safe.

        Parameters
        ----------
        belief, speed_limit, time, previous
            As of `Adviser.advise`.
        """
        if belief.log_standard_deviation > self.widest_belief:
            return SpeedAdvice(previous.speed)
        sight = self.sight_share * belief.visibility_quantile(self.quantile)
        braking = min(self.deceleration, self.friction * GRAVITY)
        stoppable = braking + GRAVITY * self.grade > 0.0
        safe = safe_speed(sight, self.reaction_time, braking, self.grade) if stoppable else 0.0
        target = math.inf if safe >= speed_limit else self._rounded(safe)
        return hold_rises(target, time, previous, self.hold)

    def _rounded(self, speed: float) -> float:
        # A hair of tolerance keeps exact multiples from being rounded down a whole step.
        return max(self.minimum, math.floor(speed / self.rounding + 1e-9) * self.rounding)


@dataclass(frozen=True, slots=True)
class NoAdvice:
    """Advise nothing: what happens when drivers are left alone."""

    def advise(
        self,
        belief: Belief,  # noqa: ARG002 - the protocol's parameters
        speed_limit: float,  # noqa: ARG002 - the protocol's parameters
        time: float,  # noqa: ARG002 - the protocol's parameters
        previous: SpeedAdvice,  # noqa: ARG002 - the protocol's parameters
    ) -> SpeedAdvice:
        """Advise nothing; see `Adviser.advise`.

        Parameters
        ----------
        belief, speed_limit, time, previous
            As of `Adviser.advise`; they do not matter.
        """
        return SpeedAdvice()


@checked_parameters
@dataclass(frozen=True, slots=True)
class FixedSpeed:
    """Advise one speed, whatever the fog: a sign, or an ego that drives at a speed of the user's.

    Attributes
    ----------
    speed : float
        The speed [m/s].

    Raises
    ------
    InputError
        If the speed is out of the range in its annotation.
    """

    speed: Annotated[float, Range(0.0, 140.0, "m/s")] = 50.0 / KMH_PER_MPS

    def advise(
        self,
        belief: Belief,  # noqa: ARG002 - the protocol's parameters
        speed_limit: float,  # noqa: ARG002 - the protocol's parameters
        time: float,  # noqa: ARG002 - the protocol's parameters
        previous: SpeedAdvice,  # noqa: ARG002 - the protocol's parameters
    ) -> SpeedAdvice:
        """Advise the fixed speed; see `Adviser.advise`.

        Parameters
        ----------
        belief, speed_limit, time, previous
            As of `Adviser.advise`; they do not matter.
        """
        return SpeedAdvice(self.speed)
