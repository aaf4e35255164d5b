"""How smoothly everybody near the ego drives."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fogsim.metrics.exposure import Exposure
from fogsim.metrics.metric import JsonValue, Sample, share
from fogsim.metrics.surrogate import CRITICAL_DECELERATION


@dataclass(slots=True)
class TrafficComfort:
    """Jerk, the change of acceleration between two steps, and hard braking of everybody near the ego."""

    meanings: ClassVar[Mapping[str, str]] = {
        "traffic_rms_jerk_mps3": "root mean square over the time of all vehicles near the ego of the change of "
        "acceleration from step to step, over the time between them",
        "traffic_hard_braking_time_share": "share of that time in which they brake harder than 3.4 m/s²",
    }
    _exposure: Exposure = field(default_factory=Exposure)
    _ids: tuple[str, ...] = ()
    _acceleration: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    _squared_jerk_time: float = 0.0
    _time: float = 0.0
    _braking: float = 0.0

    def update(self, sample: Sample) -> None:
        """Take in one step.

        Parameters
        ----------
        sample : Sample
            The step, and what is derived from it.
        """
        ids, acceleration, elapsed = sample.step.traffic.ids, sample.step.traffic.acceleration, sample.elapsed
        self._exposure.add(sample)
        self._braking += elapsed * float((acceleration < -CRITICAL_DECELERATION).sum())
        if elapsed > 0:
            change = acceleration - self._before(ids)
            known = change[~np.isnan(change)]
            self._squared_jerk_time += float((known**2).sum()) / elapsed
            self._time += elapsed * len(known)
        self._ids, self._acceleration = ids, acceleration

    def _before(self, ids: tuple[str, ...]) -> NDArray[np.float64]:
        """Accelerations at the step before [m/s²]; nan for who was not near then."""
        if ids == self._ids:
            return self._acceleration
        last = dict(zip(self._ids, self._acceleration.tolist(), strict=True))
        return np.array([last.get(vehicle, math.nan) for vehicle in ids])

    def result(self) -> dict[str, JsonValue]:
        """Say how rough everybody's drive was."""
        mean_square = share(self._squared_jerk_time, self._time)
        return {
            "traffic_rms_jerk_mps3": None if mean_square is None else math.sqrt(mean_square),
            "traffic_hard_braking_time_share": share(self._braking, self._exposure.time),
        }
