"""Stopping within the distance that can be seen."""

from dataclasses import dataclass, field
from typing import Annotated

from fogsim.advice.presentation import PresentedAdviser
from fogsim.core.kinematics import DECELERATION, REACTION_TIME, safe_speed
from fogsim.core.parameters import Range, checked_parameters
from fogsim.units import GRAVITY, KMH_PER_MPS
from fogsim.values import Belief, SpeedAdvice


@checked_parameters
@dataclass(frozen=True, slots=True)
class StoppingSightDistance(PresentedAdviser):
    """Advise the speed from which a driver can stop within what is visible.

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
    sight_share : float
        Share of the visibility that may be needed to stop [-]; 1 for an obstacle ahead, 0.5 for narrow roads
        where others come the other way (German StVO § 3).
    quantile, widest_belief, fallback, smoothing, hysteresis, rounding, rounded, minimum, hold
        See `PresentedAdviser`.

    Raises
    ------
    InputError
        If a parameter is out of the range in its annotation.
    """

    reaction_time: Annotated[float, Range(0.0, 60.0, "s")] = REACTION_TIME
    deceleration: Annotated[float, Range(0.1, 15.0, "m/s²")] = DECELERATION
    friction: Annotated[float, Range(0.05, 1.5)] = 1.0
    grade: Annotated[float, Range(-0.2, 0.2)] = 0.0
    quantile: Annotated[float, Range(0.0, 1.0)] = field(default=0.25, kw_only=True)
    sight_share: Annotated[float, Range(0.01, 1.0)] = 1.0
    rounding: Annotated[float, Range(0.01, 50.0, "m/s")] = field(default=10.0 / KMH_PER_MPS, kw_only=True)
    minimum: Annotated[float, Range(0.0, 100.0, "m/s")] = field(default=20.0 / KMH_PER_MPS, kw_only=True)
    hold: Annotated[float, Range(0.0, 3600.0, "s")] = field(default=3.0, kw_only=True)

    def speed_at(self, visibility: float) -> float:
        """Speed from which one stops in sight; see `PresentedAdviser.speed_at`.

        Parameters
        ----------
        visibility : float
            Meteorological visibility [m].
        """
        braking = min(self.deceleration, self.friction * GRAVITY)
        if braking + GRAVITY * self.grade <= 0.0:
            return 0.0
        return safe_speed(self.sight_share * visibility, self.reaction_time, braking, self.grade)


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
            See `Adviser.advise`; not used here.
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
            See `Adviser.advise`; not used here.
        """
        return SpeedAdvice(self.speed)
