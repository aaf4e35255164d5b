"""What a metric is: it watches the steps of a run and gives a few numbers at its end, each with a definition."""

import csv
import functools
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import ClassVar, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from fogsim.values import Step

JsonValue = float | int | str | None | Mapping[str, "JsonValue"]
"""Value of a metric: None where it is undefined, never NaN or infinity."""


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


@dataclass(frozen=True, slots=True)
class Definition:
    """What a key of ``metrics.json`` means, and whether it ranks policies; `definitions.csv` has those of FogSim.

    Attributes
    ----------
    meaning : str
        Complete sentences.
    numerator, denominator : str
        What the value is the quotient of; an empty numerator stands for a count, a sum or an extreme of one run.
    denominator_moves : bool
        Whether a policy moves the denominator by making traffic slower. Such a metric never ranks policies.
    better : "lower", "higher" or None
        Direction in which the metric ranks policies; None where it only describes.
    label, unit : str
        Name and unit in reports; an empty label stands for the key itself.
    scale : float
        Factor from the unit of the key to `unit`.
    """

    meaning: str
    numerator: str = ""
    denominator: str = "one run"
    denominator_moves: bool = False
    better: Literal["lower", "higher"] | None = None
    label: str = ""
    unit: str = ""
    scale: float = 1.0


def definitions_of(metric: str) -> dict[str, Definition]:
    """Definitions of the keys of one of FogSim's metrics, by its name in `METRICS`."""
    return {
        row["key"]: Definition(
            row["meaning"],
            row["numerator"],
            row["denominator"],
            row["denominator_moves"] == "yes",
            _DIRECTIONS[row["better"]],
            row["label"],
            row["unit"],
            float(row["scale"] or 1.0),
        )
        for row in _table()
        if row["metric"] == metric
    }


_DIRECTIONS: Mapping[str, Literal["lower", "higher"] | None] = {"": None, "lower": "lower", "higher": "higher"}


@functools.cache
def _table() -> list[dict[str, str]]:
    text = files("fogsim.metrics").joinpath("definitions.csv").read_text(encoding="utf-8")
    return list(csv.DictReader(text.splitlines()))


class Metric(Protocol):
    """A few numbers about a run."""

    definitions: ClassVar[Mapping[str, Definition]]
    """Definition of each key of the result; a key ends in its unit."""

    def update(self, sample: Sample) -> None:
        """Add one step.

        Parameters
        ----------
        sample : Sample
            What the step and the time to the next one hold.
        """

    def result(self) -> Mapping[str, JsonValue]:
        """Values over the steps so far; the keys are those of `definitions`."""


def share(part: float, whole: float) -> float | None:
    """Part of a whole [-], None where there is no whole."""
    return part / whole if whole > 0 else None


class Histogram:
    """Time by value, in bins of equal width; what lies beyond the ends is in the outermost two."""

    def __init__(self, low: float, high: float, width: float) -> None:
        self._low, self._width = low, width
        self._bins = round((high - low) / width)
        self._time = np.zeros(self._bins + 2)

    def add(self, values: NDArray[np.float64], elapsed: NDArray[np.float64]) -> None:
        """Add times [s] at values (n,), which may be infinite."""
        # A value on an edge is above it, whatever the quotient's last bit.
        place = np.clip((values - self._low) / self._width + (1.0 + 1e-9), 0.0, self._bins + 1.0)
        self._time += np.bincount(place.astype(np.intp), elapsed, minlength=self._bins + 2)

    def share_below(self, value: float) -> float | None:
        """Share of the time below a value, an edge of a bin [-]; None without any."""
        until = round((value - self._low) / self._width) + 1
        return share(float(self._time[:until].sum()), float(self._time.sum()))

    def quantile(self, probability: float) -> float | None:
        """Value below which a share of the time was spent; None without any, or beyond the range."""
        total = np.cumsum(self._time)
        wanted = probability * total[-1]
        place = int(np.searchsorted(total, wanted))
        if not wanted or not 1 <= place <= self._bins:
            return None
        part = (wanted - total[place - 1]) / self._time[place]
        return float(self._low + self._width * (place - 1 + part))
