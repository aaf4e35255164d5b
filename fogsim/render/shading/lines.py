"""Painted lines beside a lane: what of a pixel's footprint they cover, and which pixels of a run come near one."""

import math

import numpy as np

from fogsim.jit import kernel

_LINE_WIDTH, _DASH, _PERIOD = 0.2, 6.0, 18.0
_ANYWHERE = 1e6  # wider than any lane [m]


@kernel
def _painted_below(x: float) -> float:
    """Length of what lies below x of dashes that start at multiples of their period [m]."""
    return math.floor(x / _PERIOD) * _DASH + min(x - _PERIOD * math.floor(x / _PERIOD), _DASH)


@kernel
def line_share(code: int, middle: float, along: float, across: float, length: float, width: float) -> float:
    """Share of a footprint that a painted line covers.

    Parameters
    ----------
    code : int
        1 for a solid line, 2 for a dashed one.
    middle : float
        Where the middle of the line is, to the left of the lane's [m].
    along, across, length, width : float
        Middle and extents of the footprint along and across the lane [m].
    """
    low = max(across - 0.5 * width, middle - 0.5 * _LINE_WIDTH)
    high = min(across + 0.5 * width, middle + 0.5 * _LINE_WIDTH)
    share = max(high - low, 0.0) / width
    if code == 1 or share == 0.0:
        return share
    start = along - 0.5 * length
    return share * (_painted_below(start + length) - _painted_below(start)) / length


@kernel
def reach_of(across: float, change: float) -> float:
    """How far from the middle of a line a footprint's middle may be that still touches it [m].

    `across` is the greatest extent of a footprint in the middle of the line [m], and `change` how much greater it is at
    most for each metre beside it.
    """
    return 1.01 * (_LINE_WIDTH + across) / (2.0 - change) if change < 1.0 else _ANYWHERE


@kernel
def columns_between(
    t_base: float, tx: float, base: float, zx: float, low: float, high: float, size: int
) -> tuple[int, int]:
    """First pixel of a run, and the one after the last, that lie from `low` to `high` to the left of the lane's middle.

    Over the run's columns the place t / z on the lane and 1 / z are linear, so each end is where a line crosses zero.
    """
    first, after = 0.0, float(size)
    for rest, slope in ((t_base - low * base, tx - low * zx), (high * base - t_base, high * zx - tx)):
        if slope > 0.0:
            first = max(first, np.ceil(-rest / slope))
        elif slope < 0.0:
            after = min(after, np.floor(-rest / slope) + 1.0)
        elif rest < 0.0:
            after = 0.0
    after = max(after, 0.0)
    return int(min(first, after)), int(after)
