"""What other equipped vehicles than the ego believe."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from fogsim.metrics.estimation.errors import FOG_LIMIT, quantile, relative_error
from fogsim.metrics.metric import Definition, JsonValue, Sample, definitions_of, share
from fogsim.units import visibility_from_extinction


@dataclass(slots=True)
class EquippedBelief:
    """How right the beliefs of all other equipped vehicles were, where the fog ahead of them is below 1000 m."""

    definitions: ClassVar[Mapping[str, Definition]] = definitions_of("equipped")
    _steps: int = 0
    _vehicles: int = 0
    _held: int = 0
    _errors: list[float] = field(default_factory=list)

    def update(self, sample: Sample) -> None:
        """Add one step."""
        self._steps += 1
        self._vehicles += len(sample.step.equipped)
        for one in sample.step.equipped:
            truth = visibility_from_extinction(one.extinction_ahead)
            if truth < FOG_LIMIT:
                low, middle, high = one.belief.visibility_quantiles((0.05, 0.5, 0.95))
                self._errors.append(relative_error(middle, truth))
                self._held += low <= truth <= high

    def result(self) -> dict[str, JsonValue]:
        """Say how many, error and coverage."""
        return {
            "equipped_vehicles_mean": self._vehicles / self._steps if self._steps else None,
            "equipped_belief_median_error_percent": quantile(self._errors, 0.5),
            "equipped_belief_coverage_share": share(self._held, len(self._errors)),
        }
