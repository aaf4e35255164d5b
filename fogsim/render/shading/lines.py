"""Painted lines next to a lane: which pixels of a span come near one, and how much of a dashed one is paint."""

import math

import numpy as np

from fogsim.core.jit import kernel

LINE_WIDTH = 0.2
"""Width of a line [m]."""

DASH, PERIOD = 6.0, 18.0
"""Length of a dash, and of a dash with the gap after it [m]."""


@kernel
def columns_near(away: float, change: float, reach: float, size: int) -> tuple[int, int]:
    """First of the pixels of a span that lie within reach of a line, and the one after the last."""
    if abs(change) * size <= 1e-9 * reach:  # the row spans along the line
        return 0, size if abs(away) < reach else 0
    per_change = 1.0 / change
    middle, half = -away * per_change, reach * abs(per_change)
    end = size - 1.0
    first, last = np.ceil(min(end + 1.0, max(0.0, middle - half))), np.floor(min(end, max(-1.0, middle + half)))
    return int(first), int(max(last + 1.0, first))


@kernel
def dashed_share(along: float, length: float) -> float:
    """Share of a footprint that dashes cover, from the place of its middle along the line and its length [m].

    Takes `along` [m], `length` [m].
    """
    length = max(length, 1e-4)
    start = along - 0.5 * length
    return (_painted_below(start + length) - _painted_below(start)) / length


@kernel
def _painted_below(x: float) -> float:
    """Length of what lies below x of dashes that start at multiples of their period [m]."""
    periods = math.floor(x / PERIOD)
    return periods * DASH + min(x - PERIOD * periods, DASH)
