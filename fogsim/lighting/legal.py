"""What the rules of the road ask and allow: beams and fog lamps by country, each rule with its source."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

from fogsim.core.parameters import Range, checked_parameters
from fogsim.lighting.rules import CAREFUL, Gallen2014, Metres, Quantile, Seconds
from fogsim.values import Belief, LampChoice, Observation

_FOG_VISIBILITY = 1000.0
"""Visibility below which there is fog, where rules say no more than that [m] (WMO)."""

Country = Literal["germany", "france", "united_kingdom", "unece"]


@dataclass(frozen=True, slots=True)
class LightingLaw:
    """Visibilities at which a country's rules take effect, and where they are written."""

    rear_fog_below: float  # Visibility in fog below which rear fog lamps may be lit [m]
    front_fog_below: float  # The same of front fog lamps [m]
    high_beam_from: float  # Visibility from which on high beams may be lit in the dark [m]
    near_lead: float  # Distance up to which who drives ahead must not be dazzled [m]
    sources: Mapping[str, str]  # Where each rule is written, by the attribute that it sets


_LEAD = "no distance is written; UNECE R48's 100 m"

LAWS: Mapping[Country, LightingLaw] = {
    "germany": LightingLaw(
        rear_fog_below=50.0,
        front_fog_below=150.0,
        high_beam_from=0.0,
        near_lead=100.0,
        sources={
            "rear_fog_below": "StVO § 17(3): only if fog leaves less than 50 m of sight",
            "front_fog_below": "StVO § 17(3): only where fog hinders sight considerably; 150 m is FogSim's reading",
            "high_beam_from": "StVO § 17(2): dipped for who comes or drives close ahead; fog is not named",
            "near_lead": f"StVO § 17(2): 'geringer Abstand'; {_LEAD}",
        },
    ),
    "france": LightingLaw(
        rear_fog_below=_FOG_VISIBILITY,
        front_fog_below=_FOG_VISIBILITY,
        high_beam_from=_FOG_VISIBILITY,
        near_lead=100.0,
        sources={
            "rear_fog_below": "Code de la route R416-7 II: in fog or falling snow; fog by the meteorologists' 1000 m",
            "front_fog_below": "Code de la route R416-7 I: in fog, with dipped beams; also 1000 m",
            "high_beam_from": "Code de la route R416-6: dipped beams in place of high ones where fog reduces sight",
            "near_lead": f"Code de la route R416-6: 'à faible distance'; {_LEAD}",
        },
    ),
    "united_kingdom": LightingLaw(
        rear_fog_below=100.0,
        front_fog_below=100.0,
        high_beam_from=0.0,
        near_lead=100.0,
        sources={
            "rear_fog_below": "Highway Code 226, 236; RVLR 1989 regs 25, 27: sight seriously reduced, generally 100 m",
            "front_fog_below": "the same rules",
            "high_beam_from": "Highway Code 114, 115; RVLR 1989 reg 27: no beam that dazzles; fog is not named",
            "near_lead": f"Highway Code 115: no distance; {_LEAD}",
        },
    ),
    "unece": LightingLaw(
        rear_fog_below=50.0,
        front_fog_below=_FOG_VISIBILITY,
        high_beam_from=_FOG_VISIBILITY,
        near_lead=100.0,
        sources={
            "rear_fog_below": "Vienna Convention on Road Traffic 1968, art. 32: in thick fog; 50 m is FogSim's reading",
            "front_fog_below": "the same: in thick fog, falling snow, heavy rain and the like; also 1000 m",
            "high_beam_from": "the same: dipped, or front fog lamps, where fog reduces sight; also 1000 m",
            "near_lead": "UN Regulation 48 on automatic high beams: who is ahead at 100 m, who comes at 400 m",
        },
    ),
}
"""Rules by country."""


@checked_parameters
@dataclass(frozen=True, slots=True)
class LegalRules:
    """As much light as the rules of a country allow: fog lamps in its fog, high beams where they may be lit.

    Attributes
    ----------
    country : str
        ``germany``, ``france``, ``united_kingdom``, or ``unece`` for the international conventions; see `LAWS`.
    hysteresis : float
        Lamps change back when visibility exceeds the threshold by this share [-].
    dwell : float
        How long other lamps must have been wanted before they are lit [s]; high beams are left at once.
    quantile : float
        A rule about the visibility counts as met only with probability 1 - `quantile` [-].

    Raises
    ------
    InputError
        If the country is none of these, or a parameter is out of the range in its annotation.
    """

    country: Country = "unece"
    hysteresis: Annotated[float, Range(0.0, 10.0)] = 0.2
    dwell: Seconds = 2.0
    quantile: Quantile = CAREFUL

    @property
    def near_lead(self) -> Metres:
        """Distance up to which who drives ahead must not be dazzled [m]."""
        return LAWS[self.country].near_lead

    def choose_lamps(self, belief: Belief, observation: Observation, time: float, previous: LampChoice) -> LampChoice:
        """Choose the lamps to light, low beams while uninformed; see `VehicleLightingPolicy.choose_lamps`."""
        law = LAWS[self.country]
        # The paper's rule, by the thresholds of the country.
        fog_lamps = law.rear_fog_below, law.front_fog_below
        rule = Gallen2014(law.high_beam_from, self.hysteresis, law.near_lead, self.dwell, *fog_lamps, self.quantile)
        return rule.choose_lamps(belief, observation, time, previous)
