"""What a case is watched by, and what comes of it."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

from fogsim.errors import InputError
from fogsim.scenario import Scenario
from fogsim.values import TrafficStep


class FindingVerdict(StrEnum):
    """What came of a clause."""

    PASSED = "passed"
    FAILED = "failed"
    INCONCLUSIVE = "inconclusive"


@dataclass(frozen=True, slots=True)
class Finding:
    """What came of one clause of an expectation."""

    name: str
    clause: str
    verdict: FindingVerdict
    expected: str
    came: str
    time: float | None
    position: float | None
    reason: str


class Watching(Protocol):
    """Watches a run."""

    def update(self, step: TrafficStep) -> None:
        """Take in a step."""

    def findings(self, metrics: Mapping[str, object]) -> tuple[Finding, ...]:
        """What came of it."""


def watch_of(scenario: Scenario) -> Watching:
    """What watches a run of a scenario.

    Parameters
    ----------
    scenario : Scenario
        With what it expects.
    """
    raise InputError(f"{scenario.name}: expectations cannot be checked yet")
