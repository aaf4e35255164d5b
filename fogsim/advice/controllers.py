"""What a controller is asked, and reference controllers with published thresholds."""

import math
from dataclasses import dataclass, field
from typing import Annotated, Protocol, runtime_checkable

from fogsim.advice.sight_distance import StoppingSightDistance
from fogsim.core.parameters import Range, checked_parameters
from fogsim.units import KMH_PER_MPS
from fogsim.values import Belief, Control, DriverWarning, Observation


class Controller(Protocol):
    """Drives, brakes or warns by what a vehicle measures; each run has its own, which may remember."""

    def control(self, observation: Observation) -> Control:
        """Request something for the next camera period.

        Parameters
        ----------
        observation : Observation
            Sensor readings of the vehicle: its speed, the lead vehicle, the frame, the signs ahead.
        """


@runtime_checkable
class BeliefController(Protocol):
    """A controller that is also given what is believed about the fog."""

    def control_by_belief(self, observation: Observation, belief: Belief) -> Control:
        """Request something for the next camera period.

        Parameters
        ----------
        observation : Observation
            Sensor readings of the vehicle.
        belief : Belief
            What is believed about the fog.
        """


_Deceleration = Annotated[float, Range(0.1, 15.0, "m/s²")]


@checked_parameters
@dataclass(slots=True)
class EmergencyBrake:
    """Warn, brake partially, and brake fully, each stage when braking any later would no longer stop in time.

    A stage begins when what it needs, v t + v² / (2 a) with closing speed v, exceeds the distance; braking ends when
    the vehicle ahead is no longer approached. Warning time and partial braking are the least that UN Regulation 152
    allows (5.2.1.1: 0.8 s before braking; 5.2.1.2: 5 m/s²).

    Attributes
    ----------
    partial, full : float
        Decelerations a of the two stages [m/s²].
    response_time : float
        Time t until the brakes act [s].
    warning_time : float
        Time from the warning to the first stage [s].
    margin : float
        Distance that is to remain [m].
    """

    partial: _Deceleration = 5.0
    full: _Deceleration = 9.0
    response_time: Annotated[float, Range(0.0, 10.0, "s")] = 0.4
    warning_time: Annotated[float, Range(0.0, 10.0, "s")] = 0.8
    margin: Annotated[float, Range(0.0, 50.0, "m")] = 3.0
    _stage: int = field(default=0, init=False)

    def control(self, observation: Observation) -> Control:
        """Brake for the lead vehicle; see `Controller.control`.

        Parameters
        ----------
        observation : Observation
            Sensor readings of the vehicle.
        """
        lead = observation.lead
        closing = 0.0 if lead is None else -lead.relative_speed
        if lead is None or closing <= 0.3:
            # The brakes stay on up to a standstill, and there until the vehicle ahead drives off or is gone.
            is_blocked = lead is not None and closing > -0.3
            is_held = observation.speed < 0.5 and (is_blocked or observation.speed > 0.0)
            self._stage = self._stage if is_held else 0
            spare = math.inf
        else:
            spare = (lead.distance - self.margin) / closing - self.response_time
            stages = (self.partial, self.full)
            self._stage = max(self._stage, sum(spare < closing / (2.0 * braking) for braking in stages))
        if self._stage:
            return Control(-(self.full if self._stage == 2 else self.partial), warning=DriverWarning.COLLISION)
        is_near = spare < self.warning_time + closing / (2.0 * self.partial)
        return Control(warning=DriverWarning.COLLISION if is_near else None)


@checked_parameters
@dataclass(frozen=True, slots=True)
class SightLimiter:
    """Drive a set speed, but no faster than one can stop within what is believed to be seen.

    Attributes
    ----------
    set_speed : float
        The set speed [m/s].
    quantile : float
        Quantile of the believed visibility to act on.
    unknown_speed : float
        Speed while the belief says too little to act on [m/s].
    """

    set_speed: Annotated[float, Range(0.0, 100.0, "m/s")] = 120.0 / KMH_PER_MPS
    quantile: Annotated[float, Range(0.0, 1.0)] = 0.25
    unknown_speed: Annotated[float, Range(0.0, 100.0, "m/s")] = 80.0 / KMH_PER_MPS

    def control_by_belief(self, observation: Observation, belief: Belief) -> Control:  # noqa: ARG002 - as the protocol
        """Limit the speed; see `BeliefController.control_by_belief`.

        Parameters
        ----------
        observation : Observation
            Sensor readings of the vehicle; not used here.
        belief : Belief
            What is believed about the fog.
        """
        return Control(speed=self.limited_speed(belief))

    def limited_speed(self, belief: Belief) -> float:
        """Set speed within sight [m/s].

        Parameters
        ----------
        belief : Belief
            What is believed about the fog.
        """
        visibility = belief.known_visibility(self.quantile)
        seen = self.unknown_speed if visibility is None else StoppingSightDistance().speed_at(visibility)
        return min(self.set_speed, seen)


@checked_parameters
@dataclass(frozen=True, slots=True)
class AdaptiveCruiseControl(SightLimiter):
    """Follow the lead vehicle at a time gap, at the set speed of `SightLimiter` without one.

    Constant time gap: a = k₁ (gap − margin − h v) + k₂ Δv, within the limits of ISO 15622:2018; gains of Milanés &
    Shladover (2014), Transportation Research C 48, 285 (0.23 1/s² and 0.07 1/s).

    Attributes
    ----------
    time_gap : float
        Time gap h to the lead vehicle [s].
    margin : float
        Gap at a standstill [m].
    set_speed, quantile, unknown_speed
        See `SightLimiter`.
    """

    time_gap: Annotated[float, Range(0.5, 10.0, "s")] = 1.8
    margin: Annotated[float, Range(0.0, 50.0, "m")] = 3.0

    def control_by_belief(self, observation: Observation, belief: Belief) -> Control:
        """Follow or cruise; see `BeliefController.control_by_belief`.

        Parameters
        ----------
        observation : Observation
            Sensor readings of the vehicle.
        belief : Belief
            What is believed about the fog.
        """
        lead, speed = observation.lead, observation.speed
        cruising = min(max(self.limited_speed(belief) - speed, -3.5), 2.0)
        if lead is None:
            return Control(cruising)
        following = 0.23 * (lead.distance - self.margin - self.time_gap * speed) + 0.07 * lead.relative_speed
        return Control(min(cruising, max(following, -3.5)))
