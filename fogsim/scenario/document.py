"""A YAML file as plain data with the line of each key, and overrides of single keys."""

import copy
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fogsim.core.files.readers import read_text
from fogsim.errors import InputError, shown
from fogsim.openscenario import is_openscenario, read_openscenario, read_parameter_cases
from fogsim.scenario.plain_yaml import DEEPEST, MOST_BYTES, KeyPath, PlainYamlError, parse_yaml
from fogsim.units.quantities import UNIT_OF_SUFFIX

_TAKES_THE_PLACE_OF = {
    ("fog", "visibility_m"): ("outside_visibility_m", "banks"),
    ("fog", "outside_visibility_m"): ("visibility_m",),
    ("fog", "banks"): ("visibility_m",),
    ("traffic", "config"): ("net", "routes", "additional"),
    ("traffic", "net"): ("config",),
    ("camera", "field_of_view_deg"): ("focal_length_px",),
}
"""Setting the key on the left, in any unit, removes the keys that exclude it: ``--set fog.visibility_m=80`` makes any
fog homogeneous."""

_FOREIGN, _TIMELINE = "scenario", "timeline"

_SET = "--set "

_LONGEST_SHOWN = 200
"""Maximum length of an override in messages."""


def _shown_override(text: str) -> str:
    """An override as messages name it."""
    return f"{_SET}{text if text.isprintable() and len(text) <= _LONGEST_SHOWN else shown(text)}"


def _override_path(text: str) -> KeyPath:
    """Key path of a well-formed override; a number in it is a list index."""
    return tuple(int(key) if _is_place(key) else key for key in text.partition("=")[0].strip().split("."))


def _is_place(key: str) -> bool:
    return key.isdecimal() and len(key) < 10


def parse_override(text: str) -> tuple[tuple[str, ...], Any]:
    """Split ``key.path=value``; the value is parsed as YAML."""
    key, equals, value = text.partition("=")
    path = tuple(key.strip().split("."))
    if not equals or not all(path):
        raise InputError(f"{_shown_override(text)}: expected key.path=value, for example --set fog.visibility_m=80")
    if len(path) > DEEPEST:
        raise InputError(f"{_shown_override(text)}: a key path has at most {DEEPEST} keys, got {len(path)}")
    try:
        return path, parse_yaml(value)[0]
    except PlainYamlError as error:
        raise InputError(f"{_shown_override(text)}: the value is not valid YAML: {error.problem}") from error


def apply_overrides(data: dict[str, Any], overrides: Iterable[str]) -> dict[str, Any]:
    """Copy of plain data with ``key.path=value`` overrides in order; a number in a path is a list index."""
    result = copy.deepcopy(data)
    for text in overrides:
        path, value = parse_override(text)
        _set(result, path, value, text)
        parent = result.get(path[0])
        if isinstance(parent, dict):
            for other in _displaced(path[0], path[1] if len(path) > 1 else "", parent):
                del parent[other]
    return result


def _displaced(block: str, key: str, parent: Mapping[Any, Any]) -> list[Any]:
    """Keys of a block that setting one of them removes."""
    siblings = [
        sibling
        for (where, name), siblings in _TAKES_THE_PLACE_OF.items()
        if where == block and (name == key or _same_quantity(name, key))
        for sibling in siblings
    ]
    return [other for other in parent if any(other == one or _same_quantity(str(other), one) for one in siblings)]


def _set(data: dict[str, Any], path: tuple[str, ...], value: object, text: str) -> None:
    block: Any = data
    for depth, key in enumerate(path[:-1]):
        place = key if isinstance(block, dict) else _place(block, key, path[: depth + 1], text)
        # A block without content is an empty one.
        if isinstance(block, dict) and block.get(key) is None:
            block[key] = {}
        block = block[place]
    if isinstance(block, dict):
        for other in [key for key in block if key != path[-1] and _same_quantity(str(key), path[-1])]:
            del block[other]
        block[path[-1]] = value
    else:
        block[_place(block, path[-1], path, text)] = value


def _same_quantity(key: str, other: str) -> bool:
    """Whether two keys differ only by a unit suffix on one of them: ``speed`` and ``speed_kmh``."""
    shorter, longer = sorted((key, other), key=len)
    stem, _, suffix = longer.rpartition("_")
    return stem == shorter and suffix in UNIT_OF_SUFFIX


def _place(block: object, key: str, path: tuple[str, ...], text: str) -> int:
    above = ".".join(path[:-1])
    if not isinstance(block, list):
        raise InputError(f"{_shown_override(text)}: {above} is a single value and has no keys below it")
    if not block:
        raise InputError(f"{_shown_override(text)}: {above} is an empty list; set it as a whole, {above}=[…]")
    if not _is_place(key) or int(key) >= len(block):
        raise InputError(
            f"{_shown_override(text)}: {above} is a list of {len(block)}; its places are 0 … {len(block) - 1}"
        )
    return int(key)


@dataclass(frozen=True, slots=True)
class Document:
    """Plain data from a file; `origins` has each key's ``file:line``, or the override that set it.

    An OpenSCENARIO file that varies another one's parameters has `cases`, values of all of them. `data` is the first
    case, and `of_case` reads another. `are_runs` if they are random test runs.
    """

    path: Path
    data: dict[str, Any]
    origins: Mapping[KeyPath, str]
    cases: tuple[Mapping[str, str], ...] = ()
    of_case: "Callable[[Mapping[str, str]], Document] | None" = None
    are_runs: bool = False

    def changed(self, change: "Callable[[Document], Document]") -> "Document":
        """Copy with a change of its data and origins, also in the other cases."""
        of_case = self.of_case
        if of_case is None:
            return change(self)
        return replace(change(self), of_case=lambda values: change(of_case(values)))

    def where(self, key_path: KeyPath) -> str:
        """Origin of a key, or of the nearest enclosing block that has one."""
        for length in range(len(key_path), 0, -1):
            origin = self.origins.get(key_path[:length])
            if origin is not None:
                return origin
        return str(self.path)

    def is_overridden(self, key_path: KeyPath) -> bool:
        """Whether an override set a key."""
        return self.where(key_path).startswith(_SET)

    def is_written(self, key_path: KeyPath) -> bool:
        """Whether a key is from a file of FogSim's or an override, not from an OpenSCENARIO file or a program."""
        origin = self.where(key_path)
        return origin != str(self.path) and not is_openscenario(Path(origin.rpartition(":")[0]))

    def overridden(self, overrides: Iterable[str]) -> "Document":
        """Copy in which overridden keys and all below have the overrides as origins, and blocks around them both."""
        origins = dict(self.origins)
        for text in overrides:
            at, origin = _override_path(text), _shown_override(text)
            origins = {key: origin for key, origin in origins.items() if key[: len(at)] != at}
            for block in (at[:length] for length in range(1, len(at))):
                origins[block] = f"{origins[block]} with {origin}" if block in origins else origin
            origins[at] = origin
        return replace(self, origins=origins)


def read_scenario_document(path: Path) -> Document:
    """Read a scenario's YAML file, which ``scenario: FILE.xosc`` may start from OpenSCENARIO, or an ``.xosc`` file."""
    if is_openscenario(path):
        return _read_openscenario(path)
    document = read_document(path)
    return _upon_openscenario(document) if _FOREIGN in document.data else document


def read_document(path: Path) -> Document:
    """Read a YAML file, within the limits of `plain_yaml`; it must hold a mapping."""
    try:
        data, lines = parse_yaml(read_text(path, MOST_BYTES))
    except PlainYamlError as error:
        where = path if error.line is None else f"{path}:{error.line}"
        raise InputError(f"{where}: not valid YAML: {error.problem}") from error
    if not isinstance(data, dict):
        got = "the file is empty" if data is None else f"got {type(data).__name__}"
        raise InputError(f"{path}: expected a mapping of keys to values, {got}")
    return Document(path, data, {key: f"{path}:{line}" for key, line in lines.items()})


def _read_openscenario(path: Path) -> Document:
    varied = read_parameter_cases(path)
    if varied is None:
        return _scenario_of(path, {})

    def of_case(values: Mapping[str, str]) -> Document:
        try:
            return replace(_scenario_of(varied.base, values), path=path)
        except InputError as error:
            case = ",".join(f"{name}={value}" for name, value in values.items())
            raise InputError(f"{error}\nin the case {case} of {path}") from error

    return replace(of_case(varied.cases[0]), cases=varied.cases, of_case=of_case, are_runs=varied.are_drawn)


def _scenario_of(path: Path, values: Mapping[str, str]) -> Document:
    read = read_openscenario(path, values)
    return Document(path, read.data, {key: f"{path}:{line}" for key, line in read.lines.items()})


def _upon_openscenario(document: Document) -> Document:
    """A document on top of the OpenSCENARIO file that it names; its timeline follows that of the file."""
    named = document.data[_FOREIGN]
    path = document.path.parent / str(named)
    if not isinstance(named, str) or not is_openscenario(path):
        raise InputError(
            f"{document.where((_FOREIGN,))}: {_FOREIGN}: expected an OpenSCENARIO file (.xosc), got {shown(named)}"
        )
    return _read_openscenario(path).changed(lambda below: _upon(document, below))


def _upon(document: Document, below: Document) -> Document:
    own = {key: value for key, value in document.data.items() if key != _FOREIGN}
    further, origins = own.pop(_TIMELINE, []), dict(below.origins)
    first = len(below.data[_TIMELINE]) if isinstance(further, list) else 0
    for key, origin in document.origins.items():
        match key:
            case (str(block), int(place), *rest) if block == _TIMELINE:
                origins[(block, first + place, *rest)] = origin
            case _:
                origins[key] = origin
    # The file's own expectation is that its events happen; a test states its own.
    data = _laid_upon({**below.data, "expect": {}}, own)
    data[_TIMELINE] = [*below.data[_TIMELINE], *further] if isinstance(further, list) else further
    return replace(below, path=document.path, data=data, origins=origins)


def _laid_upon(below: Mapping[str, Any], own: Mapping[str, Any]) -> dict[str, Any]:
    """Merge blocks, with the keys of the upper ones first; a fog is replaced as a whole."""
    data = dict(below)
    for key, value in own.items():
        under = data.get(key)
        if isinstance(under, dict) and isinstance(value, dict) and key != "fog":
            data[key] = _laid_upon(under, value)
        else:
            data[key] = value
    return data
