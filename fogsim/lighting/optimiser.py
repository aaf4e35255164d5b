"""Lamps that show most for the glare that they cost."""

import math
from dataclasses import dataclass
from typing import Annotated

from fogsim.core.parameters import Range, checked_parameters
from fogsim.lighting.own_sight import headlamp_sight_distance
from fogsim.lighting.rules import BY_DAY, CAREFUL, HIGH_BEAMS, FogLampRules, Quantile, Seconds, is_dark, settled
from fogsim.units import extinction_from_visibility
from fogsim.values import Belief, Lamp, LampChoice, Observation
from fogsim.values.eye import disability_glare

_MEETING_DISTANCE, _MEETING_ANGLE = 50.0, math.radians(4.0)
"""Where the policy takes a driver to be who meets it: at 50 m, 3.5 m aside [m], [rad]."""

_LEAD_DISTANCE, _MIRROR_ANGLE, _MIRROR_SHARE = 50.0, math.radians(40.0), 0.8
"""Assumed range of the driver ahead without a radar range [m], the angle at which that driver's mirrors are
[rad], and how much light they send on [-]."""

_TOWARD = {Lamp.LOW_BEAM: (1000.0, 1200.0), Lamp.HIGH_BEAM: (32_000.0, 66_000.0)}
"""What both head lamps shine toward the eyes of who meets them, and into the mirrors of who is ahead [cd]."""


@checked_parameters
@dataclass(frozen=True, slots=True)
class SightOptimiser:
    """The beam that shows a small object farthest, minus a price for the glare that it deals to who is there.

    By night it reckons for low and for high beams the distance at which visibility level 7 is reached in the fog as
    believed (`fogsim.lighting.own_sight`), minus `price` for the veil that they would lay over the eyes of a driver who
    meets it at 50 m, if the light sensor detects head lamps, and of one ahead, if it detects tail lamps or the radar
    a vehicle. Fog lamps follow `FogLampRules`, next to low beams.

    Attributes
    ----------
    price : float
        Distance that a veil of 1 cd/m² in another's eye is worth [m per cd/m²].
    advantage : float
        By how much other beams must be better before they are wanted [m].
    dwell : float
        How long they must have been wanted before they are lit [s]; high beams are left at once.
    quantile : float
        Quantile of the visibility that high beams are chosen by [-].

    Raises
    ------
    InputError
        If a parameter is out of the range in its annotation.
    """

    price: Annotated[float, Range(0.0, 1e6, "m per cd/m²")] = 20.0
    advantage: Annotated[float, Range(0.0, 1e4, "m")] = 2.0
    dwell: Seconds = 2.0
    quantile: Quantile = CAREFUL

    def choose_lamps(self, belief: Belief, observation: Observation, time: float, previous: LampChoice) -> LampChoice:
        """Choose the lamps to light, low beams while uninformed; see `VehicleLightingPolicy.choose_lamps`."""
        known = belief.known_visibility(self.quantile)
        if known is None:
            return LampChoice(BY_DAY)
        rules = FogLampRules(quantile=self.quantile)
        low = rules.lamps(belief, previous.lamps)
        if not is_dark(observation):
            return settled(low, time, previous, self.dwell)
        # Belief moves a little in every frame; the sight that it allows need not be reckoned again for that.
        visibility = math.exp(round(math.log(known), 2))
        worth = {beam: self._worth(beam, visibility, observation) for beam in _TOWARD}
        lead = worth[Lamp.HIGH_BEAM] - worth[Lamp.LOW_BEAM]
        high = lead > (-self.advantage if Lamp.HIGH_BEAM in previous.lamps else self.advantage)
        return settled(HIGH_BEAMS | low & Lamp.REAR_FOG if high else low, time, previous, self.dwell)

    def _worth(self, beam: Lamp, visibility: float, observation: Observation) -> float:
        """Sight by a beam minus the price of its glare [m]."""
        return headlamp_sight_distance(beam, visibility) - self.price * glare_dealt(beam, visibility, observation)


def glare_dealt(beam: Lamp, visibility: float, observation: Observation) -> float:
    """Veil that a beam would lay over the eyes of those whom the vehicle knows of [cd/m²] (`visibility` [m])."""
    light, lead, k = observation.light, observation.lead, extinction_from_visibility(visibility)
    toward, into_mirrors = _TOWARD[beam]
    veil = 0.0
    if light is None or light.oncoming:
        at_eye = toward * math.exp(-k * _MEETING_DISTANCE) / _MEETING_DISTANCE**2
        veil += float(disability_glare(at_eye, _MEETING_ANGLE))
    if lead is not None or (light is not None and light.preceding):
        distance = max(lead.distance, 5.0) if lead is not None else _LEAD_DISTANCE
        in_mirror = _MIRROR_SHARE * into_mirrors * math.exp(-k * distance) / distance**2
        veil += float(disability_glare(in_mirror, _MIRROR_ANGLE))
    return veil
