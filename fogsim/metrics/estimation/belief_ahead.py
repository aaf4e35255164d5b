"""How right the belief about places ahead was, and how early dense fog was known."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from fogsim.metrics.estimation.errors import FOG_LIMIT, quantile, relative_error
from fogsim.metrics.metric import Definition, JsonValue, Sample, definitions_of, share
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import Step

_PLACES = (100, 200)
"""Distances ahead at which a belief about places is held against the fog there [m]."""

_DENSE_FOG = 150.0
"""Visibility below which fog is dense [m]."""

_KNOWN_FOG = 300.0
"""Believed visibility below which dense fog is known [m]."""

_BEHIND_EDGE = 50.0
"""How far behind the place where dense fog begins the belief is asked for [m]: edges are not known to the metre."""

_INTO_FOG = 300.0
"""How far into dense fog it is still asked when it was known [m]."""


@dataclass(slots=True)
class BeliefAheadError:
    """Error of what is believed of places ahead, where the fog there is below 1000 m."""

    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("belief_ahead")
    _errors: dict[int, list[float]] = field(default_factory=lambda: {distance: [] for distance in _PLACES})
    _held: dict[int, int] = field(default_factory=lambda: dict.fromkeys(_PLACES, 0))

    def update(self, sample: Sample) -> None:
        """Add one step."""
        believed, true = sample.step.belief.profile, sample.step.truth.profile
        if believed is None or true is None or not true.distance.size:
            return
        for distance in _PLACES:
            truth = true.visibility_quantile(distance, 0.5)
            if distance > true.distance[-1] or truth >= FOG_LIMIT:
                continue
            low, middle, high = (believed.visibility_quantile(distance, one) for one in (0.05, 0.5, 0.95))
            self._errors[distance].append(relative_error(middle, truth))
            self._held[distance] += low <= truth <= high

    def result(self) -> dict[str, JsonValue]:
        """Say error and coverage at each distance."""
        results: dict[str, JsonValue] = {}
        for distance in _PLACES:
            errors = self._errors[distance]
            results[f"belief_{distance}_m_ahead_median_error_percent"] = quantile(errors, 0.5)
            results[f"belief_{distance}_m_ahead_coverage_share"] = share(self._held[distance], len(errors))
        return results


@dataclass(slots=True)
class DenseFogKnown:
    """How far before dense fog it was known, and known from then on."""

    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("dense_fog_known")
    _begins: float | None = None
    _known: float | None = None
    _found: list[float] = field(default_factory=list)

    def update(self, sample: Sample) -> None:
        """Add one step."""
        step = sample.step
        if self._begins is None:
            self._begins, self._known = _dense_fog_ahead(step), None
        if self._begins is None:
            return
        ahead = self._begins - step.route_position
        if ahead < -_INTO_FOG or (ahead < -_BEHIND_EDGE and step.truth.visibility >= _DENSE_FOG):
            self._found.append(-_INTO_FOG if self._known is None else self._known)
            self._begins = None
            return
        profile = step.belief.profile
        believed = (
            step.belief.visibility_quantile(0.5)
            if profile is None
            else profile.visibility_quantile(max(ahead + _BEHIND_EDGE, 0.0), 0.5)
        )
        if believed >= _KNOWN_FOG:
            self._known = None
        elif self._known is None:
            self._known = ahead

    def result(self) -> dict[str, JsonValue]:
        """Say how far before it."""
        return {"dense_fog_known_before_m": quantile(self._found, 0.5)}


def _dense_fog_ahead(step: Step) -> float | None:
    """Where on the route dense fog begins ahead of an ego that is not in it [m]."""
    true = step.truth.profile
    if true is None or step.truth.visibility < _DENSE_FOG:
        return None
    ahead = true.distance >= 0.0
    dense = np.flatnonzero(ahead & (true.log_extinction > np.log(OPTICAL_DEPTH_AT_VISIBILITY / _DENSE_FOG)))
    return None if not dense.size else step.route_position + float(true.distance[dense[0]])
