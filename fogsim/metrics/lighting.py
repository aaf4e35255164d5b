"""What the ego's lamps were worth by night: how far they let the ego see, and the glare that they dealt to others."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from fogsim.metrics.metric import Definition, JsonValue, Sample, definitions_of, share
from fogsim.units import clock_time
from fogsim.values import Lamp

_DAZZLED_FROM = 1.0
"""Veil from which a driver counts as dazzled [cd/m²]: three times what the low beams of one car on the next lane
lay over the eye at most, and more than the fog in the own low beams does."""


@dataclass(slots=True)
class Lighting:
    """Benefit and cost of the ego's lamps, in the time in which it was darker than 1000 lx."""

    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("lighting")
    _time: float = 0.0
    _sight_time: float = 0.0
    _least_sight: float | None = None
    _high_time: float = 0.0
    _dazzling_time: float = 0.0
    _dazzled_time: float = 0.0
    _most_veil: float | None = None

    def update(self, sample: Sample) -> None:
        """Add one step."""
        effects = sample.step.truth.lamp_effects
        if effects is None:
            return
        dazzled = sum(veil >= _DAZZLED_FROM for veil in effects.veils)
        self._time += sample.elapsed
        self._sight_time += effects.own_sight * sample.elapsed
        self._least_sight = min(
            effects.own_sight, effects.own_sight if self._least_sight is None else self._least_sight
        )
        if int(sample.step.traffic.lamps[sample.step.ego]) & int(Lamp.HIGH_BEAM):
            self._high_time += sample.elapsed
        if dazzled:
            self._dazzling_time += sample.elapsed
        self._dazzled_time += dazzled * sample.elapsed
        if effects.veils:
            most = max(effects.veils)
            self._most_veil = most if self._most_veil is None else max(self._most_veil, most)

    def result(self) -> dict[str, JsonValue]:
        """Say what they showed and whom they dazzled."""
        return {
            "mean_own_sight_m": share(self._sight_time, self._time),
            "minimum_own_sight_m": self._least_sight,
            "high_beam_time_share": share(self._high_time, self._time),
            "glare_dealt_time_share": share(self._dazzling_time, self._time),
            "glare_dealt_s": clock_time(self._dazzled_time) if self._time > 0.0 else None,
            "max_glare_dealt_cdpm2": self._most_veil,
        }
