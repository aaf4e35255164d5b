"""Expectations of a scenario that its run could not evaluate, and the names in them."""

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from fogsim.conditions import Need, RunContent, condition_mistakes, vehicles_in
from fogsim.errors import nearest_of, shown, suggest
from fogsim.metrics.estimation import Errors
from fogsim.metrics.run_metrics import RunMetrics, TrafficRunMetrics
from fogsim.scenario.expect.conditions import refuse
from fogsim.scenario.expect.schema import Expectation, metric_check
from fogsim.scenario.plain_yaml import KeyPath
from fogsim.units import clock_time

if TYPE_CHECKING:
    from fogsim.scenario.schema import ScenarioFile

_MOST_SHOWN = 5
"""Maximum number of metrics in a message."""


def check_expectations(scenario: "ScenarioFile", *, is_shortened: bool = False) -> None:
    """Raise ValidationError if a run, unless ``--set`` has shortened it, could not evaluate its expectations."""
    end = math.inf if is_shortened else last_time(scenario)
    mistakes = _expectation_mistakes(scenario.expect, run_content(scenario), end, scenario.traffic.ego)
    refuse((("expect", *place), mistake) for place, mistake in mistakes)


def last_time(scenario: "ScenarioFile") -> float:
    """Time of the last frame of a scenario's longest run [s]."""
    period = scenario.clocks.camera_period_s
    return clock_time(max(1, round(scenario.duration_s / period)) * period)


def run_content(scenario: "ScenarioFile") -> RunContent:
    """What the conditions of a scenario can refer to."""
    has_ego = scenario.traffic.has_ego
    methods = tuple(one.method for one in scenario.estimators)
    # On a template's road, positions count along it.
    has_way = bool(scenario.traffic.along) or scenario.road is not None
    has = {Need.EGO: has_ego, Need.ROUTE: has_ego or has_way, Need.FRAMES: bool(methods)}
    return RunContent(
        frozenset(need for need, is_there in has.items() if is_there),
        methods,
        len(scenario.fog.banks),
        (
            *(f"timeline.{number}" for number in range(len(scenario.timeline))),
            *(entry.name for entry in scenario.timeline if entry.name),
        ),
    )


def _expectation_mistakes(
    expect: Mapping[str, Expectation], content: RunContent, duration: float, ego: str
) -> Iterator[tuple[KeyPath, str]]:
    """Expectations that a run could not evaluate, by key path; `duration` is the time of its last frame [s]."""
    for name, expectation in expect.items():
        for key, condition in expectation.conditions():
            yield from (((name, key), mistake) for mistake in condition_mistakes(condition, content))
        yield from (((name, key), mistake) for key, mistake in expectation.pointless({"time": (0.0, duration)}, ego))
        for key, time in (("within_s", expectation.within_s), ("for_at_least_s", expectation.for_at_least_s)):
            if time is not None and time > duration:
                yield (name, key), f"this cannot be decided: the run lasts {duration:g} s; got {time:g} s"
        if expectation.happened is not None and expectation.happened not in content.events:
            yield (
                (name, "happened"),
                f"unknown event {shown(expectation.happened)}; " + suggest(expectation.happened, content.events),
            )
        if expectation.metric is not None:
            key = metric_check(name, expectation.metric).metric
            known = list(_metrics(content))
            if key not in known:
                near = nearest_of(key, known, _MOST_SHOWN)
                yield (name, "metric"), f"unknown metric {shown(key)}; {suggest(key, near)}, … ({len(known)} in all)"


def _metrics(content: RunContent) -> Iterator[str]:
    """Keys of the metrics of a run."""
    has_ego = Need.EGO in content.needs
    yield from (RunMetrics() if has_ego else TrafficRunMetrics()).summary().meanings
    yield from (f"estimators.{method}.{key}" for method in content.methods for key in Errors().result())


def named_vehicles(expect: Mapping[str, Expectation]) -> Iterator[tuple[KeyPath, str]]:
    """Key path and id of each vehicle other than the ego that expectations name."""
    for name, expectation in expect.items():
        for key, condition in expectation.conditions():
            yield from ((("expect", name, key), vehicle) for vehicle in vehicles_in(condition))
