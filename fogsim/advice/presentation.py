"""How advice that follows the visibility is presented: careful, smoothed, rounded, and without flicker."""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np

from fogsim.core.parameters import Range
from fogsim.values import Belief, FogProfile, SpeedAdvice
from fogsim.values.belief import OLDEST, WIDEST


def harmonised_speeds(
    speeds: Sequence[float],
    lengths: Sequence[float],
    limits: Sequence[float],
    largest_step: float,
    deceleration: float,
) -> tuple[float, ...]:
    """Advised speeds [m/s], lowered where the next section downstream (of `lengths` [m]) is advised much less.

    A section shows no more than the next one and a step, and no more than √(v² + 2 a d), from which a steady
    deceleration a along its length d comes down to the next one's v. Motorways do the same: Dutch gantries by 20
    km/h (90, 70, 50), I-77 in Virginia by at most 15 mph from sign to sign (VTRC 19-R6, 2018).
    """
    shown, down = list(speeds), speeds[-1] if speeds else math.inf
    for place in reversed(range(len(shown) - 1)):
        reached = min(down + largest_step, math.sqrt(down**2 + 2.0 * deceleration * lengths[place]))
        if reached < limits[place]:
            shown[place] = min(shown[place], reached)
        # A section whose limit says more than the step hides the step, and hides none of those upstream of it.
        down = min(speeds[place], reached)
    return tuple(shown)


_EXACT = 1e-9
"""A hair of tolerance keeps exact multiples from being rounded a whole step [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PresentedAdviser(ABC):
    """An adviser that says a speed for a visibility, as all present it: a base class.

    A lower speed is advised at once; a higher one only after it has been justified for `hold` seconds without a break.

    Attributes
    ----------
    quantile : float
        Which quantile of the believed visibility counts, 0 … 1; 0.5 is the median, less is careful.
    widest_belief : float
        Standard deviation of ln k above which a belief says too little to act on [-], visibilities above 1 km taken as
        1 km: at the start, or while nothing but the rear of a truck is to be seen.
    fallback : float or None
        Speed advised while the belief says too little [m/s]; None keeps the advice in force.
    smoothing : float
        Time constant with which the logarithm of the visibility is smoothed exponentially [s]; 0 for none.
    hysteresis : float
        By which share the visibility must exceed what a higher speed asks for before the advice rises [-].
    rounding : float
        The advice is a multiple of this [m/s]; 0 for speeds as they come.
    rounded : str
        `down`, `nearest` or `up`.
    minimum : float
        Lowest speed that is ever advised [m/s].
    hold : float
        Time before the advice rises [s].
    slowing : float
        Deceleration with which drivers slow down for denser fog ahead [m/s²], where the belief knows of places: the
        advice is what each place ahead asks for, and as much more as can be lost on the way there.
    lead_time : float
        Time before drivers begin to do so [s]: to hear, to react, and the time until advice is given again.
    """

    quantile: Annotated[float, Range(0.0, 1.0)] = 0.5
    widest_belief: Annotated[float, Range(0.01, 10.0)] = WIDEST
    fallback: Annotated[float, Range(0.0, 140.0, "m/s")] | None = None
    smoothing: Annotated[float, Range(0.0, 3600.0, "s")] = 0.0
    hysteresis: Annotated[float, Range(0.0, 10.0)] = 0.0
    rounding: Annotated[float, Range(0.0, 50.0, "m/s")] = 0.0
    rounded: Literal["down", "nearest", "up"] = "down"
    minimum: Annotated[float, Range(0.0, 100.0, "m/s")] = 0.0
    hold: Annotated[float, Range(0.0, 3600.0, "s")] = 60.0
    slowing: Annotated[float, Range(0.1, 15.0, "m/s²")] = 1.5
    lead_time: Annotated[float, Range(0.0, 60.0, "s")] = 2.0

    @abstractmethod
    def speed_at(self, visibility: float) -> float:
        """Speed that is right in a visibility [m/s]; ``inf`` for no advice.

        Parameters
        ----------
        visibility : float
            Meteorological visibility [m].
        """

    def advise(self, belief: Belief, speed_limit: float, time: float, previous: SpeedAdvice) -> SpeedAdvice:
        """Advise a speed; see `Adviser.advise`. No advice (``inf``) where the limit is no higher.

        Parameters
        ----------
        belief, speed_limit, time, previous
            See `Adviser.advise`.
        """
        if speed_limit <= previous.speed < math.inf:  # that of another road
            previous = replace(previous, speed=math.inf)
        here = self._here(belief)
        if here is None:
            return SpeedAdvice(previous.speed if self.fallback is None else self._presented(self.fallback, speed_limit))
        smoothed = self._smoothed(here, time, previous)
        target = self._speed_for(math.exp(smoothed), belief.profile, speed_limit)
        if target > previous.speed and self.hysteresis > 0.0:
            careful = self._speed_for(math.exp(smoothed) / (1.0 + self.hysteresis), belief.profile, speed_limit)
            target = max(previous.speed, careful)
        advice = _hold_rises(target, time, previous, self.hold)
        return replace(advice, smoothed=(time, smoothed)) if self.smoothing > 0.0 else advice

    def _here(self, belief: Belief) -> float | None:
        """Visibility that counts where the vehicle is [m]; None where the belief says too little."""
        if belief.profile is None or belief.age > OLDEST:
            return belief.known_visibility(self.quantile, self.widest_belief)
        return belief.profile.known_visibility(0.0, self.quantile, self.widest_belief)

    def _speed_for(self, visibility: float, profile: FogProfile | None, limit: float) -> float:
        """Speed that a visibility here asks for, and denser fog ahead [m/s]."""
        speed = self.speed_at(visibility)
        if profile is not None:
            known = profile.known_visibilities(self.quantile, self.widest_belief)
            is_ahead = (profile.distance > 0.0) & ~np.isnan(known)
            places = zip(profile.distance[is_ahead].tolist(), known[is_ahead].tolist(), strict=True)
            for distance, visibility_there in places:
                there = self.speed_at(visibility_there)
                # v² = v_there² + 2 a (d − v T)
                lost = self.slowing * self.lead_time
                speed = min(speed, math.sqrt(lost**2 + there**2 + 2.0 * self.slowing * distance) - lost)
        return self._presented(speed, limit)

    def _smoothed(self, visibility: float, time: float, previous: SpeedAdvice) -> float:
        """Logarithm of the smoothed visibility [ln m]."""
        now = math.log(visibility)
        if self.smoothing == 0.0 or previous.smoothed is None:
            return now
        since, before = previous.smoothed
        return before + (now - before) * -math.expm1(-max(time - since, 0.0) / self.smoothing)

    def _presented(self, speed: float, limit: float) -> float:
        if speed >= limit:
            return math.inf
        shown = max(self.minimum, self._on_grid(speed) if self.rounding > 0.0 else speed)
        return shown if shown < limit else math.inf

    def _on_grid(self, speed: float) -> float:
        multiple = speed / self.rounding
        if self.rounded == "nearest":
            return round(multiple) * self.rounding
        whole = math.floor(multiple + _EXACT) if self.rounded == "down" else math.ceil(multiple - _EXACT)
        return whole * self.rounding


def _hold_rises(target: float, time: float, previous: SpeedAdvice, hold: float) -> SpeedAdvice:
    """Advice that goes to a target speed, upwards only after a hold time (`target` [m/s], `time` [s], `hold` [s])."""
    if target <= previous.speed:
        return SpeedAdvice(target)
    since = time if previous.raise_since is None else previous.raise_since
    return SpeedAdvice(target) if time - since >= hold else SpeedAdvice(previous.speed, raise_since=since)
