"""Settings of a scenario that differ from the defaults of its schema."""

from collections.abc import Iterator
from typing import Any, NamedTuple

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from fogsim.scenario.schema import ScenarioFile
from fogsim.scenario.section import key_descriptions

_WORDS = frozenset({"name", "description", "expect", "directory"})
"""Keys that decide nothing about a run."""


class Setting(NamedTuple):
    """A key's value and default as in a scenario file ("" if the key is required), and the key's description."""

    value: str
    default: str
    meaning: str


def non_default_settings(scenario: ScenarioFile) -> dict[str, Setting]:
    """Settings by key path, as in a scenario file."""
    return dict(_of_section(scenario, type(scenario).model_construct(), ()))


def _of_section(section: BaseModel, usual: object, path: tuple[str, ...]) -> Iterator[tuple[str, Setting]]:
    meanings = key_descriptions(type(section))
    for key, field in type(section).model_fields.items():
        if not path and key in _WORDS:
            continue
        value = getattr(section, key)
        default = getattr(usual, key) if isinstance(usual, type(section)) and hasattr(usual, key) else _default(field)
        if value != default:
            yield from _of_value(value, default, (*path, key), meanings.get(key, ""))


def _default(field: FieldInfo) -> object:
    return "" if field.is_required() else field.get_default(call_default_factory=True, validated_data={})


def _of_value(value: object, default: object, path: tuple[str, ...], meaning: str) -> Iterator[tuple[str, Setting]]:
    """Leaves of a value; lists and tables of sections are followed by number and by name."""
    if isinstance(value, BaseModel) and "parameters" not in type(value).model_fields:
        yield from _of_section(value, default, path)
    elif isinstance(value, tuple) and value and isinstance(value[0], BaseModel):
        for number, one in enumerate(value):
            yield from _of_value(one, None, (*path, str(number)), meaning)
    elif isinstance(value, dict) and value and isinstance(next(iter(value.values())), BaseModel):
        for name, one in value.items():
            yield from _of_value(one, None, (*path, name), meaning)
    else:
        usual = "" if default is None and isinstance(value, BaseModel) else shown_value(default)
        yield ".".join(path), Setting(shown_value(value), usual, " ".join(meaning.split()))


def shown_value(value: Any) -> str:
    """A value as in a scenario file; methods by name with their parameters."""
    if isinstance(value, BaseModel):
        value = value.model_dump(mode="json", exclude_defaults=True)
    if isinstance(value, dict):
        method, others = value.get("method"), {key: one for key, one in value.items() if key != "method"}
        if method is not None and not others:
            return str(method)
        return "{" + ", ".join(f"{key}: {shown_value(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(shown_value, value)) + "]"
    if isinstance(value, bool) or value is None:
        return {True: "true", False: "false", None: "none"}[value]
    return f"{value:.10g}" if isinstance(value, float) else str(value)
