"""What came of what was expected."""

from dataclasses import dataclass
from enum import StrEnum


class FindingVerdict(StrEnum):
    """What came of a clause."""

    PASSED = "passed"
    FAILED = "failed"
    INCONCLUSIVE = "inconclusive"
    """What was to be tested did not happen, or was not known."""


@dataclass(frozen=True, slots=True)
class Finding:
    """What came of one clause of an expectation."""

    # name, clause: the expectation, and the key of its clause
    name: str
    clause: str
    verdict: FindingVerdict  # What came of it
    expected: str  # What was expected, in words
    came: str  # What came: values of the signals
    time: float | None  # When it was decided: of a failure, when it came [s]; None where no instant decided
    position: float | None  # How far along its route the ego was then [m]; None without an ego
    reason: str  # Why it is inconclusive, or what went wrong
