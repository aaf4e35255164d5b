"""What a metric is: something that watches the steps of a run and says a few numbers at its end."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Protocol

from fogsim.values import Step

JsonValue = float | int | str | None | Mapping[str, "JsonValue"]
"""What a metric may say: None where it is undefined, never NaN or infinity."""


@dataclass(frozen=True, slots=True)
class Sample:
    """A step as the metrics get it.

    Attributes
    ----------
    step : Step
        The step.
    elapsed : float
        Time since the step before [s], 0 for the first: what was found at the step is held to be true for it.
    derived : mapping from str to float or None
        What `step_metrics` found in the step.
    """

    step: Step
    elapsed: float
    derived: Mapping[str, float | None]


class Metric(Protocol):
    """A few numbers about a run."""

    meanings: ClassVar[Mapping[str, str]]
    """One line on each key of the result; a key ends in its unit."""

    def update(self, sample: Sample) -> None:
        """Add one step."""

    def result(self) -> Mapping[str, JsonValue]:
        """Say what the steps so far amount to; the keys are those of `meanings`."""


def share(part: float, whole: float) -> float | None:
    """Part of a whole [-], None where there is no whole.

    Parameters
    ----------
    part, whole : float
        Of the same unit.
    """
    return part / whole if whole > 0 else None
