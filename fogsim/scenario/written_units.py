"""Keys whose values bring their unit: ``speed: 90 km/h`` stands for ``speed_kmh: 90``."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, get_args, get_origin

from pydantic import BaseModel

from fogsim.scenario.document import Document
from fogsim.scenario.plain_yaml import KeyPath, dotted
from fogsim.units.quantities import UNIT_OF_SUFFIX, is_quantity, parse_quantity


def with_units_in_keys(document: Document, model: type[BaseModel]) -> tuple[Document, list[str]]:
    """Copy of a document in which values written with their units are numbers, under the keys of the schema."""
    conversion = _Conversion(document)
    data = conversion.block(document.data, (model,), ())
    return replace(document, data=data, origins=conversion.origins), conversion.mistakes


Models = tuple[type[BaseModel], ...]


class _Conversion:
    """Goes down through a document next to its schema."""

    def __init__(self, document: Document) -> None:
        self._document = document
        self.origins = dict(document.origins)
        self.mistakes: list[str] = []

    def block(self, written: dict[str, Any], models: Models, at: KeyPath) -> dict[str, Any]:
        """A block of keys that some of the models have."""
        result: dict[str, Any] = {}
        for key, value in written.items():
            suffixed = [] if _known(key, models) else list(_with_suffix(key, models))
            if suffixed and is_quantity(value):
                name, number = self._quantity(suffixed, value, written, (*at, key))
                result[name] = number
            elif suffixed and isinstance(value, list) and any(is_quantity(one) for one in value):
                read = [self._quantity(suffixed, str(one), written, (*at, key)) for one in value]
                result[read[0][0]] = [number for _, number in read]
            elif isinstance(value, dict) and any(get_origin(_annotation(model, key)) is dict for model in models):
                # Names that people choose, which may be those of keys.
                inside, there = _models_of(key, models), (*at, key)
                result[key] = {name: self._value(one, inside, (*there, name)) for name, one in value.items()}
            else:
                inner = _models_of(key, models)
                is_by_name = isinstance(value, dict) and any(_is_by_name(model, key) for model in models)
                result[key] = (self._by_name if is_by_name else self._value)(value, inner, (*at, key))
        return result

    def _by_name(self, value: dict[str, Any], models: Models, at: KeyPath) -> dict[str, Any]:
        """A mapping from names, which may be those of keys, to blocks."""
        return {name: self._value(one, models, (*at, name)) for name, one in value.items()}

    def _value(self, value: object, models: Models, at: KeyPath) -> object:
        if not models:
            return value
        if isinstance(value, list):
            return [self._value(one, models, (*at, place)) for place, one in enumerate(value)]
        if not isinstance(value, dict):
            return value
        # A mapping by name inside a list or another has blocks of its own, which have other keys.
        if not any(_known(key, models) or list(_with_suffix(key, models)) for key in value):
            return self._by_name(value, models, at)
        of_kind = tuple(model for model in models if value.get("kind") in get_args(_annotation(model, "kind")))
        return self.block(value, of_kind or models, at)

    def _quantity(
        self, suffixed: list[tuple[str, str]], value: str, written: dict[str, Any], at: KeyPath
    ) -> tuple[str, float]:
        name, number = _converted(suffixed, value)
        if name in written:
            self._report(at, f"the key {name} is given too; remove one of them")
        elif isinstance(number, ValueError):
            self._report(at, number)
        if at in self.origins:
            self.origins[*at[:-1], name] = self.origins[at]
        return name, 0.0 if isinstance(number, ValueError) else number

    def _report(self, at: KeyPath, what: object) -> None:
        self.mistakes.append(f"{self._document.where(at)}: {dotted(at)}: {what}")


def _converted(suffixed: list[tuple[str, str]], value: str) -> tuple[str, float | ValueError]:
    """Key and number of a quantity, by the first unit that fits."""
    outcomes: list[tuple[str, float | ValueError]] = []
    for name, unit in suffixed:
        try:
            return name, parse_quantity(value, unit)
        except ValueError as error:
            outcomes.append((name, error))
    return outcomes[0]


def _known(key: object, models: Models) -> bool:
    return any(key in model.model_fields for model in models)


def _with_suffix(key: object, models: Models) -> Iterator[tuple[str, str]]:
    """Keys of models that are a key and a unit, and that unit."""
    for suffix, unit in UNIT_OF_SUFFIX.items():
        if _known(f"{key}_{suffix}", models):
            yield f"{key}_{suffix}", unit


def _annotation(model: type[BaseModel], key: str) -> object:
    field = model.model_fields.get(key)
    return None if field is None else field.annotation


def _is_by_name(model: type[BaseModel], key: str) -> bool:
    return get_origin(_annotation(model, key)) is dict


def _models_of(key: str, models: Models) -> Models:
    return tuple(dict.fromkeys(found for model in models for found in _models_in(_annotation(model, key))))


def _models_in(annotation: object) -> Iterator[type[BaseModel]]:
    """All models inside an annotation such as ``tuple[Bank, ...]``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from _models_in(part)
