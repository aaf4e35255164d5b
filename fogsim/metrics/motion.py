"""How the ego drove: time, distance, speed, comfort, and whether it kept to the advice."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from fogsim.metrics.metric import Definition, JsonValue, Sample, definitions_of, share
from fogsim.units import clock_time


@dataclass(slots=True)
class Motion:
    """Duration, distance and speed of the ego."""

    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("motion")
    _steps: int = 0
    _duration: float = 0.0
    _start: float = 0.0
    _position: float = 0.0
    _max_speed: float = 0.0

    def update(self, sample: Sample) -> None:
        """Add one step."""
        step = sample.step
        if self._steps == 0:
            self._start = step.route_position
        self._steps += 1
        self._duration += sample.elapsed
        self._position = step.route_position
        self._max_speed = max(self._max_speed, float(step.traffic.speed[step.ego]))

    def result(self) -> dict[str, JsonValue]:
        """Say how far and how fast the ego went."""
        distance = self._position - self._start
        return {
            "duration_s": clock_time(self._duration),
            "distance_m": distance,
            "mean_speed_mps": share(distance, self._duration),
            "max_speed_mps": self._max_speed if self._steps else None,
            "steps": self._steps,
        }


@dataclass(slots=True)
class Comfort:
    """Braking and jerk of the ego; the jerk is the change of acceleration between steps."""

    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("comfort")
    _max_deceleration: float | None = None
    _previous: float | None = None
    _squared_jerk_time: float = 0.0
    _time: float = 0.0

    def update(self, sample: Sample) -> None:
        """Add one step."""
        acceleration = float(sample.step.traffic.acceleration[sample.step.ego])
        self._max_deceleration = max(self._max_deceleration or 0.0, -acceleration)
        if self._previous is not None and sample.elapsed > 0:
            self._squared_jerk_time += (acceleration - self._previous) ** 2 / sample.elapsed
            self._time += sample.elapsed
        self._previous = acceleration

    def result(self) -> dict[str, JsonValue]:
        """Say how rough the drive was."""
        mean_square = share(self._squared_jerk_time, self._time)
        return {
            "max_deceleration_mps2": self._max_deceleration,
            "rms_jerk_mps3": None if mean_square is None else math.sqrt(mean_square),
        }


@dataclass(slots=True)
class Compliance:
    """Speed against the advice in force, over the time in which there was one."""

    tolerance: float  # Speed above the advice that still counts as following it [m/s]
    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("compliance")
    _time: float = 0.0
    _distance: float = 0.0
    _changes: int = 0
    _shown: float = math.inf
    _advised_time: float = 0.0
    _advised_distance: float = 0.0
    _above_time: float = 0.0

    def update(self, sample: Sample) -> None:
        """Add one step."""
        advised = sample.step.command.advice.speed
        self._time += sample.elapsed
        self._distance += float(sample.step.traffic.speed[sample.step.ego]) * sample.elapsed
        if advised != self._shown and not abs(advised - self._shown) < self.tolerance:
            self._changes += 1
            self._shown = advised
        if not math.isfinite(advised):
            return
        self._advised_time += sample.elapsed
        self._advised_distance += advised * sample.elapsed
        if sample.step.traffic.speed[sample.step.ego] > advised + self.tolerance:
            self._above_time += sample.elapsed

    def result(self) -> dict[str, JsonValue]:
        """Say how the advice was followed."""
        return {
            "advised_time_share": share(self._advised_time, self._time),
            "mean_advised_speed_mps": share(self._advised_distance, self._advised_time),
            "above_advice_time_share": share(self._above_time, self._time),
            "advice_compliance_share": share(self._advised_time - self._above_time, self._advised_time),
            "advice_changes_per_km": share(1000.0 * self._changes, self._distance),
        }
