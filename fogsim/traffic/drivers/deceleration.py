"""How a vehicle comes down to a speed that it is told."""

import math


def governed_speed(speed: float, target: float, deceleration: float, step_length: float) -> float:
    """Speed to ask of a vehicle for the next step so that it approaches a target without braking harder than told.

    Parameters
    ----------
    speed : float
        Its speed now [m/s].
    target : float
        Speed that it should come to [m/s]; ``inf`` for no limit.
    deceleration : float
        Largest deceleration to use [m/s²], positive.
    step_length : float
        Time to the next step [s].

    Returns
    -------
    float
        Speed to ask for [m/s]; ``inf`` for none. Speeding up is left to the vehicle's own acceleration.
    """
    if math.isinf(target):
        return target
    return max(target, speed - deceleration * step_length)
