"""All metrics of one run, from its steps one at a time."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

from fogsim.core.registry import Registry
from fogsim.errors import InputError, SimulationError
from fogsim.metrics.crossing import TrafficEncroachment
from fogsim.metrics.estimation import BeliefAheadError, BeliefError, DenseFogKnown, EquippedBelief, EstimatorErrors
from fogsim.metrics.estimation.belief_ahead import FogWarnings
from fogsim.metrics.lighting import Lighting
from fogsim.metrics.metric import Definition, JsonValue, Metric, Sample, definitions_of
from fogsim.metrics.motion import Comfort, Compliance, Motion
from fogsim.metrics.safety import DEFAULT_STANDARD, Collisions, Conflict, Sight, step_metrics
from fogsim.metrics.surrogate import SafetyStandard
from fogsim.metrics.traffic_comfort import TrafficComfort, TrafficCompliance, TrafficSight
from fogsim.metrics.traffic_conflicts import TrafficCollisions, TrafficConflicts, TrafficHeadways
from fogsim.metrics.traffic_flow import TrafficEmissions, TrafficFlow
from fogsim.metrics.traffic_span import GatheredMetrics, SpanWatcher, TrafficCohort, TrafficMetric
from fogsim.metrics.traffic_throughput import TrafficThroughput
from fogsim.units import clock_time
from fogsim.values import Ending, Step, TrafficStep
from fogsim.values.result_checks import checked_values

MetricFactory = Callable[[SafetyStandard], Metric | TrafficMetric]
"""Makes a metric that has seen nothing yet."""

METRICS: Registry[MetricFactory] = Registry(
    "metric",
    {
        "motion": lambda _: Motion(),
        "collisions": lambda _: Collisions(),
        "conflict": lambda standard: Conflict(standard.time_to_collision),
        "sight": lambda standard: Sight(standard.reaction_time, standard.deceleration),
        "compliance": lambda standard: Compliance(standard.advice_tolerance),
        "comfort": lambda _: Comfort(),
        "lighting": lambda _: Lighting(),
        "belief": lambda _: BeliefError(),
        "belief_ahead": lambda _: BeliefAheadError(),
        "dense_fog_known": lambda _: DenseFogKnown(),
        "fog_warnings": lambda _: FogWarnings(),
        "equipped": lambda _: EquippedBelief(),
        "estimators": lambda _: EstimatorErrors(),
        "traffic_cohort": lambda _: TrafficCohort(),
        "traffic_collisions": lambda _: TrafficCollisions(),
        "traffic_conflicts": lambda standard: TrafficConflicts(standard.time_to_collision),
        "traffic_headways": lambda _: TrafficHeadways(),
        "traffic_encroachment": lambda _: TrafficEncroachment(),
        "traffic_sight": lambda standard: TrafficSight(standard.reaction_time, standard.deceleration),
        "traffic_flow": lambda _: TrafficFlow(),
        "traffic_throughput": lambda _: TrafficThroughput(),
        "traffic_comfort": lambda _: TrafficComfort(),
        "traffic_compliance": lambda standard: TrafficCompliance(standard.advice_tolerance),
        "traffic_emissions": lambda _: TrafficEmissions(),
    },
)
"""Every metric by name, in the order of the summary."""


_OF_DRIVING = (Conflict, Sight, Compliance, Comfort, FogWarnings)
"""Metrics of the ego that leave out steps in which it is off the lanes."""


@dataclass(frozen=True, slots=True)
class RunSummary:
    """What a run amounts to.

    Attributes
    ----------
    values : mapping from str to JSON value
        Every metric by its key, which ends in the unit; None where it is undefined.
    definitions : mapping from str to Definition
        What each key means.
    """

    values: Mapping[str, JsonValue]
    definitions: Mapping[str, Definition]

    @property
    def meanings(self) -> dict[str, str]:
        """Meaning of each key."""
        return {key: one.meaning for key, one in self.definitions.items()}

    def to_json(self) -> dict[str, JsonValue]:
        """Give the values as a dict that JSON can hold without NaN or infinity, numbers in the digits that they have.

        Processors differ in the last bits of exponentials and logarithms, and no measurement has ten digits.
        """
        return {key: _written(value) for key, value in self.values.items()}

    def flat(self) -> dict[str, str | int | float | None]:
        """Give what `to_json` gives without levels, as studies name it: those of a method become ``method.metric``."""
        return dict(_flat(self.to_json()))


def _flat(values: Mapping[str, JsonValue], prefix: str = "") -> Iterator[tuple[str, str | int | float | None]]:
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        elif value is None or isinstance(value, str | int | float):
            yield prefix + key, value


def _written(value: JsonValue) -> JsonValue:
    """A value with numbers to 9 significant digits, and no more than 9 after the point."""
    if isinstance(value, Mapping):
        return {key: _written(part) for key, part in value.items()}
    return round(float(f"{value:.9g}"), 9) + 0.0 if isinstance(value, float) else value


AnyStep = TypeVar("AnyStep", bound=TrafficStep)


class MetricsOfRun(ABC, Generic[AnyStep]):
    """Watches the steps of one run; what runs with and without an ego have in common.

    Parameters
    ----------
    standard : SafetyStandard
        What the measures are judged by.
    metrics : mapping from str to Metric or TrafficMetric
        Metrics by name, in the order of the summary.
    watchers : iterable of SpanWatcher
        Who gets what the metrics of everyone get; `summary` hands over the last of it.

    Attributes
    ----------
    standard : SafetyStandard
        The same.
    """

    def __init__(
        self,
        standard: SafetyStandard,
        metrics: Mapping[str, Metric | TrafficMetric],
        watchers: Iterable[SpanWatcher],
    ) -> None:
        self.standard = standard
        self._metrics = metrics
        of_all_vehicles = [metric for metric in metrics.values() if isinstance(metric, TrafficMetric)]
        self._of_traffic = GatheredMetrics([*of_all_vehicles, *watchers])
        self._last: AnyStep | None = None

    def update(self, step: AnyStep) -> None:
        """Take in one finished step; the time since the one before is read from their times.

        A step that comes once more, as the last one of an ego that has left the network, adds its ending only.

        Parameters
        ----------
        step : TrafficStep
            The step; a `Step` where the run has an ego.

        Raises
        ------
        SimulationError
            If the step is not later than the one before.
        """
        last, self._last = self._last, step
        elapsed = _elapsed(last, step)
        if elapsed is not None:
            self._take(step, elapsed)
            self._of_traffic.add(step, elapsed)

    @abstractmethod
    def _take(self, step: AnyStep, elapsed: float) -> None:
        """Take from a step what is not of everyone, a time [s] after the one before."""

    @abstractmethod
    def derive(self, step: AnyStep) -> dict[str, float | None]:
        """Derive from one step alone what recorders write next to it.

        Parameters
        ----------
        step : TrafficStep
            The step, as for `update`.
        """

    def summary(self) -> RunSummary:
        """Say what the steps so far amount to."""
        self._of_traffic.hand_over()
        ending = None if self._last is None else self._last.ending
        values: dict[str, JsonValue] = {"ending": None if ending is None else ending.value}
        definitions = {"ending": Definition("Why the run ended; none if it was interrupted.")}
        for name, metric in self._metrics.items():
            found = checked_values(name, metric.result())
            if twice := sorted(found.keys() & values.keys()):
                raise InputError(f"metric {name!r}: result(): another metric has the key {twice[0]!r}; choose another")
            values.update(found)
            definitions.update(metric.definitions)
        return RunSummary(values, definitions)


class RunMetrics(MetricsOfRun[Step]):
    """Watches the steps of one run about an ego.

    Parameters
    ----------
    standard : SafetyStandard
        What the measures are judged by.
    names : iterable of str
        Metrics from `METRICS`; all of them by default.
    watchers : iterable of SpanWatcher
        Who gets what the metrics of everyone get; `summary` hands over the last of it.

    Raises
    ------
    UnknownNameError
        If a name is not in `METRICS`.
    """

    def __init__(
        self,
        standard: SafetyStandard = DEFAULT_STANDARD,
        names: Iterable[str] = METRICS,
        watchers: Iterable[SpanWatcher] = (),
    ) -> None:
        metrics = {name: METRICS[name](standard) for name in names}
        super().__init__(standard, metrics, watchers)
        self._of_ego = [metric for metric in metrics.values() if not isinstance(metric, TrafficMetric)]

    def _take(self, step: Step, elapsed: float) -> None:
        sample = Sample(step, elapsed, self.derive(step))
        off_lanes = bool(step.traffic.off_lanes[step.ego])
        for metric in self._of_ego:
            if not (off_lanes and isinstance(metric, _OF_DRIVING)):
                metric.update(sample)

    def derive(self, step: Step) -> dict[str, float | None]:
        """Derive the safety of one instant, as `step_metrics` does.

        Parameters
        ----------
        step : Step
            The step.
        """
        return step_metrics(step, self.standard)


class TrafficRunMetrics(MetricsOfRun[TrafficStep]):
    """Watches the steps of one run without an ego: the metrics of everyone.

    Parameters
    ----------
    standard : SafetyStandard
        What the measures are judged by.
    names : iterable of str
        Metrics from `METRICS`; those of an ego among them are left out.
    watchers : iterable of SpanWatcher
        Who gets what the metrics of everyone get; `summary` hands over the last of it.

    Raises
    ------
    UnknownNameError
        If a name is not in `METRICS`.
    """

    def __init__(
        self,
        standard: SafetyStandard = DEFAULT_STANDARD,
        names: Iterable[str] = METRICS,
        watchers: Iterable[SpanWatcher] = (),
    ) -> None:
        made = {name: METRICS[name](standard) for name in names}
        of_all_vehicles = {name: metric for name, metric in made.items() if isinstance(metric, TrafficMetric)}
        super().__init__(standard, of_all_vehicles, watchers)
        self._duration, self._steps = 0.0, 0

    def _take(self, step: TrafficStep, elapsed: float) -> None:  # noqa: ARG002 - counted whatever is in it
        self._duration, self._steps = self._duration + elapsed, self._steps + 1

    def derive(self, step: TrafficStep) -> dict[str, float | None]:  # noqa: ARG002 - as of `MetricsOfRun`
        """Derive nothing: all that is derived from a step alone is of an ego.

        Parameters
        ----------
        step : TrafficStep
            The step.
        """
        return {}

    def summary(self) -> RunSummary:
        """Say what the steps so far amount to."""
        found = super().summary()
        about: dict[str, JsonValue] = {"duration_s": clock_time(self._duration), "steps": self._steps}
        definitions = {key: Motion.definitions[key] for key in about}
        # The order is that of a run with an ego.
        first = {"ending": found.values["ending"], **about}
        return RunSummary({**first, **found.values}, {**found.definitions, **definitions})


def metric_definitions() -> Mapping[str, Definition]:
    """Definitions of all keys of ``metrics.json``; `estimators` has a block for each method."""
    return RunMetrics().summary().definitions


def metric_topics() -> dict[str, tuple[str, ...]]:
    """Keys of ``metrics.json`` by topic, the name of their metric in words."""
    return {name.replace("_", " "): tuple(definitions_of(name)) for name in METRICS}


def _elapsed(last: TrafficStep | None, step: TrafficStep) -> float | None:
    """Time since the step before [s]; None if it repeats that one, as after the ego has left the network."""
    if last is None:
        return 0.0
    if last.index == step.index or step.ending is Ending.LEFT_NETWORK:
        return None
    elapsed = clock_time(step.time - last.time)
    if not elapsed > 0:
        raise SimulationError(f"steps must follow in time, got {step.time!r} s after {last.time!r} s")
    return elapsed
