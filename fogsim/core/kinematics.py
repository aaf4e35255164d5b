"""Stopping and slowing down: the formulas that advice, metrics and traffic share."""

import math
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from fogsim.units import GRAVITY

REACTION_TIME, DECELERATION = 2.5, 3.4
"""Default design values of the stopping sight distance [s], [m/s²] (AASHTO Green Book)."""

_Quantity = TypeVar("_Quantity", float, NDArray[np.float64])


def stopping_sight_distance(
    speed: _Quantity, reaction_time: float, deceleration: float, grade: float = 0.0
) -> _Quantity:
    """Distance to react and stop, v t + v² / 2(a + g G) [m] (AASHTO Green Book with t = 2.5 s, a = 3.4 m/s²).

    Parameters
    ----------
    speed : float or ndarray
        Speed v [m/s].
    reaction_time : float
        Perception and reaction time t [s].
    deceleration : float
        Deceleration a [m/s²], positive.
    grade : float
        Slope of the road G [-], positive uphill.
    """
    return speed * reaction_time + speed**2 / (2 * (deceleration + GRAVITY * grade))


def safe_speed(distance: float, reaction_time: float, deceleration: float, grade: float = 0.0) -> float:
    """Largest speed from which one stops within a distance [m], the inverse of `stopping_sight_distance` [m/s]."""
    braking = deceleration + GRAVITY * grade
    return braking * (math.sqrt(reaction_time**2 + 2 * distance / braking) - reaction_time)


def decelerated_speed(speed: float, target: float, deceleration: float, step_length: float) -> float:
    """Speed after one step [s] of braking to a target [m/s]; a target above the speed, also ``inf``, is returned."""
    return target if math.isinf(target) else max(target, speed - deceleration * step_length)
