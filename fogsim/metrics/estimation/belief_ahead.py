"""How right the belief about places ahead was, and how early dense fog was known and the driver warned."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from fogsim.core.kinematics import DECELERATION, REACTION_TIME, stopping_sight_distance
from fogsim.metrics.estimation.errors import FOG_LIMIT, quantile, relative_error
from fogsim.metrics.metric import Definition, JsonValue, Sample, definitions_of, share
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY, visibility_from_extinction
from fogsim.values import DriverWarning, FogBank, Step

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


_LONGEST_LEAD = 1000.0
"""Distance before a bank from which on a warning counts as one of it [m]."""

REASON_WITHIN = 500.0
"""Distance ahead within which there must be fog for a warning to be no false one [m]."""

MUCH_DENSER = 2.0
"""Extinction ahead over that at the camera from which on the fog ahead is denser [-]."""


@dataclass(slots=True)
class FogWarnings:
    """Leads of warnings before banks, false warnings, and the time under each of the others."""

    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("fog_warnings")
    _time: float = 0.0
    _times: dict[DriverWarning, float] = field(default_factory=lambda: dict.fromkeys(DriverWarning, 0.0))
    _before: DriverWarning | None = None
    _had_reason: bool = False
    _false: int = 0
    _warned: deque[float] = field(default_factory=deque)
    _ahead: dict[int, bool] = field(default_factory=dict)
    _leads: list[float] = field(default_factory=list)

    def update(self, sample: Sample) -> None:
        """Add one step."""
        step, warning = sample.step, sample.step.command.warning
        self._time += sample.elapsed
        if warning is not None:
            self._times[warning] += sample.elapsed
        is_fog = warning is DriverWarning.FOG_AHEAD
        # A warning is decided after the step before.
        is_reason = _has_reason(step)
        if is_fog and self._before is not warning and not (is_reason or self._had_reason):
            self._false += 1
        self._before, self._had_reason = warning, is_reason
        self._enter_banks(step)
        if is_fog and not any(_is_inside(step, bank) for bank in _banks(step)):
            self._warned.append(step.route_position)

    def _enter_banks(self, step: Step) -> None:
        """Note the lead of each bank once half its density is reached."""
        while self._warned and self._warned[0] < step.route_position - _LONGEST_LEAD:
            self._warned.popleft()
        for number, bank in enumerate(_banks(step)):
            along = _along(step, bank)
            if along < bank.start:
                self._ahead[number] = True
            elif self._ahead.pop(number, False) and _is_hazard(step, bank):
                self._leads.append(step.route_position - self._warned[0] if self._warned else 0.0)
                self._warned.clear()

    def result(self) -> dict[str, JsonValue]:
        """Say leads, false warnings and shares of the time."""
        return {
            "fog_warning_lead_m": share(sum(self._leads), len(self._leads)),
            "fog_banks_entered": len(self._leads),
            "fog_banks_without_warning": sum(lead == 0.0 for lead in self._leads),
            "false_fog_warnings": self._false,
            "false_fog_warnings_per_h": share(3600.0 * self._false, self._time),
            "fog_ahead_time_share": share(self._times[DriverWarning.FOG_AHEAD], self._time),
            "cannot_see_time_share": share(self._times[DriverWarning.CANNOT_SEE], self._time),
            "camera_degraded_time_share": share(self._times[DriverWarning.CAMERA_DEGRADED], self._time),
        }


def _has_reason(step: Step) -> bool:
    """Whether the truth gives reason to warn of fog ahead.

    That is: here or up to `REASON_WITHIN` ahead, one cannot stop within sight at the present speed, or the extinction
    is at least `MUCH_DENSER` times that at the camera, in fog of less than 1000 m.
    """
    truth, speed = step.truth, float(step.traffic.speed[step.ego])
    most = visibility_from_extinction(stopping_sight_distance(speed, REACTION_TIME, DECELERATION))
    if max(truth.extinction, truth.extinction_ahead) > most:
        return True
    if truth.profile is None:
        return False
    near = (truth.profile.distance >= 0.0) & (truth.profile.distance <= REASON_WITHIN)
    densest = float(np.exp(truth.profile.log_extinction[near]).max(initial=0.0))
    is_denser = densest >= MUCH_DENSER * truth.extinction and visibility_from_extinction(densest) < FOG_LIMIT
    return densest > most or is_denser


def _banks(step: Step) -> tuple[FogBank, ...]:
    return () if step.truth.fog is None else step.truth.fog.banks


def _along(step: Step, bank: FogBank) -> float:
    """How far along a bank's axis the ego is [m]."""
    east, north, _ = step.traffic.position[step.ego]
    return float((east - bank.origin[0]) * bank.axis[0] + (north - bank.origin[1]) * bank.axis[1])


def _is_inside(step: Step, bank: FogBank) -> bool:
    return bank.start <= _along(step, bank) <= bank.end


def _is_hazard(step: Step, bank: FogBank) -> bool:
    """Whether one cannot stop within sight inside a bank at the speed limit."""
    outside = 0.0 if step.truth.fog is None else step.truth.fog.extinction
    needed = stopping_sight_distance(step.speed_limit, REACTION_TIME, DECELERATION)
    return bank.extra_extinction > 0.0 and visibility_from_extinction(outside + bank.extra_extinction) < needed
