"""Lamps by the rules of the road."""

from dataclasses import dataclass
from typing import Annotated

from fogsim.core.parameters import Range, checked_parameters
from fogsim.values import Belief, Lamp

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
