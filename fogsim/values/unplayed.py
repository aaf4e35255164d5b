"""What a scenario's script asked for and a run did not bring."""

from dataclasses import dataclass
from enum import StrEnum


class Reason(StrEnum):
    """Why an event was not played."""

    NOT_REACHED = "its time, position or gap was not reached"
    NEVER_SEEN = "the vehicle was never on the road"
    LEFT = "the vehicle left the road before"
    NEVER_HELD = "its condition never held"
    NO_LANE = "there was no such lane"


@dataclass(frozen=True, slots=True)
class UnplayedEvent:
    """An event that never began.

    Attributes
    ----------
    name : str
        Key path in the scenario, and what it is.
    reason : Reason
        Why.
    """

    name: str
    reason: Reason

    def __str__(self) -> str:
        return f"{self.name}: {self.reason.value}"


@dataclass(frozen=True, slots=True)
class Unplayed:
    """What of a script has not been played; empty if all was.

    Attributes
    ----------
    events : tuple of UnplayedEvent
        Events that never began, in the order of the scenario.
    vehicles : tuple of str
        Vehicles that events or ``traffic.keep_lane`` name and that were never on the road, sorted.
    """

    events: tuple[UnplayedEvent, ...] = ()
    vehicles: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.events or self.vehicles)

    def __add__(self, other: "Unplayed") -> "Unplayed":
        """What two parts of a script have not played, together."""
        return Unplayed(self.events + other.events, tuple(sorted({*self.vehicles, *other.vehicles})))

    def __str__(self) -> str:
        return "; ".join(self.lines)

    @property
    def lines(self) -> list[str]:
        """One line on each event and each vehicle."""
        return [*map(str, self.events), *(f"vehicle {v!r} was never on the road" for v in self.vehicles)]

    @property
    def is_final(self) -> bool:
        """True if a longer run would not have played all of it either."""
        return any(event.reason in (Reason.LEFT, Reason.NO_LANE) for event in self.events)


NOTHING_UNPLAYED = Unplayed()
