"""Whether everyone near the ego keeps to the advice that they have heard."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from fogsim.metrics.metric import Definition, JsonValue, definitions_of, share
from fogsim.metrics.traffic_span import Exposure, TrafficMetric, TrafficSpan


@dataclass(slots=True)
class TrafficCompliance(TrafficMetric):
    """Speeds against the advice in force that drivers have heard, whether they follow it, and whether they have yet."""

    tolerance: float  # Speed above the advice that still counts as following it [m/s]
    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("traffic_compliance")
    _exposure: Exposure = field(default_factory=Exposure)
    _advised_time: float = 0.0
    _compliant_time: float = 0.0

    def add(self, span: TrafficSpan) -> None:
        """Add some steps."""
        self._exposure.add(span)
        advised = np.isfinite(span.advised_speed)
        if advised.any():
            elapsed, above = span.elapsed[advised], span.speed[advised] - span.advised_speed[advised]
            self._advised_time += float(elapsed.sum())
            self._compliant_time += float(elapsed[above <= self.tolerance].sum())

    def result(self) -> dict[str, JsonValue]:
        """Say how everyone followed the advice."""
        return {
            "traffic_advised_time_share": share(self._advised_time, self._exposure.time),
            "traffic_advice_compliance_share": share(self._compliant_time, self._advised_time),
        }
