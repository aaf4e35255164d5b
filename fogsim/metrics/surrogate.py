"""Surrogate safety measures: how near a collision was, from gaps and speeds alone.

Every function takes scalars or arrays that broadcast, and gives float64 of their common shape.
"""

from dataclasses import dataclass
from importlib import import_module
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fogsim.core.kinematics import DECELERATION, REACTION_TIME
from fogsim.core.parameters import Range, checked_parameters

QUEUE_SPEED = 5.0
"""Speed below which a vehicle counts as queued [m/s]; slower followers only close up and are in no conflict."""

CRITICAL_DECELERATION = 3.4
"""Deceleration to avoid a crash from which a conflict is serious [m/s²] (threshold of SUMO's SSM device for MDRAC)."""

_ALERT_REACTION_TIME = 1.0
"""Perception and reaction time of a driver who looks ahead [s] (default of SUMO's SSM device)."""

_FULL_BRAKING = 6.43
"""Deceleration that the brakes of a passenger car must reach at least [m/s²] (UN R13-H, mean fully developed)."""

AVAILABLE_DECELERATION = (8.45, 1.40, 4.23, 12.68)
"""Mean, standard deviation, least and highest of the maximum available deceleration rate (MADR) of cars [m/s²], a
truncated normal distribution (Cunto & Saccomanno 2008)."""


@checked_parameters
@dataclass(frozen=True, slots=True)
class SafetyStandard:
    """What the measures of a run are judged by.

    Attributes
    ----------
    reaction_time : float
        Perception and reaction time in the stopping sight distance [s]: that of the advice, or AASHTO's design value.
    deceleration : float
        Deceleration in the stopping sight distance [m/s²]: that of the advice, or AASHTO's design value.
    time_to_collision : float
        Time to collision below which a driver counts as exposed [s]; 3 s is the default of SUMO's SSM device.
    advice_tolerance : float
        Speed above the advice that still counts as following it [m/s]; 1 km/h, what a speedometer can show.
    """

    reaction_time: Annotated[float, Range(0.0, 60.0, "s")] = REACTION_TIME
    deceleration: Annotated[float, Range(0.01, 100.0, "m/s²")] = DECELERATION
    time_to_collision: Annotated[float, Range(0.0, 3600.0, "s")] = 3.0
    advice_tolerance: Annotated[float, Range(0.0, 100.0, "m/s")] = 1.0 / 3.6


def time_to_collision(gap: ArrayLike, speed: ArrayLike, leader_speed: ArrayLike) -> NDArray[np.float64]:
    """Time until the follower reaches its leader at constant speeds, gap / (v_F − v_L) (Hayward 1972).

    Parameters
    ----------
    gap : array_like
        Distance from the follower's front bumper to the leader's rear bumper [m].
    speed, leader_speed : array_like
        Speeds of follower and leader [m/s].

    Returns
    -------
    ndarray
        Time to collision [s], ≥ 0; 0 where the gap is used up, ``inf`` where the follower does not approach.
    """
    gap, approach = np.maximum(gap, 0.0), np.subtract(speed, leader_speed)
    return _quotient_where(approach > 0, gap, approach, np.inf)


def deceleration_rate_to_avoid_crash(gap: ArrayLike, speed: ArrayLike, leader_speed: ArrayLike) -> NDArray[np.float64]:
    """Deceleration that takes away the difference of speed within the gap, Δv² / (2 gap) (DRAC).

    Parameters
    ----------
    gap : array_like
        Distance from the follower's front bumper to the leader's rear bumper [m].
    speed, leader_speed : array_like
        Speeds of follower and leader [m/s].

    Returns
    -------
    ndarray
        Deceleration [m/s²], ≥ 0; 0 where the follower does not approach, ``inf`` where it does without a gap.
    """
    approach = np.maximum(np.subtract(speed, leader_speed), 0.0)
    needed = _quotient_where(np.greater(gap, 0), 0.5 * approach**2, gap, np.inf)
    return np.where(approach > 0, needed, 0.0)[()]


def modified_deceleration_rate_to_avoid_crash(
    gap: ArrayLike, speed: ArrayLike, leader_speed: ArrayLike, reaction_time: float = _ALERT_REACTION_TIME
) -> NDArray[np.float64]:
    """Deceleration to avoid a crash when it begins only after a reaction time, MDRAC = Δv / (2 (TTC − PRT)).

    Parameters
    ----------
    gap : array_like
        Distance from the follower's front bumper to the leader's rear bumper [m].
    speed, leader_speed : array_like
        Speeds of follower and leader [m/s].
    reaction_time : float
        Perception and reaction time PRT [s]; 1 s is SUMO's default (SSM device), as is the formula.

    Returns
    -------
    ndarray
        Deceleration [m/s²], ≥ 0; 0 where the follower does not approach, ``inf`` where TTC ≤ PRT.
    """
    approach = np.maximum(np.subtract(speed, leader_speed), 0.0)
    remaining = time_to_collision(gap, speed, leader_speed) - reaction_time
    return _quotient_where(remaining > 0, 0.5 * approach, remaining, np.inf)


def potential_collision_speed(
    gap: ArrayLike,
    speed: ArrayLike,
    leader_speed: ArrayLike,
    reaction_time: float = _ALERT_REACTION_TIME,
    deceleration: float = _FULL_BRAKING,
) -> NDArray[np.float64]:
    """Difference of speed at which a follower hits its leader if that brakes fully now, and it itself after reacting.

    Both brake at b. Until the first of two instants, when the follower reacts (PRT) or the leader stands (v_L / b), the
    closing speed v_F − v_L grows by b t; between them it is constant, u; after both it falls, to √(u² − 2 b s) over the
    gap s that is then left. A leader speed of 0 is an obstacle that appears at the distance ``gap``.

    Parameters
    ----------
    gap : array_like
        Distance from the follower's front bumper to the leader's rear bumper [m].
    speed, leader_speed : array_like
        Speeds of follower and leader [m/s].
    reaction_time : float
        Perception and reaction time PRT [s].
    deceleration : float
        Deceleration b of both [m/s²], positive.

    Returns
    -------
    ndarray
        Speed of the impact [m/s], 0 where there is none.
    """
    gap, closing = np.maximum(gap, 0.0), np.subtract(speed, leader_speed)
    standing = np.divide(leader_speed, deceleration)
    growing = np.minimum(standing, reaction_time)
    constant = np.maximum(closing + deceleration * growing, 0.0)
    hit_growing = np.subtract(gap, (closing + 0.5 * deceleration * growing) * growing)
    left = hit_growing - constant * np.abs(standing - reaction_time)
    falling = np.sqrt(np.maximum(constant**2 - 2.0 * deceleration * np.maximum(left, 0.0), 0.0))
    at_once = np.sqrt(closing**2 + np.multiply(2.0 * deceleration, gap))
    impact: NDArray[np.float64] = np.where(hit_growing <= 0.0, at_once, falling)[()]
    return impact


def crash_potential(drac: ArrayLike) -> NDArray[np.float64]:
    """Probability that DRAC exceeds the deceleration that the brakes and the road allow, P(MADR ≤ DRAC).

    Its mean over a vehicle's time is the crash potential index (CPI, Cunto & Saccomanno, Accident Analysis and
    Prevention 40 (2008), 1171-1179).

    Parameters
    ----------
    drac : array_like
        Deceleration rate to avoid a crash [m/s²]; ``inf`` where no braking is enough.

    Returns
    -------
    ndarray
        Probability [-] by the distribution `AVAILABLE_DECELERATION`, 0 … 1.
    """
    mean, deviation, least, highest = AVAILABLE_DECELERATION
    ndtr = import_module("scipy.special").ndtr
    below, up_to, below_highest = (
        ndtr((x - mean) / deviation) for x in (least, np.clip(drac, least, highest), highest)
    )
    return np.asarray((up_to - below) / (below_highest - below), dtype=np.float64)[()]


def stopping_distance_difference(
    gap: ArrayLike,
    speed: ArrayLike,
    leader_speed: ArrayLike,
    reaction_time: float = _ALERT_REACTION_TIME,
    deceleration: float = _FULL_BRAKING,
) -> NDArray[np.float64]:
    """Difference of space distance and stopping distance, gap + v_L² / 2b − (v_F t + v_F² / 2b) (DSS).

    Negative where the follower cannot stop behind a leader that brakes fully now (Okamura et al., Advances in
    Transportation Studies, special issue (2011), 99-112). The time integral of −DSS while it is negative is TIDSS.

    Parameters
    ----------
    gap, speed, leader_speed, reaction_time, deceleration
        See `potential_collision_speed`.

    Returns
    -------
    ndarray
        Difference [m].
    """
    braking = (np.square(leader_speed) - np.square(speed)) / (2.0 * deceleration)
    return np.asarray(np.add(gap, braking) - np.multiply(speed, reaction_time), dtype=np.float64)[()]


def time_headway(gap: ArrayLike, speed: ArrayLike) -> NDArray[np.float64]:
    """Time in which the follower drives the gap to its leader, gap / v_F.

    Parameters
    ----------
    gap : array_like
        Distance from the follower's front bumper to the leader's rear bumper [m].
    speed : array_like
        Speed of the follower [m/s].

    Returns
    -------
    ndarray
        Time headway between bumpers [s], ≥ 0; ``inf`` for a follower at rest.
    """
    return _quotient_where(np.greater(speed, 0), np.maximum(gap, 0.0), speed, np.inf)


def time_exposed_time_to_collision(
    times_to_collision: ArrayLike, durations: ArrayLike, threshold: float = 3.0
) -> float:
    """Time spent below a time to collision, Σ [0 ≤ TTC ≤ TTC*] τ (TET, Minderhoud & Bovy 2001).

    Parameters
    ----------
    times_to_collision : (n,) array_like
        Time to collision in each interval [s]; ``inf`` where there is none.
    durations : (n,) or scalar array_like
        Length τ of each interval [s].
    threshold : float
        TTC* [s].

    Returns
    -------
    float
        Exposed time [s].
    """
    exposed = np.less_equal(times_to_collision, threshold) & np.greater_equal(times_to_collision, 0.0)
    return float(np.sum(exposed * np.asarray(durations, dtype=np.float64)))


def time_integrated_time_to_collision(
    times_to_collision: ArrayLike, durations: ArrayLike, threshold: float = 3.0
) -> float:
    """Time to collision missing below a threshold, Σ (TTC* − TTC)⁺ τ (TIT, Minderhoud & Bovy 2001).

    Parameters
    ----------
    times_to_collision, durations, threshold
        See `time_exposed_time_to_collision`.

    Returns
    -------
    float
        Integrated time to collision [s²].
    """
    missing = np.maximum(threshold - np.asarray(times_to_collision, dtype=np.float64), 0.0)
    return float(np.sum(missing * np.asarray(durations, dtype=np.float64)))


def _quotient_where(
    defined: ArrayLike, numerator: ArrayLike, denominator: ArrayLike, elsewhere: float
) -> NDArray[np.float64]:
    """Divide only where the quotient is defined, so that no division by zero is ever made."""
    if all(isinstance(one, float | int | np.bool_) for one in (defined, numerator, denominator)):
        # One vehicle in each step: arrays would cost twice as much.
        number: NDArray[np.float64] = np.divide(numerator, denominator) if defined else np.array(elsewhere)[()]
        return number
    shape = np.broadcast(defined, numerator, denominator).shape
    result = np.full(shape, elsewhere, dtype=np.float64)
    return np.divide(numerator, denominator, out=result, where=np.asarray(defined, dtype=bool))[()]
