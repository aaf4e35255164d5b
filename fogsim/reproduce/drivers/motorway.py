"""A motorway's traffic at a cross-section.

Two lanes; vehicles come at random (Poisson), 12 % of them are lorries. Nothing stands in the way.
"""

import math

from fogsim.reproduce.drivers.passages import Passages, passages
from fogsim.reproduce.drivers.road import EDGE, passed
from fogsim.values import Command, Display, Stretch, StretchAdvice

_WARM_UP = 300.0
"""Before this time nothing counts: the road fills [s]."""

_HEADWAYS = (0.5, 0.8, 1.1, 1.5, 2.0)
"""Gaps that drivers of cars keep in clear air, of equal shares [s]: field headways spread about as much."""

_LORRIES = 0.12
"""Share of lorries, which drive at most 90 km/h."""


def drive(
    overrides: tuple[str, ...], demand: float, visibility: float, seed: int, seconds: float, advised: float = math.inf
) -> Passages:
    """Vehicles that pass the loops, by demand on both lanes [1/h], visibility [m], seconds and advised speed [m/s]."""
    signs = StretchAdvice(advised, Stretch(edges=(EDGE,)), Display.MESSAGE_SIGN)
    command = Command(stretches=(signs,)) if math.isfinite(advised) else Command()
    seen = passed(overrides, 2, _demand(demand), visibility, seed, _WARM_UP + seconds, command)
    return passages(seen, since=_WARM_UP)


def _demand(demand: float) -> str:
    cars = "".join(
        f'<vType id="car{i}" vClass="passenger" tau="{headway}" speedFactor="normc(1,0.1,0.7,1.3)" '
        f'probability="{(1.0 - _LORRIES) / len(_HEADWAYS)}"/>'
        for i, headway in enumerate(_HEADWAYS)
    )
    return (
        f'<vTypeDistribution id="mixed">{cars}<vType id="lorry" vClass="truck" length="12" maxSpeed="25" '
        f'tau="1.8" speedFactor="normc(1,0.05,0.8,1.2)" probability="{_LORRIES}"/></vTypeDistribution>'
        f'<flow id="f" type="mixed" route="r" begin="0" end="1000000" period="exp({demand / 3600.0})" '
        'departLane="random" departSpeed="max" departPos="base"/>'
    )
