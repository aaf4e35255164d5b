"""How far away the vehicle ahead is seen in a fog: its body, and its rear lamps alone."""

import functools
import math
from dataclasses import dataclass

from fogsim.traffic.drivers.sight import DriverSight
from fogsim.units import DAY_ILLUMINANCE, extinction_from_visibility

_TYPICAL_CONTRAST = 0.9
"""Inherent contrast of a typical rear to the airlight [-]: paint of reflectance 0.25 and a third that is dark."""

_POSITION_LAMP = 8.0
"""Luminous intensity of a rear position lamp [cd]."""

_REFERENCE_LAMP = 2.0
"""Luminous intensity of the rear light whose range gives the visibility by night (White & Jeffery 1980) [cd]."""

_STEPS_PER_E_FOLD = 100


@dataclass(frozen=True, slots=True)
class LeaderReach:
    """Distances up to which drivers see a typical vehicle ahead."""

    # Its body, against the airlight or in the own head lamps [m]; ``inf`` where fog hides nothing that matters
    by_body: float
    farthest: float  # Anything of it, with lit rear position lamps [m]


CLEAR = LeaderReach(math.inf, math.inf)
"""Of drivers who see through fog, and of all in clear air."""


def leader_reach(sight: DriverSight | None, visibility: float) -> LeaderReach:
    """How far away drivers see a typical vehicle ahead in even fog, to half a percent (`visibility` [m])."""
    return CLEAR if sight is None or math.isinf(visibility) else _leader_reach(sight, _step(visibility))


def drivers_visibility(sight: DriverSight | None, visibility: float) -> float:
    """Visibility that drivers go by [m]: the meteorological one by day, in darkness at most the range of a rear lamp.

    White & Jeffery 1980: speeds by night follow those by day if visibility is the distance at which a rear light of 2
    cd is seen.

    Takes `visibility` [m].
    """
    if sight is None or sight.illuminance >= DAY_ILLUMINANCE or math.isinf(visibility):
        return visibility
    return min(visibility, _visibility(sight, _step(visibility)))


def _step(visibility: float) -> int:
    """Number of the step on a logarithmic scale of visibilities, so that few need be computed in uneven fog."""
    return round(_STEPS_PER_E_FOLD * math.log(visibility))


def _extinction(step: int) -> float:
    return extinction_from_visibility(math.exp(step / _STEPS_PER_E_FOLD))


@functools.lru_cache(maxsize=4096)
def _leader_reach(sight: DriverSight, step: int) -> LeaderReach:
    extinction = _extinction(step)
    return LeaderReach(
        by_body=sight.seen_distance(extinction, _TYPICAL_CONTRAST),
        farthest=sight.seen_distance(extinction, _TYPICAL_CONTRAST, _POSITION_LAMP),
    )


@functools.lru_cache(maxsize=4096)
def _visibility(sight: DriverSight, step: int) -> float:
    # By day this is the visibility itself, in darkness the range of the lamp.
    return sight.seen_distance(_extinction(step), 1.0, _REFERENCE_LAMP, head_lamps=0.0)
