"""A signal of a run: its unit, its range, its needs, and how to read it from a moment."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, StrEnum

from fogsim.conditions.moment import Moment


class Kind(Enum):
    """Type of a signal."""

    NUMBER = "number"
    FLAG = "true or false"
    WORD = "word"
    WORDS = "words"
    LANE = "lane"


class Need(StrEnum):
    """What a run must have for a signal to have a value."""

    EGO = "an ego"
    FRAMES = "frames"
    """A camera and estimators, which also need an ego."""
    ROUTE = "a route (traffic.along)"
    """The ego's, or ``traffic.along``."""


@dataclass(frozen=True, slots=True)
class LanePlace:
    """A lane by its number from the right, from 0, and the number of lanes (None if unknown)."""

    number: int
    count: int | None

    @property
    def names(self) -> frozenset[str] | None:
        """Which of "right" and "left" it is; None if the left one is unknown."""
        if self.count is None:
            return frozenset({"right"}) if self.number == 0 else None
        return frozenset(name for name, at in (("right", 0), ("left", self.count - 1)) if self.number == at)


Value = float | bool | str | frozenset[str] | LanePlace | None
"""Current value of a signal; None if it has none."""


class Place(Enum):
    """Type of an argument in a signal's name."""

    VEHICLE = "vehicle"
    BANK = "fog bank"
    METHOD = "estimator"
    SIGNAL = "traffic light"
    EVENT = "event"
    LENGTH = "length"


@dataclass(frozen=True, slots=True)
class Signal:
    """A quantity of a run that conditions can refer to.

    `value` reads it from a moment and the arguments of its place holders. `unit` is SI, and `shown_unit` the one in
    messages ("" for the SI one). Values outside `least` … `most` cannot occur; `words` are the possible words (empty
    for any).
    """

    meaning: str
    value: Callable[..., Value]
    kind: Kind = Kind.NUMBER
    unit: str = ""
    shown_unit: str = ""
    least: float = -math.inf
    most: float = math.inf
    words: tuple[str, ...] = ()
    places: tuple[Place, ...] = ()
    needs: frozenset[Need] = frozenset()

    @property
    def stated_in(self) -> str:
        """Unit in messages."""
        return self.shown_unit or self.unit

    def read(self, moment: Moment, arguments: tuple[str, ...]) -> Value:
        """Value at a moment; None if it has none."""
        value: Value = self.value(moment, *arguments)
        return None if isinstance(value, float) and math.isnan(value) else value


def speed_signal(meaning: str, value: Callable[..., float | None], **further: object) -> Signal:
    """Signal of a speed, shown in km/h."""
    return Signal(meaning, value, unit="m/s", shown_unit="km/h", least=0.0, **further)  # type: ignore[arg-type]  # its keywords


def length_signal(meaning: str, value: Callable[..., float | None], **further: object) -> Signal:
    """Signal of a length in metres."""
    return Signal(meaning, value, unit="m", **{"least": 0.0, **further})  # type: ignore[arg-type]  # in the same way
