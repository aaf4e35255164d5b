"""Which traffic steps SUMO can make."""

import math

from fogsim.scenario.schema import Clocks
from fogsim.traffic.sumo.loaded_files import CLOCK_TICK

_ROUNDING = 1e-6  # of a tick: what writing a number in decimals may cost


def uncountable_step(clocks: Clocks) -> str | None:
    """Say why SUMO cannot make a traffic step, and the nearest that it can; None if it can.

    SUMO would make a step of whole milliseconds in its place, and times and speeds would disagree from then on.
    """
    step, camera = clocks.traffic_step_s / CLOCK_TICK, clocks.camera_period_s / CLOCK_TICK
    if step > 0.5 and _is_whole(step):
        return None
    ticks = [math.floor(step), math.ceil(step)]
    if _is_whole(camera):
        fitting = [tick for tick in range(1, math.isqrt(round(camera)) + 1) if round(camera) % tick == 0]
        fitting += [round(camera) // tick for tick in fitting]
        ticks = [max((t for t in fitting if t < step), default=0), min(t for t in fitting if t > step)]
    nearest = " or ".join(f"{tick * CLOCK_TICK:g}" for tick in ticks if tick)
    return (
        f"SUMO counts time in whole milliseconds, and camera_period_s, {clocks.camera_period_s:g} s, must be a whole "
        f"multiple of this; nearest: {nearest} s; got {clocks.traffic_step_s!r}"
    )


def _is_whole(ticks: float) -> bool:
    return abs(ticks - round(ticks)) < _ROUNDING
