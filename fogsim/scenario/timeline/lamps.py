"""Lamps in a scenario file: what is switched by hand or fails, kind by kind and side by side."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Literal, Self, cast, get_args

from pydantic import BeforeValidator, WrapValidator, model_validator

from fogsim.scenario.section import Section
from fogsim.values import Lamp
from fogsim.values.light import Side
from fogsim.values.script import SetLamps

Switch = Literal["on", "off", "failed", "automatic"]
"""State of a lamp: lit or dark by hand, dark for ever, or the vehicle's own."""


def _word(value: object) -> object:
    """Words that YAML takes for truth values."""
    return {True: "on", False: "off"}[value] if isinstance(value, bool) else value


Lit = Annotated[Switch, BeforeValidator(_word)] | None


class LampSides(Section):
    """Lamps of one kind on either side, seen along the direction of travel; what is not written stays as it is."""

    left: Lit = None
    """The left one; of position lamps with the tail lamp, the front one too."""

    right: Lit = None
    """The right one."""

    @model_validator(mode="after")
    def _says_something(self) -> Self:
        if not self.model_fields_set:
            raise ValueError(f"no action given; allowed: {', '.join(type(self).model_fields)}")
        return self


class StopLampSides(LampSides):
    """Stop lamps; cars, vans and buses have a third one."""

    middle: Lit = None
    """The third one, in the middle."""


def _word_or_sides(sides: type[LampSides]) -> WrapValidator:
    """Distinguish a word from a block of sides, so that an error in one is not reported for the other as well."""

    def check(value: object, _: object) -> Switch | LampSides:
        if isinstance(value, dict | LampSides):
            return sides.model_validate(value)
        for word in get_args(Switch):
            if _word(value) == word:
                return cast("Switch", word)
        raise ValueError(f"must be {', '.join(get_args(Switch))}, or a block of {', '.join(sides.model_fields)}")

    return WrapValidator(check)


Paired = Annotated[Switch | LampSides, _word_or_sides(LampSides)] | None
"""State of the lamps of a kind, or of those on each side."""

StopLamps = Annotated[Switch | StopLampSides, _word_or_sides(StopLampSides)] | None
"""The same of stop lamps."""


class LampActions(Section):
    """Lamps switched by hand: `on`, `off`, `failed` (dark for ever), or `automatic`, the vehicle's own again.

    Of what there are two, a block may say it side by side: `{left: failed}`.
    """

    position: Paired = None
    """Position lamps."""

    low_beam: Paired = None
    """Low beam."""

    high_beam: Paired = None
    """High beam."""

    front_fog: Paired = None
    """Front fog lamps."""

    rear_fog: Paired = None
    """Rear fog lamps."""

    stop: StopLamps = None
    """Stop lamps."""

    indicator_left: Lit = None
    """Left indicators."""

    indicator_right: Lit = None
    """Right indicators."""

    daytime: Paired = None
    """Daytime running lamps."""

    all: Lit = None
    """Every lamp that has no key of its own here."""

    def kinds_by_side(self) -> tuple[str, ...]:
        """Kinds whose sides are distinguished."""
        return tuple(key for key in type(self).model_fields if isinstance(getattr(self, key), LampSides))


def lamp_mistake(kind: str, written: LampActions) -> str | None:
    """What a block of lamps wants of a vehicle that has no such lamp."""
    apart = written.kinds_by_side()
    if kind == "motorcycle" and apart:
        return f"lamps: {' and '.join(apart)} of a motorcycle are single; write one word for each"
    if kind == "truck" and isinstance(written.stop, StopLampSides) and written.stop.middle is not None:
        return "lamps.stop.middle: a truck has no third stop lamp; allowed: left, right"
    return None


def lamp_switches(vehicle: str, written: LampActions) -> Iterator[SetLamps]:
    """Switches of lamps, which files name as `Lamp` does in small letters: of whole kinds, then side by side."""
    states = {lamp: getattr(written, (lamp.name or "").lower()) or written.all for lamp in Lamp}
    yield _switch(vehicle, {lamp: state for lamp, state in states.items() if isinstance(state, str)}, None)
    for side in Side:
        apart = {lamp: getattr(state, side, None) for lamp, state in states.items() if isinstance(state, LampSides)}
        if any(apart.values()):
            yield _switch(vehicle, apart, side)


def _switch(vehicle: str, states: Mapping[Lamp, str | None], side: Side | None) -> SetLamps:
    def those(state: str) -> Lamp:
        return Lamp(sum(lamp for lamp, value in states.items() if value == state))

    return SetLamps(vehicle, those("on"), those("off"), those("failed"), those("automatic"), side)
