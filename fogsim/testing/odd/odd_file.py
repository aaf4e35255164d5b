"""ODD files: OpenODD documents and the binding to FogSim's signals, read without running or fetching anything."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, ValidationError, model_validator

from fogsim.conditions import SIGNALS, Kind, Reference, parse_signal
from fogsim.errors import InputError, is_name, shown, suggest
from fogsim.scenario.document import Document, read_document
from fogsim.scenario.expect.conditions import refuse
from fogsim.scenario.mistakes import mistake_lines
from fogsim.scenario.plain_yaml import KeyPath
from fogsim.scenario.section import Number, Section, Text
from fogsim.units.quantities import parse_quantity

_SHIPPED = Path(__file__).with_name("shipped")
_ENDING = ".odd.yaml"

_KEYS = ("IMPORT", "TAXONOMY", "MODULES", "ODD")
"""Blocks of OpenODD documents that are read; others, ``conversion`` among them, would change what units mean."""

_MOST_FILES, _MOST_EDGES = 50, 100

_MEASURED = (Kind.NUMBER, Kind.FLAG, Kind.WORD)
"""Types of signals that have buckets."""


class _Criteria(Section):
    """When a bucket counts as covered."""

    cover_by: Literal["hits", "seconds", "meters", "entries"] = "hits"
    target: Annotated[int, Field(strict=True, ge=1)] = 1
    min_stay: Annotated[Number, Field(ge=0)] | None = None


class _Probe(_Criteria):
    """How a concept is measured."""

    signal: Text
    unit: Text = ""
    buckets: Annotated[tuple[Number, ...], Field(min_length=2, max_length=_MOST_EDGES)] | None = None
    values: Annotated[tuple[Text, ...], Field(min_length=1, max_length=_MOST_EDGES)] | None = None
    text: Text = ""

    @model_validator(mode="after")
    def _fits_signal(self) -> Self:
        refuse(self._mistakes())
        return self

    def _mistakes(self) -> Iterator[tuple[KeyPath, str]]:
        try:
            signal = SIGNALS[parse_signal(self.signal).signal]
        except ValueError as error:
            yield ("signal",), str(error)
            return
        if signal.kind not in _MEASURED:
            yield ("signal",), f"{self.signal} is {signal.kind.value}; expected a number, a word, or true or false"
        if signal.kind is Kind.NUMBER and signal.unit and not self.unit:
            yield ("unit",), f"{self.signal} has a unit; expected one such as {signal.stated_in!r}"
        elif signal.kind is Kind.NUMBER:
            try:
                parse_quantity(f"1 {self.unit}", signal.unit)
            except ValueError as error:
                yield ("unit",), str(error)
        elif self.unit:
            yield ("unit",), f"{self.signal} has no unit"
        if self.buckets and signal.kind is not Kind.NUMBER:
            yield ("buckets",), f"{self.signal} is no number; write values, or leave both out"
        if self.values and signal.kind is Kind.NUMBER:
            yield ("values",), f"{self.signal} is a number; write buckets, the edges between them"
        if self.buckets and any(low >= high for low, high in pairwise(self.buckets)):
            yield ("buckets",), f"edges must ascend, got {list(self.buckets)}"


class _BindingFile(Section):
    """A binding file, in the format of openodd-py as far as nothing in it is run or fetched."""

    openodd: Annotated[tuple[Text, ...], Field(min_length=1, max_length=_MOST_FILES)]
    name: Annotated[Text, Field(min_length=1)] | None = None
    text: Text = ""
    probes: Annotated[dict[Text, _Probe], Field(min_length=1)]
    situations: dict[Text, _Criteria] = Field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Probe:
    """What measures a concept: a signal and the unit of its buckets and conditions ("" without one)."""

    signal: Reference
    unit: str

    @property
    def divisor(self) -> float:
        """The unit in the signal's SI unit; 1 without one."""
        return parse_quantity(f"1 {self.unit}", SIGNALS[self.signal.signal].unit) if self.unit else 1.0


@dataclass(frozen=True, slots=True)
class OddFile:
    """An ODD as plain values, which any process and node can use without its files.

    `documents` are OpenODD documents as JSON, those that others import first; `criteria` and `situations` have the keys
    of openodd-py's binding.
    """

    path: Path
    name: str
    text: str
    documents: tuple[str, ...]
    probes: Mapping[str, Probe]
    criteria: Mapping[str, Mapping[str, Any]]
    situations: Mapping[str, Mapping[str, Any]]

    def keyed(self, key: str) -> str:
        """Key of a run's result with the coverage of this ODD."""
        units = {name: (str(probe.signal), probe.unit) for name, probe in self.probes.items()}
        content = [key, self.name, self.text, self.documents, units, self.criteria, self.situations]
        return hashlib.sha256(json.dumps(content, sort_keys=True, default=dict).encode()).hexdigest()[:20]


def shipped_odds() -> list[str]:
    """Names of the ODDs that ship with FogSim."""
    return sorted(file.name.removesuffix(_ENDING) for file in _SHIPPED.glob(f"*{_ENDING}"))


def read_odd(name: str) -> OddFile:
    """Read a shipped ODD by its name, or the ODD of a binding file; InputError has a line for each mistake."""
    path = _SHIPPED / f"{name}{_ENDING}" if name in shipped_odds() else Path(name)
    if is_name(name) and not path.exists():
        raise InputError(f"ODD {shown(name)}: there is no such file and no such ODD; {suggest(name, shipped_odds())}")
    document = read_document(path)
    try:
        binding = _BindingFile.model_validate(document.data)
    except ValidationError as error:
        raise InputError(mistake_lines(document, _BindingFile, error)) from error
    own = {"signal", "unit", "text"}
    return OddFile(
        path,
        binding.name or path.name.removesuffix(_ENDING),
        binding.text,
        tuple(json.dumps(data, indent=1) for data in _documents(document, binding.openodd)),
        {name: Probe(parse_signal(one.signal), one.unit) for name, one in binding.probes.items()},
        {
            name: {**one.model_dump(exclude=own, exclude_none=True, mode="json"), "text": one.text or one.signal}
            for name, one in binding.probes.items()
        },
        {name: one.model_dump(exclude_none=True, mode="json") for name, one in binding.situations.items()},
    )


def _documents(binding: Document, names: tuple[str, ...]) -> list[dict[str, Any]]:
    """Content of OpenODD documents and what they import, without the imports."""
    folder, found = binding.path.parent.resolve(), dict[Path, dict[str, Any]]()
    waiting = [(binding, ("openodd", index), name) for index, name in enumerate(names)]
    while waiting:
        importing, key, name = waiting.pop()
        path = (importing.path.parent / name).resolve()
        if not path.is_relative_to(folder):
            raise InputError(f"{importing.where(key)}: {shown(name)} is not in the folder of {binding.path}")
        if path in found:
            continue
        if len(found) == _MOST_FILES:
            raise InputError(f"{importing.where(key)}: more than {_MOST_FILES} files")
        document = read_document(path)
        for block in document.data:
            if block not in _KEYS:
                raise InputError(f"{document.where((block,))}: unknown key {shown(block)}; {suggest(block, _KEYS)}")
        imports = document.data.pop("IMPORT", [])
        if not isinstance(imports, list) or not all(isinstance(one, str) for one in imports):
            raise InputError(f"{document.where(('IMPORT',))}: IMPORT: expected a list of files, got {shown(imports)}")
        found[path] = document.data
        waiting += [(document, ("IMPORT", index), one) for index, one in enumerate(imports)]
    return [data for data in reversed(found.values()) if data]
