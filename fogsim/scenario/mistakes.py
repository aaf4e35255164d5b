"""Mistakes in a file, in lines with file, line, key, value and what is allowed."""

import types
from collections.abc import Iterator, Sequence
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from fogsim.errors import nearest, printable, shown, suggest
from fogsim.scenario.document import Document
from fogsim.scenario.plain_yaml import KeyPath, dotted
from fogsim.units.quantities import UNIT_OF_SUFFIX, example_of, split_quantity

MISTAKE = "parameter"
"""Type of the errors of parameters, whose messages are complete."""

_MOST_LISTED = 50
"""Maximum number of mistakes that are listed one by one."""

_WORDED = {
    "model_type": "must be a block of keys",
    "dict_type": "must be a block of keys",
    "tuple_type": "must be a list",
    "too_short": "must have at least one entry",
    "path_type": "must be a path",
}
"""pydantic's messages in words for users."""

_INPUT = "input should be "

_KEY = "[key]"
"""pydantic's name for a key that does not fit a block of named entries."""


class Mistake(NamedTuple):
    """One mistake in a file, at a path in the file's own keys, described in one line."""

    path: KeyPath
    text: str


class _Found(NamedTuple):
    """A mistake as pydantic reports it, with its path in the file and whether it is that of one type of a union."""

    detail: ErrorDetails
    path: KeyPath
    is_of_union: bool
    models: tuple[type[BaseModel], ...]


def mistake_lines(
    document: Document,
    model: type[BaseModel],
    error: ValidationError,
    further: Sequence[str] = (),
    beside: Sequence[str] = (),
) -> str:
    """One line for each mistake, followed by `further` lines; `beside` are top-level keys outside the schema."""
    found = mistakes_in(model, error, document.data, beside)
    lines = [
        ": ".join((document.where(path), *([dotted(path)] if path else []), text))
        for path, text in found[:_MOST_LISTED]
    ]
    if len(found) > _MOST_LISTED:
        lines.append(f"{document.path}: and {len(found) - _MOST_LISTED} more mistakes")
    return "\n".join([*lines, *further])


def mistakes_in(schema: object, error: ValidationError, data: object, beside: Sequence[str] = ()) -> list[Mistake]:
    """Every mistake once, without those that only follow from another.

    A list with wrong entries is not too short, a misspelt key is not missing, and a value that fits none of several
    types is one mistake. `beside` are top-level keys outside the schema.
    """
    details = [one for one in error.errors(include_url=False) if one["type"] != "default_factory_not_called"]
    blocks = {detail["loc"][:length] for detail in details for length in range(len(detail["loc"]))}
    found = [_found(schema, detail, data) for detail in details if detail["loc"] not in blocks]
    inside = {one.path[:length] for one in found for length in range(len(one.path))}
    found = [one for one in found if not (one.is_of_union and one.path in inside)]
    meant = {_meant(one) for one in found if one.detail["type"] == "extra_forbidden"}
    by_path: dict[KeyPath, list[_Found]] = {}
    for one in found:
        if one.detail["type"] != "missing" or one.path not in meant:
            # A value that fits none of several types is one mistake; other mistakes at one key stay separate.
            at = (*one.path, *(() if one.is_of_union else (len(by_path),)))
            by_path.setdefault(at, []).append(one)
    return [Mistake(those[0].path, _text(those, beside)) for those in by_path.values()]


def _found(schema: object, detail: ErrorDetails, data: object) -> _Found:
    is_unknown = detail["type"] == "extra_forbidden"
    path, allowed, is_of_union = _own_path(schema, detail["loc"][: -1 if is_unknown else None], data)
    if is_unknown:
        path = (*path, detail["loc"][-1])
    if detail["type"].startswith("union_tag"):
        path = (*path, str(detail["ctx"]["discriminator"]).strip("'"))
    return _Found(detail, path, is_of_union, tuple(one for one in allowed if _is_model(one)))


def _meant(one: _Found) -> KeyPath:
    """Path of the known key that is nearest to an unknown one."""
    return (*one.path[:-1], nearest(str(one.path[-1]), _keys_of(one.models)) or "")


def _text(those: Sequence[_Found], beside: Sequence[str]) -> str:
    """Mistakes of one value in one line."""
    one = those[0]
    detail, context = one.detail, one.detail.get("ctx", {})
    match detail["type"]:
        case "extra_forbidden":
            known = [*_keys_of(one.models), *(beside if len(one.path) == 1 else ())]
            return _unknown_key(str(one.path[-1]), known, detail["input"])
        case "union_tag_invalid":
            allowed = [kind.strip(" '") for kind in str(context["expected_tags"]).split(",")]
            key, tag = one.path[-1], str(context["tag"])
            return f"unknown {key} {shown(tag)}; {suggest(tag, allowed)}"
        case "missing" | "union_tag_not_found":
            return "this key is missing; it is required"
        case kind if kind == MISTAKE:
            return printable(detail["msg"], in_one_line=True)
    messages = list(dict.fromkeys(map(_message, (each.detail for each in those))))
    message = ", or ".join([messages[0], *(text.removeprefix(_INPUT) for text in messages[1:])])
    value = detail["input"]
    if isinstance(value, dict | BaseModel):
        # A message about a whole block names its values itself.
        return f"{message}; got a block of keys" if detail["type"].endswith("_type") else message
    got = f"got {shown(value)}"
    return message if got in message else f"{message}; {got}{_plain_number(one.path, value)}"


def _unknown_key(key: str, known: Sequence[str], value: object) -> str:
    """A key that is not known, or that lacks its unit."""
    units = [(full, unit) for suffix, unit in UNIT_OF_SUFFIX.items() if (full := f"{key}_{suffix}") in known]
    if not units or isinstance(value, dict):
        return f"unknown key; {suggest(key, known)}"
    full, unit = units[0]
    return f"expected a value with its unit such as {example_of(unit)!r}, or {full}; got {shown(value)}"


def _plain_number(path: KeyPath, value: object) -> str:
    """How to write a number with a unit under a key that ends with its own; "" for other values."""
    _, _, suffix = str(path[-1] if path else "").rpartition("_")
    unit = UNIT_OF_SUFFIX.get(suffix)
    written = split_quantity(value) if isinstance(value, str) and unit else None
    return f"; write the number alone, in {unit}, such as {written[0]:g}" if written and written[1] else ""


def _message(detail: ErrorDetails) -> str:
    message = _WORDED.get(detail["type"], detail["msg"].removeprefix("Value error, "))
    return printable(f"{message[0].lower()}{message[1:]}", in_one_line=True)


def _own_path(schema: object, location: Sequence[str | int], data: object) -> tuple[KeyPath, tuple[Any, ...], bool]:
    """Path of a mistake in the file's own keys, the types allowed there, and whether a union failed.

    pydantic's locations also contain what it tried: the type in a union, the tag of a block, ``[key]``.
    """
    allowed: tuple[Any, ...] = tuple(_alternatives(schema))
    path: list[str | int] = []
    is_of_union = False
    for key in location:
        tagged: tuple[Any, ...] = tuple(one for one in allowed if _is_model(one) and key in _tags(one))
        is_there = (isinstance(data, dict) and key in data) or (isinstance(data, list | tuple) and isinstance(key, int))
        is_field = any(_is_model(one) and key in _fields(one) for one in allowed)
        # Keys of named blocks that a validator has made are not in the file.
        is_made = key != _KEY and allowed != () and all(get_origin(one) is dict for one in allowed)
        if tagged and len(allowed) > 1:
            allowed = tagged
        elif is_there or is_field or is_made:
            path.append(key)
            allowed = tuple(inner for one in allowed for inner in _inside(one, key))
            data = _value(data, key)
        else:
            is_of_union |= key != _KEY
    return tuple(path), allowed, is_of_union


def _value(data: object, key: str | int) -> object:
    if isinstance(data, dict):
        return data.get(key)
    return data[key] if isinstance(data, list | tuple) and isinstance(key, int) and key < len(data) else None


def _alternatives(annotation: object) -> Iterator[Any]:
    """Possible types of a value: ``X | None`` is ``X`` and ``None``."""
    if get_origin(annotation) is Annotated:
        yield from _alternatives(get_args(annotation)[0])
    elif get_origin(annotation) in (Union, types.UnionType):
        for part in get_args(annotation):
            yield from _alternatives(part)
    else:
        yield annotation


def _inside(annotation: Any, key: str | int) -> Iterator[Any]:
    """Possible types of the value at a key."""
    arguments = get_args(annotation)
    if _is_model(annotation):
        field = _fields(annotation).get(key)
        yield from () if field is None else _alternatives(field)
    elif get_origin(annotation) is dict:
        yield from _alternatives(arguments[1])
    elif get_origin(annotation) in (tuple, list) and isinstance(key, int):
        is_fixed = get_origin(annotation) is tuple and arguments[-1] is not ...
        yield from _alternatives(arguments[key if is_fixed and key < len(arguments) else 0])


def _is_model(annotation: object) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


def _fields(model: type[BaseModel]) -> dict[str | int, Any]:
    """Types of a model's fields, by their keys in files."""
    named = model.model_fields.items()
    return {field.alias or name: field.annotation for name, field in named if not field.exclude}


def _tags(model: type[BaseModel]) -> tuple[str, ...]:
    """Names that pydantic gives a model in a union: its own, or its tags."""
    literals = [annotation for annotation in _fields(model).values() if get_origin(annotation) is Literal]
    return (model.__name__, *(tag for literal in literals for tag in get_args(literal)))


def _keys_of(models: Sequence[type[BaseModel]]) -> list[str]:
    return list(dict.fromkeys(str(key) for model in models for key in _fields(model)))
