"""A scenario as plain data, for files."""

import math
from typing import Any

from fogsim.scenario.schema import ScenarioFile


def resolved(scenario: ScenarioFile) -> dict[str, Any]:
    """A scenario as JSON-compatible data with every default filled in; infinite visibility becomes "inf"."""
    data: dict[str, Any] = _without_infinities(scenario.model_dump(mode="json", exclude_none=True))
    return data


def deciding(scenario: ScenarioFile) -> dict[str, Any]:
    """As `resolved`, without the time limit of methods, which decides whether a run fails but not what it gives."""
    return {key: value for key, value in resolved(scenario).items() if key != "method_timeout_s"}


def as_written(scenario: ScenarioFile) -> dict[str, Any]:
    """A scenario as plain data without its defaults."""
    data: dict[str, Any] = _without_infinities(scenario.model_dump(mode="json", exclude_none=True, exclude_unset=True))
    return data


def _without_infinities(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_infinities(v) for key, v in value.items()}
    if isinstance(value, list):
        return [_without_infinities(v) for v in value]
    return "inf" if value == math.inf else value
