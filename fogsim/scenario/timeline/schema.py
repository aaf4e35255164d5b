"""The schema of the block ``timeline``: what is to happen when; ``do`` has one block for each of its subjects."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BeforeValidator,
    Field,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydantic_core import InitErrorDetails, PydanticCustomError

from fogsim.scenario.expect.conditions import WrittenCondition
from fogsim.scenario.mistakes import MISTAKE, mistakes_in
from fogsim.scenario.section import (
    Id,
    Number,
    Period,
    Section,
    Time,
    Visibility,
    Whole,
)
from fogsim.scenario.sensors.faults import AnyFault
from fogsim.scenario.timeline.vehicle_actions import VehicleActions


class SignalActions(Section):
    """What traffic lights show."""

    phase: Annotated[Whole, Field(ge=0, le=200)] | None = None
    """Phase of the program to go to, which goes on from there."""

    state: Annotated[str, Field(pattern="^(red|yellow|green|off|[rygGsuoO]{1,200})$")] | None = None
    """`red`, `yellow`, `green` or `off` for all links, or SUMO's letter for each link (`rrGGrr`), held in place of the
    program."""

    for_s: Period | None = None
    """Time after which the program goes on; without it, to the end of the run."""

    @model_validator(mode="after")
    def _one_state(self) -> Self:
        if (self.phase is None) == (self.state is None):
            raise ValueError("say what they show: phase or state, and not both")
        return self


class FogActions(Section):
    """How the fog changes, everywhere."""

    visibility_m: Visibility | None = None
    """Meteorological visibility to come to, where it is even or outside the banks."""

    density: Annotated[Number, Field(ge=0, le=1000)] | None = None
    """Or factor of the extinction coefficient that the scenario begins with."""

    over_s: Time = 0.0
    """Time that this takes."""

    @model_validator(mode="after")
    def _one_measure(self) -> Self:
        if (self.visibility_m is None) == (self.density is None):
            raise ValueError("say how thick: visibility_m or density, and not both")
        return self


class LightActions(Section):
    """How daylight changes."""

    illuminance_lx: Annotated[Number, Field(ge=0, le=200_000)]
    """Horizontal illuminance to come to. If any is below 1000, where lamps light the road, they do in the whole run."""

    over_s: Time = 0.0
    """Time that this takes."""

    course: Literal["lux", "factors"] = "lux"
    """`lux`: by as many lux in each second; `factors`: by the same factor, as dusk and dawn do."""

    @model_validator(mode="after")
    def _never_dark(self) -> Self:
        if self.course == "factors" and self.illuminance_lx == 0.0:
            raise ValueError("no factor leads to illuminance_lx: 0; write 0.0001, an overcast night, or course: lux")
        return self


Doing = VehicleActions | SignalActions | FogActions | LightActions | AnyFault
"""What an entry does to one of its subjects."""

_KINDS: Mapping[str, type[Section]] = {"fog": FogActions, "light": LightActions}
_SIGNAL, _SENSOR = "signal.", "sensors."
_FAULTS: TypeAdapter[AnyFault] = TypeAdapter(AnyFault)


def _by_subject(written: object) -> object:
    """Read each block by what its subject is: fog, light, a sensor, traffic lights, or else a vehicle."""
    if not isinstance(written, dict):
        return written
    done: dict[str, tuple[object, ...]] = {}
    mistakes: list[InitErrorDetails] = []
    for subject, blocks in _flat(written):
        listed = blocks if isinstance(blocks, list | tuple) else [blocks]
        done[subject] = ()
        for place, block in enumerate(listed):
            at = (subject, place) if isinstance(blocks, list | tuple) else (subject,)
            try:
                done[subject] += (_read(subject, block),)
            except ValidationError as error:
                mistakes += [
                    InitErrorDetails(
                        type=PydanticCustomError(MISTAKE, "{message}", {"message": text}), loc=(*at, *inner), input=0
                    )
                    for inner, text in mistakes_in(_schema_of(subject), error, block)
                ]
    if mistakes:
        raise ValidationError.from_exception_data("do", mistakes)
    return done


def _flat(written: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Subjects and their blocks; ``--set`` makes blocks in blocks of a name with a dot."""
    for subject, block in written.items():
        if subject in ("signal", "sensors") and isinstance(block, dict):
            yield from ((f"{subject}.{name}", inner) for name, inner in block.items())
        else:
            yield str(subject), block


def _read(subject: str, block: object) -> object:
    if isinstance(block, Section):
        return block
    if subject.startswith(_SENSOR):
        sensor = subject.removeprefix(_SENSOR)
        return _FAULTS.validate_python({"sensor": sensor, **block} if isinstance(block, dict) else block)
    kind = _kind_of(subject)
    read = kind.model_validate(block)
    if not read.model_fields_set:
        message = f"no action given; allowed: {', '.join(kind.model_fields)}"
        mistake = InitErrorDetails(
            type=PydanticCustomError(MISTAKE, "{message}", {"message": message}), loc=(), input=0
        )
        raise ValidationError.from_exception_data("do", [mistake])
    return read


def _schema_of(subject: str) -> object:
    return AnyFault if subject.startswith(_SENSOR) else _kind_of(subject)


def _kind_of(subject: str) -> type[Section]:
    return SignalActions if subject.startswith(_SIGNAL) else _KINDS.get(subject, VehicleActions)


class TimelineEntry(Section):
    """Something that happens when a condition holds."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]{0,99}$")] | None = None
    """Name in conditions, expectations and messages; `timeline.N` without one."""

    when: WrittenCondition
    """Condition: text such as `gap(ego, slow) < 80 m and ego.speed > 50 km/h`, or a mapping; see
    docs/reference/tests.md."""

    delay_s: Time = 0.0
    """Time from then until it begins."""

    repeat: Literal["once", "each"] = "once"
    """`once`: when the condition holds for the first time; `each`: each time that it comes to hold."""

    do: Annotated[dict[Id, Doing | tuple[Doing, ...]], BeforeValidator(_by_subject)]
    """What, by its subjects: the id of a vehicle (or `ego`), `signal.ID`, `fog`, `light`, `sensors.camera` and other
    sensors, each with a block or a list of blocks. `{}` in an entry with a name for nothing: it remembers that its
    condition has held, as `happened(NAME)`."""

    @field_validator("do")
    @classmethod
    def _something(cls, value: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
        if not value and not info.data.get("name"):
            raise ValueError("must say what is done, or the entry must have a name by which happened(NAME) asks for it")
        return value


Timeline = tuple[TimelineEntry, ...]
"""The block."""
