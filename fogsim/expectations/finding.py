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
    """What came of one clause of an expectation.

    Attributes
    ----------
    name, clause : str
        The expectation, and the key of its clause.
    verdict : FindingVerdict
        What came of it.
    expected : str
        What was expected, in words.
    came : str
        What came: values of the signals.
    time : float or None
        When it was decided: of a failure, when it came [s]; None where no instant decided.
    position : float or None
        How far along its route the ego was then [m]; None without an ego.
    reason : str
        Why it is inconclusive, or what went wrong.
    """

    name: str
    clause: str
    verdict: FindingVerdict
    expected: str
    came: str
    time: float | None
    position: float | None
    reason: str
