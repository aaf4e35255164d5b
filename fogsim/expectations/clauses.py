"""What is expected of a run: clauses as plain values, each of which says in words what it expects."""

import math
from dataclasses import dataclass

from fogsim.conditions import Condition


@dataclass(frozen=True, slots=True)
class Always:
    """A condition holds at every step.

    Attributes
    ----------
    name : str
        Of the expectation.
    condition : Condition
        What must hold.
    is_never : bool
        True if it is the contrary that must.
    during : Condition or None
        Only the steps at which this holds count.
    for_at_least : float
        Time that must have counted, or nothing was tested [s].
    """

    name: str
    condition: Condition
    is_never: bool = False
    during: Condition | None = None
    for_at_least: float = 0.0

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
    """A condition holds at some step.

    Attributes
    ----------
    name : str
        Of the expectation.
    condition : Condition
        What must hold once.
    during : Condition or None
        Only the steps at which this holds count.
    within : float
        Time since the run began within which it must [s]; ``inf`` for the whole run.
    """

    name: str
    condition: Condition
    during: Condition | None = None
    within: float = math.inf

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
    """Each time a condition becomes true another holds soon, or from then on for a while.

    Attributes
    ----------
    name : str
        Of the expectation.
    trigger : Condition
        What must become true.
    require : Condition
        What must hold then.
    within : float
        Time since then within which it must hold once, or for which it must hold [s]; 0 for at once.
    throughout : bool
        Whether it must hold all that time.
    at_least : int
        How often it must have been tried, or nothing was tested.
    """

    name: str
    trigger: Condition
    require: Condition
    within: float = 0.0
    throughout: bool = False
    at_least: int = 1

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
    """Something of the script begins.

    Attributes
    ----------
    name : str
        Of the expectation.
    event : str
        Name of what begins.
    within : float
        Time since the run began within which it must [s]; ``inf`` for the whole run.
    """

    name: str
    event: str
    within: float = math.inf

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
    """A metric of the run lies on the right side of a value.

    Attributes
    ----------
    name : str
        Of the expectation.
    metric : str
        Key of the metric; keys within one are parted by dots.
    relation : str
        ``<``, ``<=``, ``>``, ``>=``, ``==`` or ``!=``.
    value : float or str
        What it is compared with, in the metric's own unit.
    """

    name: str
    metric: str
    relation: str
    value: float | str

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
