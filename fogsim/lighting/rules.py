"""Lamps by rules: dipped beams, fog lamps by visibility, and high beams where no one is dazzled."""

from dataclasses import dataclass
from typing import Annotated

from fogsim.core.parameters import Range, checked_parameters
from fogsim.units import DAY_ILLUMINANCE
from fogsim.values import Belief, Lamp, LampChoice, LampWish, Observation

BY_DAY = Lamp.POSITION | Lamp.LOW_BEAM

Quantile = Annotated[float, Range(0.0, 0.5)]
CAREFUL = 0.25
"""Quantile of the visibility that must allow high beams; the opposite one, 0.75, must call for rear fog lamps."""


@checked_parameters
@dataclass(frozen=True, slots=True)
class FogLampRules:
    """Fog lamps by visibility, with hysteresis.

    Rear fog lamps below 50 m (German StVO § 17(3)); front fog lamps where visibility is seriously reduced, below
    100 m (UK Highway Code rule 226).

    Attributes
    ----------
    rear_fog_below, front_fog_below : float
        Visibility below which the lamps go on [m].
    hysteresis : float
        They go off when visibility exceeds the threshold by this share [-].
    quantile : float
        Rear fog lamps, which dazzle who follows, are lit only if visibility is below the threshold with probability
        1 - `quantile` [-]; front fog lamps by the median.

    Raises
    ------
    InputError
        If a parameter is out of the range in its annotation.
    """

    rear_fog_below: Annotated[float, Range(0.0, 1e6, "m")] = 50.0
    front_fog_below: Annotated[float, Range(0.0, 1e6, "m")] = 100.0
    hysteresis: Annotated[float, Range(0.0, 10.0)] = 0.2
    quantile: Quantile = CAREFUL

    def lamps(self, belief: Belief, previous: Lamp) -> Lamp:
        """Choose the lamps to light, without fog lamps while the belief is uninformed; see `LightingPolicy.lamps`.

        Parameters
        ----------
        belief, previous
            What is believed about the fog, and lamps lit now.
        """
        lit = BY_DAY
        for lamp, threshold, share in (
            (Lamp.REAR_FOG, self.rear_fog_below, 1.0 - self.quantile),
            (Lamp.FRONT_FOG, self.front_fog_below, 0.5),
        ):
            margin = 1.0 + self.hysteresis if lamp in previous else 1.0
            visibility = belief.known_visibility(share)
            if visibility is not None and visibility < threshold * margin:
                lit |= lamp
        return lit


@dataclass(frozen=True, slots=True)
class LowBeamOnly:
    """Dipped headlamps and nothing else, whatever the fog."""

    def lamps(
        self,
        belief: Belief,  # noqa: ARG002 - the protocol's parameters
        previous: Lamp,  # noqa: ARG002 - the protocol's parameters
    ) -> Lamp:
        """Choose the lamps to light; see `LightingPolicy.lamps`.

        Parameters
        ----------
        belief, previous
            What is believed about the fog, and lamps lit now.
        """
        return BY_DAY


HIGH_BEAMS = Lamp.POSITION | Lamp.HIGH_BEAM
"""Lamps of who drives with high beams; `fogsim.lighting.beams.high_beam` is all that such head lamps shine."""

Seconds = Annotated[float, Range(0.0, 60.0, "s")]
Metres = Annotated[float, Range(0.0, 1e6, "m")]


def is_dark(observation: Observation) -> bool:
    """Whether the light sensor measures less light than UNECE R48 lights the dipped beams below; not without one."""
    return observation.light is not None and observation.light.illuminance < DAY_ILLUMINANCE


def _would_dazzle(observation: Observation, near_lead: float) -> bool:
    """Whether high beams might dazzle somebody, as far as the vehicle knows (`near_lead` [m])."""
    light, lead = observation.light, observation.lead
    return light is None or light.oncoming or light.preceding or (lead is not None and lead.distance < near_lead)


def settled(wanted: Lamp, time: float, previous: LampChoice, dwell: float) -> LampChoice:
    """Lamps that follow a wish once it has lasted; high beams are left at once (`time` [s], `dwell` [s])."""
    if wanted == previous.lamps:
        return LampChoice(wanted)
    if Lamp.HIGH_BEAM in previous.lamps and Lamp.HIGH_BEAM not in wanted:
        return LampChoice(wanted)
    wish, change = previous.wish or LampWish(wanted, time), wanted ^ previous.lamps
    # A lamp that is wanted without a break need not wait for another that flickers.
    lasting = change & (wish.lamps ^ previous.lamps)
    wish = LampWish(previous.lamps ^ lasting, wish.since) if lasting else LampWish(wanted, time)
    return LampChoice(wish.lamps) if time - wish.since >= dwell else LampChoice(previous.lamps, wish)


@checked_parameters
@dataclass(frozen=True, slots=True)
class Gallen2014:
    """Low beams in fog below 100 m, high beams above it, and never against anybody who would be dazzled.

    Gallen, Cord, Hautière, Dumont & Aubert (2014), § II-C: below V_met = 100 m high beams show less than low beams do;
    from 100 m on they are preferred. By day, and in a vehicle without a light sensor, low beams. Fog lamps follow
    `FogLampRules`, next to low beams.

    Attributes
    ----------
    low_beam_below : float
        Visibility below which low beams are lit [m].
    hysteresis : float
        High beams are lit once visibility exceeds that by this share [-].
    near_lead : float
        Distance by radar up to which who drives ahead would be dazzled [m]; UNECE R48 asks for 100 m.
    dwell : float
        How long other lamps must have been wanted before they are lit [s]; high beams are left at once.
    rear_fog_below, front_fog_below : float
        Visibility below which fog lamps are lit [m]; see `FogLampRules`.
    quantile : float
        High beams are lit only if visibility is above the threshold with probability 1 - `quantile` [-].

    Raises
    ------
    InputError
        If a parameter is out of the range in its annotation.
    """

    low_beam_below: Metres = 100.0
    hysteresis: Annotated[float, Range(0.0, 10.0)] = 0.2
    near_lead: Metres = 100.0
    dwell: Seconds = 2.0
    rear_fog_below: Metres = 50.0
    front_fog_below: Metres = 100.0
    quantile: Quantile = CAREFUL

    def choose_lamps(self, belief: Belief, observation: Observation, time: float, previous: LampChoice) -> LampChoice:
        """Choose the lamps to light, low beams while uninformed; see `VehicleLightingPolicy.choose_lamps`."""
        visibility = belief.known_visibility(self.quantile)
        if visibility is None:
            return LampChoice(BY_DAY)
        has_high = Lamp.HIGH_BEAM in previous.lamps
        enough = self.low_beam_below * (1.0 if has_high else 1.0 + self.hysteresis)
        high = is_dark(observation) and visibility >= enough and not _would_dazzle(observation, self.near_lead)
        rules = FogLampRules(self.rear_fog_below, self.front_fog_below, self.hysteresis, self.quantile)
        low = rules.lamps(belief, previous.lamps)
        return settled(HIGH_BEAMS | low & Lamp.REAR_FOG if high else low, time, previous, self.dwell)


@dataclass(frozen=True, slots=True)
class AlwaysHigh:
    """High beams and nothing else, whatever the fog and whoever comes: the worst that there is for others."""

    def lamps(
        self,
        belief: Belief,  # noqa: ARG002 - the protocol's parameters
        previous: Lamp,  # noqa: ARG002 - the protocol's parameters
    ) -> Lamp:
        """Choose the lamps to light; see `LightingPolicy.lamps`."""
        return HIGH_BEAMS
