"""All metrics of one run, from its steps one at a time."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from fogsim.errors import SimulationError
from fogsim.metrics.estimation import BeliefError, EstimatorErrors
from fogsim.metrics.metric import JsonValue, Metric, Sample
from fogsim.metrics.motion import Comfort, Compliance, Motion
from fogsim.metrics.safety import Collisions, Conflict, Sight
from fogsim.metrics.step_metrics import DEFAULT_STANDARD, step_metrics
from fogsim.metrics.surrogate import SafetyStandard
from fogsim.metrics.traffic_collisions import TrafficCollisions
from fogsim.metrics.traffic_comfort import TrafficComfort
from fogsim.metrics.traffic_compliance import TrafficCompliance
from fogsim.metrics.traffic_conflicts import TrafficConflicts
from fogsim.metrics.traffic_emissions import TrafficEmissions
from fogsim.metrics.traffic_flow import TrafficFlow
from fogsim.metrics.traffic_headways import TrafficHeadways
from fogsim.metrics.traffic_sight import TrafficSight
from fogsim.metrics.traffic_span import GatheredMetrics, SpanWatcher, TrafficMetric
from fogsim.registry import Registry
from fogsim.units import clock_time
from fogsim.values import Step, TrafficStep
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
        "belief": lambda _: BeliefError(),
        "estimators": lambda _: EstimatorErrors(),
        "traffic_collisions": lambda _: TrafficCollisions(),
        "traffic_conflicts": lambda standard: TrafficConflicts(standard.time_to_collision),
        "traffic_headways": lambda _: TrafficHeadways(),
        "traffic_sight": lambda standard: TrafficSight(standard.reaction_time, standard.deceleration),
        "traffic_flow": lambda _: TrafficFlow(),
        "traffic_comfort": lambda _: TrafficComfort(),
        "traffic_compliance": lambda standard: TrafficCompliance(standard.advice_tolerance),
        "traffic_emissions": lambda _: TrafficEmissions(),
    },
)
"""Every metric by name, in the order of the summary."""


@dataclass(frozen=True, slots=True)
class RunSummary:
    """What a run amounts to.

    Attributes
    ----------
    values : mapping from str to JSON value
        Every metric by its key, which ends in the unit; None where it is undefined.
    meanings : mapping from str to str
        One line on each key.
    """

    values: Mapping[str, JsonValue]
    meanings: Mapping[str, str]

    def to_json(self) -> dict[str, JsonValue]:
        """Give the values as a dict that JSON can hold without NaN or infinity, numbers in the digits that they have.

        Processors differ in the last bits of exponentials and logarithms, and no measurement has ten digits.
        """
        return {key: _written(value) for key, value in self.values.items()}


def _written(value: JsonValue) -> JsonValue:
    """A value with numbers to 9 significant digits, and no more than 9 after the point."""
    if isinstance(value, Mapping):
        return {key: _written(part) for key, part in value.items()}
    return round(float(f"{value:.9g}"), 9) + 0.0 if isinstance(value, float) else value


class RunMetrics:
    """Watches the steps of one run.

    Parameters
    ----------
    standard : SafetyStandard
        What the measures are judged by.
    names : iterable of str
        Metrics from `METRICS`; all of them by default.
    watchers : iterable of SpanWatcher
        Who gets what the metrics of everybody get; `summary` hands over the last of it.

    Attributes
    ----------
    standard : SafetyStandard
        The same.

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
        self.standard = standard
        self._metrics = {name: METRICS[name](standard) for name in names}
        self._of_ego = [metric for metric in self._metrics.values() if not isinstance(metric, TrafficMetric)]
        self._of_traffic = GatheredMetrics([*_of_everybody(self._metrics.values()), *watchers])
        self._last: Step | None = None

    def update(self, step: Step) -> None:
        """Take in one finished step; the time since the one before is read from their times.

        When the ego leaves the network, the last step comes once more with its ending; only that is taken from it.

        Parameters
        ----------
        step : Step
            The step.

        Raises
        ------
        SimulationError
            If the step is not later than the one before.
        """
        last, self._last = self._last, step
        elapsed = _elapsed(last, step)
        if elapsed is None:
            return
        sample = Sample(step, elapsed, step_metrics(step, self.standard))
        for metric in self._of_ego:
            metric.update(sample)
        self._of_traffic.add(step, elapsed)

    def summary(self) -> RunSummary:
        """Say what the steps so far amount to."""
        self._of_traffic.hand_over()
        return _summary(self._last, self._metrics)


class TrafficRunMetrics:
    """Watches the steps of one run without an ego: the metrics of everybody.

    Parameters
    ----------
    standard : SafetyStandard
        What the measures are judged by.
    names : iterable of str
        Metrics from `METRICS`; those of an ego among them are left out.
    watchers : iterable of SpanWatcher
        Who gets what the metrics of everybody get; `summary` hands over the last of it.

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
        self._metrics = {name: metric for name, metric in made.items() if isinstance(metric, TrafficMetric)}
        self._of_traffic = GatheredMetrics([*_of_everybody(self._metrics.values()), *watchers])
        self._last: TrafficStep | None = None
        self._duration, self._steps = 0.0, 0

    def update(self, step: TrafficStep) -> None:
        """Take in one finished step; the time since the one before is read from their times.

        Parameters
        ----------
        step : TrafficStep
            The step.

        Raises
        ------
        SimulationError
            If the step is not later than the one before.
        """
        last, self._last = self._last, step
        elapsed = _elapsed(last, step)
        if elapsed is not None:
            self._duration, self._steps = self._duration + elapsed, self._steps + 1
            self._of_traffic.add(step, elapsed)

    def summary(self) -> RunSummary:
        """Say what the steps so far amount to."""
        self._of_traffic.hand_over()
        found = _summary(self._last, self._metrics)
        about: dict[str, JsonValue] = {"duration_s": clock_time(self._duration), "steps": self._steps}
        meanings = {key: Motion.meanings[key] for key in about}
        return RunSummary({**found.values, **about}, {**found.meanings, **meanings})


def _of_everybody(metrics: Iterable[Metric | TrafficMetric]) -> list[TrafficMetric]:
    return [metric for metric in metrics if isinstance(metric, TrafficMetric)]


def _elapsed(last: TrafficStep | None, step: TrafficStep) -> float | None:
    """Time since the step before [s]; None if it is the same."""
    if last is None:
        return 0.0
    if last.index == step.index:
        return None
    elapsed = clock_time(step.time - last.time)
    if not elapsed > 0:
        raise SimulationError(f"steps must follow in time, got {step.time!r} s after {last.time!r} s")
    return elapsed


def _summary(last: TrafficStep | None, metrics: Mapping[str, Metric | TrafficMetric]) -> RunSummary:
    ending = None if last is None else last.ending
    values: dict[str, JsonValue] = {"ending": None if ending is None else ending.value}
    meanings = {"ending": "why the run was over; none if it was cut short"}
    for name, metric in metrics.items():
        values.update(checked_values(name, metric.result()))
        meanings.update(metric.meanings)
    return RunSummary(values, meanings)
