"""What is expected of a run: clauses as plain values; each describes itself in words."""

import math
from dataclasses import dataclass
from enum import StrEnum

from fogsim.conditions.syntax import Condition


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
    margin: float | None = None  # Least distance to the limit as a share of it, negative beyond; None without a number


@dataclass(frozen=True, slots=True)
class Always:
    """A condition holds at every step."""

    name: str  # Of the expectation
    condition: Condition  # What must hold
    is_never: bool = False  # True if it is the contrary that must
    during: Condition | None = None  # Only the steps at which this holds count
    for_at_least: float = 0.0  # Time that must have counted, or nothing was tested [s]

    @property
    def clause(self) -> str:
        """Its key."""
        return "never" if self.is_never else "always"

    @property
    def expected(self) -> str:
        """What it expects."""
        return f"{self.clause} {self.condition}" + ("" if self.during is None else f", while {self.during}")


@dataclass(frozen=True, slots=True)
class Eventually:
    """A condition holds at some step."""

    name: str  # Of the expectation
    condition: Condition  # What must hold once
    during: Condition | None = None  # Only the steps at which this holds count
    within: float = math.inf  # Time since the run began within which it must [s]; ``inf`` for the whole run

    @property
    def clause(self) -> str:
        """Its key."""
        return "eventually"

    @property
    def expected(self) -> str:
        """What it expects."""
        limit = "" if math.isinf(self.within) else f" within {self.within:g} s"
        return f"eventually {self.condition}{limit}" + ("" if self.during is None else f", while {self.during}")


@dataclass(frozen=True, slots=True)
class Whenever:
    """Each time a condition becomes true another holds soon, or from then on for a while."""

    name: str  # Of the expectation
    trigger: Condition  # What must become true
    require: Condition  # What must hold then
    within: float = 0.0  # Time since then within which it must hold once, or for which it must hold [s]; 0 for at once
    throughout: bool = False  # Whether it must hold all that time
    at_least: int = 1  # How often it must have been tried, or nothing was tested

    @property
    def clause(self) -> str:
        """Its key."""
        return "whenever"

    @property
    def expected(self) -> str:
        """What it expects."""
        limit = "" if not self.within else f" {'for' if self.throughout else 'within'} {self.within:g} s"
        often = "" if self.at_least == 1 else f", at least {self.at_least} times"
        return f"{self.require}{limit} whenever {self.trigger}{often}"


@dataclass(frozen=True, slots=True)
class Happened:
    """Something of the script begins."""

    name: str  # Of the expectation
    event: str  # Name of what begins
    within: float = math.inf  # Time since the run began within which it must [s]; ``inf`` for the whole run

    @property
    def clause(self) -> str:
        """Its key."""
        return "happened"

    @property
    def expected(self) -> str:
        """What it expects."""
        return f"{self.event} happened" + ("" if math.isinf(self.within) else f" within {self.within:g} s")


@dataclass(frozen=True, slots=True)
class MetricCheck:
    """A metric of the run lies on the right side of a value."""

    name: str  # Of the expectation
    metric: str  # Key of the metric; keys within one are parted by dots
    relation: str  # ``<``, ``<=``, ``>``, ``>=``, ``==`` or ``!=``
    value: float | str  # What it is compared with, in the metric's own unit

    @property
    def clause(self) -> str:
        """Its key."""
        return "metric"

    @property
    def expected(self) -> str:
        """What it expects."""
        return f"{self.metric} {self.relation} {self.value if isinstance(self.value, str) else f'{self.value:g}'}"


Clause = Always | Eventually | Whenever | Happened | MetricCheck
"""One thing that is expected of a run."""
