"""Speeds of successive sections of road that fall towards fog in steps, so that no one brakes hard."""

import math
from collections.abc import Sequence


def harmonised_speeds(
    speeds: Sequence[float],
    lengths: Sequence[float],
    limits: Sequence[float],
    largest_step: float,
    deceleration: float,
) -> tuple[float, ...]:
    """Advised speeds, lowered where the next section downstream is advised much less.

    A section shows no more than the next one and a step, and no more than √(v² + 2 a d), from which a steady
    deceleration a along its length d comes down to the next one's v. Motorways do the same: Dutch gantries by 20
    km/h (90, 70, 50), I-77 in Virginia by at most 15 mph from sign to sign (VTRC 19-R6, 2018).

    Takes `speeds` [m/s], `lengths` [m], `limits` [m/s], `largest_step` [m/s], `deceleration` [m/s²].
    """
    shown, down = list(speeds), speeds[-1] if speeds else math.inf
    for place in reversed(range(len(shown) - 1)):
        reached = min(down + largest_step, math.sqrt(down**2 + 2.0 * deceleration * lengths[place]))
        if reached < limits[place]:
            shown[place] = min(shown[place], reached)
        # A section whose limit says more than the step hides the step, and hides none of those upstream of it.
        down = min(speeds[place], reached)
    return tuple(shown)
