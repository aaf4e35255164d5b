"""What the driver is warned of: fog ahead, too little known, or a camera that does not show the road."""

import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from fogsim.core.kinematics import DECELERATION, REACTION_TIME, stopping_sight_distance
from fogsim.units import visibility_from_extinction
from fogsim.values import Belief, Command, DriverWarning, Observation, WarningMemory
from fogsim.values.belief import NO_FOG, OLDEST


class Delay(NamedTuple):
    """How long there must be reason for a warning before it is given, and how long it stays without [s]."""

    onset: float
    hold: float


_DELAYS: Mapping[DriverWarning, Delay] = {
    DriverWarning.CAMERA_DEGRADED: Delay(onset=0.8, hold=2.0),
    DriverWarning.FOG_AHEAD: Delay(onset=0.0, hold=5.0),
    DriverWarning.CANNOT_SEE: Delay(onset=3.0, hold=2.0),
}
"""Warnings in order of precedence. A frame or two may be lost, and a belief begins with nothing; denser fog is only
announced by several estimates. A camera that fails leaves nothing else to rely on; that fog is ahead says more than
that little is known of it, and at the edge of a bank both hold."""

TAKE_OVER_TIME = 10.0
"""Time before a place at which its fog is warned of [s]: about what drivers need to take over from a system."""

_LIKELY, _CAUTIOUS = 0.5, 0.25
"""Quantile of the believed visibility that must suffice to stop, and of the one that is watched for a fall [-]. Advice
is careful with the lower one; drivers do not heed warnings that are often wrong."""

_EDGE = 3.0
"""Visibility of announced denser fog below which it is warned of, over the distance to stop [-]: what is seen of a bank
is its thin edge. This and the next three were chosen by drives of `motorway_fog_bank` with seeds 101 … 106 and 20 km of
visibility outside the bank, and 80 min in even fog."""

_FALL, _LITTLE = 0.5, 2.0
"""Part of its value of late to which the cautious visibility falls where fog begins, if it is also less than so many
times the distance to stop [-]."""

_FADING = 10.0
"""Time constant with which the visibility of late falls [s]."""


def choose_warning(
    belief: Belief, observation: Observation, time: float, previous: Command
) -> tuple[DriverWarning | None, WarningMemory]:
    """The warning to give at a `time` [s], and what to remember."""
    before = previous.warning_memory
    cautious = belief.known_visibility(_CAUTIOUS)
    late = before.visibility * math.exp(-max(time - before.time, 0.0) / _FADING)
    needed = stopping_sight_distance(observation.speed, REACTION_TIME, DECELERATION)
    reasons = {
        DriverWarning.CAMERA_DEGRADED: bool(observation.camera_trouble),
        DriverWarning.FOG_AHEAD: is_fog_in_the_way(belief, observation.speed)
        or (cautious is not None and cautious < min(_FALL * late, _LITTLE * needed)),
        DriverWarning.CANNOT_SEE: cautious is None,
    }
    since = {one: before.since.get(one, time) for one, is_reason in reasons.items() if is_reason}
    # Clocks round: 0.8 s may be a hair less.
    lasting = {one: time + _DELAYS[one].hold for one in since if time - since[one] >= _DELAYS[one].onset - 1e-9}
    until = {**before.until, **lasting}
    # What a graver warning covered is over with its reason.
    given = (one for one in _DELAYS if until.get(one, time) > time and (one in since or one is previous.warning))
    return next(given, None), WarningMemory(time, since, until, max(late, min(cautious or 0.0, NO_FOG)))


def is_fog_in_the_way(belief: Belief, speed: float) -> bool:
    """Whether denser fog is announced, or a driver will likely see less far than it takes to stop (`speed` [m/s]).

    The fog counts that is seen, and that at all places which the vehicle reaches within `TAKE_OVER_TIME`, as far as the
    belief knows of them. Where one sees less far than it takes to stop, the confidence of an image of an obstacle at
    that distance, e^(−2kd) of huang2015 (section 4.3.2), is below e^(−2 ln 20) = 1/400: no detector finds it, and the
    driver has to take over (section 1.2).
    """
    needed = stopping_sight_distance(speed, REACTION_TIME, DECELERATION)
    if belief.denser is not None and visibility_from_extinction(belief.denser.extinction) < _EDGE * needed:
        return True
    return any(seen < needed for seen in _likely_visibilities(belief, speed * TAKE_OVER_TIME))


def _likely_visibilities(belief: Belief, reach: float) -> Iterator[float]:
    """Visibilities to act on [m]: of the fog that is seen, and at the places up to a distance ahead [m]."""
    if (seen := belief.known_visibility(_LIKELY)) is not None:
        yield seen
    if belief.profile is None or belief.age > OLDEST:
        return
    distances = belief.profile.distance
    # NaN, where too little is known, is below no distance.
    yield from belief.profile.known_visibilities(_LIKELY)[(distances >= 0.0) & (distances <= reach)].tolist()
