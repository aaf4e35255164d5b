"""What all blocks of a scenario file share: strictness, types and ranges of values, and named methods.

The ranges are wide but physical: a value beyond them is a typing mistake or in another unit. Booleans are not numbers,
text is neither, and values are finite unless declared otherwise. Parameters of methods are checked against their
constructors.
"""

import ast
import inspect
import itertools
import math
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    GetJsonSchemaHandler,
    ValidationError,
    ValidationInfo,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, InitErrorDetails, PydanticCustomError

from fogsim.core.parameters import parameter_mistakes, paths_in
from fogsim.core.registry import Registry
from fogsim.core.registry.user_code import import_anything
from fogsim.errors import InputError, is_name
from fogsim.scenario.mistakes import MISTAKE, mistakes_in
from fogsim.scenario.plain_yaml import dotted
from fogsim.units import KMH_PER_MPS
from fogsim.units.quantities import UNIT_OF_SUFFIX, is_quantity, parse_quantity

FARTHEST = 1e6
"""Longest length, and longest time, that a scenario may name [m, s]."""

Flag = Annotated[bool, Field(strict=True)]
"""true or false."""

Whole = Annotated[int, Field(strict=True)]
"""A whole number."""

Seed = Annotated[Whole, Field(ge=0, le=2**63 - 1)]
"""Seed of random numbers."""

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
"""A finite number."""


def _percent(value: object) -> object:
    """Let a share be written in per cent."""
    is_percent = isinstance(value, str) and is_quantity(value) and value.rstrip().endswith("%")
    return parse_quantity(str(value), "") if is_percent else value


Share = Annotated[Number, Field(ge=0, le=1), BeforeValidator(_percent)]
"""A share [-], perhaps written in per cent: 0.6, or ``60 %``."""

Time = Annotated[Number, Field(ge=0, le=FARTHEST)]
"""A time from zero [s]."""

Period = Annotated[Number, Field(ge=0.001, le=FARTHEST)]
"""A time that must pass [s]; SUMO counts milliseconds."""

Moment = Annotated[Number, Field(ge=-FARTHEST, le=FARTHEST)]
"""A time, also before the beginning [s]."""

Distance = Annotated[Number, Field(ge=0, le=FARTHEST)]
"""A length from zero [m]."""

Length = Annotated[Number, Field(ge=0.001, le=FARTHEST)]
"""A length that cannot be zero [m]."""

Place = Annotated[Number, Field(ge=-FARTHEST, le=FARTHEST)]
"""A height, or a place along a road [m]."""

Coordinate = Annotated[Number, Field(ge=-1e7, le=1e7)]
"""An x or y of a network [m]; those of UTM reach so far."""

SpeedKmh = Annotated[Number, Field(ge=0, le=500)]
"""A speed [km/h]."""

Deceleration = Annotated[Number, Field(ge=0.01, le=50)]
"""How hard a vehicle brakes [m/s²]."""

Pixels = Annotated[Number, Field(ge=1, le=1e6)]
"""A length in the image [px]."""

PixelPlace = Annotated[Number, Field(ge=-1e6, le=1e6)]
"""A row or column, also next to the image [px]."""

Luminance = Annotated[Number, Field(ge=1e-6, le=1e9)]
"""A luminance [cd/m²]."""

Text = Annotated[str, Field(max_length=1000)]
"""Text of some lines."""


def _name(value: str) -> str:
    if not is_name(value):
        raise ValueError("a name has visible characters, no < and no blank at its ends")
    return value


Id = Annotated[str, Field(min_length=1, max_length=200), AfterValidator(_name)]
"""Name of a vehicle, road or the like in SUMO's files."""

_REFUSED_BY_SUMO = " |\\'\";,<>&"


def _name_for_sumo(value: str) -> str:
    if any(one in _REFUSED_BY_SUMO for one in value):
        raise ValueError(f"a name in SUMO has no blank and none of {_REFUSED_BY_SUMO.strip()}")
    return value


NewId = Annotated[Id, AfterValidator(_name_for_sumo)]
"""Name of a vehicle or person that FogSim writes into SUMO's files."""


def _infinity(value: object) -> object:
    """Let what has no end be written as inf, infinity or .inf."""
    return math.inf if isinstance(value, str) and value.strip().lower() in {"inf", "infinity", ".inf"} else value


def _far_or_endless(value: float) -> float:
    if FARTHEST < value < math.inf:
        raise ValueError(f"must be at most {FARTHEST:g} m, or inf")
    return value


def _endless(least: float) -> object:
    """Range of a length of at least so much [m] that may be infinite, for the schema's readers."""
    return Field(strict=True, ge=least, json_schema_extra={"maximum": FARTHEST, "or": "inf"})


Reach = Annotated[float, _endless(0.0), BeforeValidator(_infinity), AfterValidator(_far_or_endless)]
"""Length that may be infinite [m]."""

Visibility = Annotated[float, _endless(1.0), BeforeValidator(_infinity), AfterValidator(_far_or_endless)]
"""A meteorological visibility [m]; inf is clear air."""

Top = Annotated[float, _endless(-FARTHEST), BeforeValidator(_infinity), AfterValidator(_far_or_endless)]
"""A height that may be without end [m]."""


RoadEnd = Annotated[float, _endless(0.0), BeforeValidator(_infinity), AfterValidator(_far_or_endless)]
"""A place along a road [m]; inf is where it ends."""


if TYPE_CHECKING:  # Type checkers take arguments from the fields.
    from pydantic._internal._model_construction import ModelMetaclass as _Block
else:

    class _Block(type(BaseModel)):
        """Reports mistakes of blocks that are made in Python, as the files' are."""

        def __call__(cls, *arguments: Any, **values: Any) -> Any:
            try:
                return super().__call__(*arguments, **values)
            except ValidationError as error:
                found = mistakes_in(cls, error, values)
            lines = [": ".join((cls.__name__, *([dotted(path)] if path else []), text)) for path, text in found]
            raise InputError("\n".join(lines))


class Section(BaseModel, metaclass=_Block):
    """A block of a scenario file: unknown keys are errors, values never change."""

    # Built on first use: at import, each of a hundred blocks would be built for itself.
    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)

    @classmethod
    def __get_pydantic_json_schema__(cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler, /) -> JsonSchemaValue:
        """JSON Schema of the block, with its keys' docstrings as descriptions."""
        written = handler(core_schema)
        properties = handler.resolve_ref_schema(written)["properties"]
        for name, text in key_descriptions(cls).items():
            key = cls.model_fields[name].alias or name
            properties[key] = dict(sorted({**properties[key], "description": text}.items()))
        return written


def key_descriptions(section: type[BaseModel]) -> dict[str, str]:
    """Docstrings of a block's keys, by attribute; pydantic would read every block's source when it is imported."""
    found: dict[str, str] = {}
    for cls in reversed(section.mro()):
        if cls is not Section and issubclass(cls, Section):
            body = _classes(cls.__module__)[cls.__name__].body
            for node, following in itertools.pairwise(body):
                if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
                    match following:
                        case ast.Expr(ast.Constant(str(text))):
                            found[node.target.id] = inspect.cleandoc(text)
    return found


@cache
def _classes(module: str) -> dict[str, ast.ClassDef]:
    tree = ast.parse(inspect.getsource(sys.modules[module]))
    return {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}


def in_si(section: Section, *without: str) -> dict[str, Any]:
    """Values of a block by its keys without units, in m/s and radians; keys `without` a counterpart are left out."""
    values = {}
    for key in type(section).model_fields.keys() - set(without):
        stem, _, unit = key.rpartition("_")
        value = getattr(section, key)
        value = math.radians(value) if unit == "deg" else value / KMH_PER_MPS if unit == "kmh" else value
        values[stem if unit in UNIT_OF_SUFFIX else key] = value
    return values


GIVEN_BY_THE_LOOP = frozenset({"camera"})
"""Constructor arguments that the loop passes, so that no scenario sets them."""


class Method(Section):
    """A named method and its parameters."""

    method: str
    """Name of the method (`fogsim list`), `module:Class` or `onnx:FILE`."""

    parameters: dict[str, Any] = Field(default_factory=dict)
    """Arguments of its constructor, in SI units."""


def method_of(registry: Registry[Callable[..., Any]]) -> BeforeValidator:
    """Validator of a registry's methods, written as a name or with parameters, which must fit the constructor."""

    def check(value: object, info: ValidationInfo) -> object:
        written = {"method": value} if isinstance(value, str) else value
        if isinstance(written, dict) and isinstance(written.get("method"), str):
            try:
                context = info.context or {}
                may_import = context.get("may_import", import_anything)
                factory = registry.find_if_allowed(written["method"], context.get("folder"), may_import)
            except InputError as error:
                # pydantic shows only a plain ValueError's message.
                raise ValueError(str(error)) from None
            if factory is not None:
                _check_parameters(factory, written.get("parameters"), context.get("folder"))
        return written

    return BeforeValidator(check)


def _check_parameters(factory: Callable[..., Any], parameters: object, folder: Path | None) -> None:
    if not isinstance(parameters, dict | None):
        return  # the model says what it must be
    given = parameters or {}
    found = list(parameter_mistakes(factory, given, GIVEN_BY_THE_LOOP))
    if folder is not None:
        paths = paths_in(factory, given, folder)
        found += [(name, f"there is no file {path}") for name, path in paths.items() if not path.is_file()]
    mistakes = [
        InitErrorDetails(
            type=PydanticCustomError(MISTAKE, "{message}", {"message": message}), loc=("parameters", name), input=0
        )
        for name, message in found
    ]
    if mistakes:
        raise ValidationError.from_exception_data("parameters", mistakes)
