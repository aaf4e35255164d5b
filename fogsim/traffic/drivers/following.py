"""How drivers follow the vehicle ahead in fog: published kinds of drivers, mixed in a population.

Above some speed fog parts drivers into those who keep the leader in sight, at headways shorter than recommended, and
those who fall back out of sight (Broughton, Switzer & Scott 2007, at 22.4 m/s and not at 13.4 m/s; the first are the
most, AAA Foundation 2014). The speed is the one at which the recommended headway is as long as one sees: slower, both
see their leader anyway. Of the sources only abstracts and summaries have been seen.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from fogsim.core.registry import Registry
from fogsim.traffic.drivers.sight import LeaderReach

CATCHING_UP = 5.0
"""Who keeps up with a leader is ready to drive so much faster, as IDM must be to hold a gap [m/s]; FogSim's own."""

_RECOMMENDED_HEADWAY = 2.0
"""Time headway that traffic education recommends [s] (the two-second rule)."""


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What a driver's wish of a headway depends on."""

    visibility: float  # Visibility that drivers go by [m]
    reach: LeaderReach  # How far away they see a vehicle ahead
    speed: float  # Their speed [m/s]
    minimum_gap: float  # Gap that they keep at a standstill [m]


@dataclass(frozen=True, slots=True)
class FollowingModel:
    """How one kind of driver follows: this one as in clear air.

    So do drivers on a time schedule (van der Hulst, Rothengatter & Meijman 1998), and on the whole the traffic on a
    Dutch motorway: following distances fell by no more than speeds did (Hogema & van der Horst 1994).
    """

    # Whether they drive as fast as a leader whom they see, where by themselves they would be slower in fog
    keeps_up: bool = field(default=False, kw_only=True)
    # Gap that they do not exceed, as a share of how far away they see the leader [-]; ``inf`` if they do
    kept_share: float = field(default=math.inf, kw_only=True)

    def headway(self, own: float, around: Surroundings) -> float:  # noqa: ARG002 - kinds of drivers look around
        """Time headway that is wanted [s], over which the minimum gap comes (`own` [s])."""
        return own

    def top_speed(self, reach: LeaderReach) -> float:  # noqa: ARG002 - kinds of drivers look around
        """Speed that they do not exceed so as not to come too near [m/s]; ``inf`` for none."""
        return math.inf


@dataclass(frozen=True, slots=True)
class InSight(FollowingModel):
    """Keep the leader in sight, at whatever headway that takes, and keep up with it (Broughton et al. 2007).

    Closing in until the outline is well seen shortens the time to notice that the gap changes (Caro, Cavallo et al.
    2009), and spares the driver the search for the road (Saffarian, Happee & de Winter 2012).
    """

    shortest: float = 0.5  # No headway is shorter for that [s]; so much is FogSim's own, and so is the share of sight
    keeps_up: bool = field(default=True, kw_only=True)
    kept_share: float = field(default=0.7, kw_only=True)

    def headway(self, own: float, around: Surroundings) -> float:
        """Headway at which the leader is in sight, at most the own one [s]."""
        farthest = self.kept_share * around.reach.farthest - around.minimum_gap
        if own * around.speed <= farthest:
            return own
        return min(own, max(farthest / around.speed, self.shortest))


@dataclass(frozen=True, slots=True)
class _Careful(FollowingModel):
    """Lengthen the headway in fog, towards the recommended one, where there is no hurry.

    Drivers without time pressure keep longer headways where they see less far ahead (van der Hulst, Rothengatter &
    Meijman 1998, 1999). By how much is FogSim's own: linear in visibility to the recommended one.
    """

    recommended: float = _RECOMMENDED_HEADWAY  # Headway in dense fog, unless the own one is longer [s]
    unaffected_above: float = 200.0  # Visibility from which the headway is that of clear air [m]
    dense: float = 50.0  # Visibility up to which the headway is the recommended one [m]

    def headway(self, own: float, around: Surroundings) -> float:
        """Headway that grows in fog [s]."""
        density = (self.unaffected_above - around.visibility) / (self.unaffected_above - self.dense)
        return own + max(self.recommended - own, 0.0) * min(max(density, 0.0), 1.0)


@dataclass(frozen=True, slots=True)
class OutOfSight(_Careful):
    """Fall back out of sight where the recommended headway is longer than one sees (Broughton et al. 2007).

    They drive no faster than at a speed at which they see as far ahead as the recommended headway takes them, and let a
    faster leader go; in sight of a leader they are `_Careful`.
    """

    def top_speed(self, reach: LeaderReach) -> float:
        """Speed at which the recommended headway is as long as they see [m/s]."""
        return reach.farthest / self.recommended


FOLLOWING_MODELS: Registry[FollowingModel] = Registry(
    "following model",
    {"unaffected": FollowingModel(), "in_sight": InSight(), "careful": _Careful(), "out_of_sight": OutOfSight()},
)

OBSERVED_MIXTURE: Mapping[str, float] = {"in_sight": 0.5, "unaffected": 0.2, "careful": 0.15, "out_of_sight": 0.15}
"""Shares of the kinds of drivers, by name; those in sight are the most, the sizes are FogSim's own."""


def misjudged_headway(wanted: float, around: Surroundings, misjudgement: float) -> float:
    """Time headway that is kept by drivers who take distances for longer where only lamps are seen [s].

    They close in until the gap looks like the wanted one, but no farther than to where the outline is seen and
    distances are judged rightly (overestimates of 30 to 60 % where only the lamps show: Cavallo, Colomb & Doré 2001;
    shorter headways at a visibility of 30 m: Cavallo & Beaudoin; closing in until the outline shows: Caro, Cavallo et
    al. 2009).
    """
    gap = wanted * around.speed + around.minimum_gap
    if misjudgement == 0.0 or gap <= around.reach.by_body or around.speed <= 0.0:
        return wanted
    kept = max(gap / (1.0 + misjudgement), around.reach.by_body)
    return max(min((kept - around.minimum_gap) / around.speed, wanted), 0.0)
