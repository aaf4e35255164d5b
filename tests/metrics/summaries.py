"""Summaries of synthetic runs."""

from collections.abc import Iterable

from fogsim.metrics import JsonValue, RunMetrics, SafetyStandard
from fogsim.values import Step


def summarise(steps: Iterable[Step], **standard: float) -> dict[str, JsonValue]:
    metrics = RunMetrics(SafetyStandard(**standard))
    for step in steps:
        metrics.update(step)
    return metrics.summary().to_json()
