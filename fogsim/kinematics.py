"""Stopping: the formulas that advice and metrics share."""

import math

from fogsim.units import GRAVITY

REACTION_TIME, DECELERATION = 2.5, 3.4
"""Design values of the stopping sight distance [s], [m/s²] (AASHTO Green Book), where nothing else is said."""


def stopping_sight_distance(speed: float, reaction_time: float, deceleration: float, grade: float = 0.0) -> float:
    """Distance to react and stop, v t + v² / 2(a + g G) [m] (AASHTO Green Book with t = 2.5 s, a = 3.4 m/s²).

    Parameters
    ----------
    speed : float
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
    """Largest speed from which one stops within a distance, the inverse of `stopping_sight_distance` [m/s].

    Parameters
    ----------
    distance : float
        Sight distance [m], not negative; ``inf`` gives ``inf``.
    reaction_time, deceleration, grade : float
        As in `stopping_sight_distance`.
    """
    braking = deceleration + GRAVITY * grade
    return braking * (math.sqrt(reaction_time**2 + 2 * distance / braking) - reaction_time)
