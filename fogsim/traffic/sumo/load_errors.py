"""Where in a scenario's files SUMO has found a fault, which it names by ids alone."""

import contextlib
import itertools
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from fogsim.core.files.xml_reader import XmlFile
from fogsim.errors import InputError
from fogsim.traffic.road.configuration import configured_inputs, included_files

_FILES = ("--net-file", "--route-files", "--additional-files")
_QUOTED = re.compile("['\"\u201c]([^'\"\u201c\u201d]+)['\"\u201d]")
_PLACE = re.compile(r"\s*In file '(.*)'\s*At line/column (\d+)/\d+\.?")
_NUMBERED = re.compile(r"\.\d+$")
_PARTS = re.compile(r"[\s,]+")
_OF_TYPE = re.compile(r"Invalid [\w-]+ Attribute (\w+)\.|(\w+) must be ")
"""Of messages on an attribute of a vehicle type, which have no id."""

_LIMITS: Mapping[str, Callable[[float], bool]] = {
    "be greater than 0": lambda number: number > 0.0,
    "or greater than 0": lambda number: number >= 0.0,
    "between [0-1]": lambda number: 0.0 <= number <= 1.0,
}

_NEXT = " Error: "
_MOST_BYTES = 50_000_000  # of a file that is searched


def located(what: str, message: str, arguments: Sequence[str]) -> str:
    """SUMO's message after file and line of its first fault, if the files of the command line show it."""
    message = " ".join(message.removeprefix("Error: ").split())
    place = _PLACE.search(message)
    if place is not None:
        return f"{place[1]}:{place[2]}: {what}: {message[: place.start()]}{message[place.end() :]}"
    first, *others = message.split(_NEXT)
    more = f" and {len(others) - 2} more errors" if len(others) > 2 else ""
    message = _NEXT.join([first, *others[:2]]) + more
    ids = dict.fromkeys(_NUMBERED.sub("", one) for one in _QUOTED.findall(first))
    # The network has most ids, and the fewest faults.
    files = _files(arguments)
    most, where = max((_most_alike(path, ids) for path in reversed(files)), default=(0, ""), key=_number)
    if not most and (fault := _OF_TYPE.match(first)):
        most, where = max((_of_type(path, fault) for path in reversed(files)), default=(0, ""), key=_number)
    return f"{where}: {what}: {message}" if most else f"{what}: {message}"


def _number(found: tuple[int, str]) -> int:
    return found[0]


def _files(arguments: Sequence[str]) -> list[Path]:
    values = dict(itertools.pairwise(arguments))
    config = values.get("--configuration-file")
    named = [Path(name) for option in _FILES for name in values.get(option, "").split(",") if name]
    with contextlib.suppress(InputError):
        named += [] if config is None else [*configured_inputs(Path(config)), Path(config)]
        named += included_files(named)
    return [path for path in named if path.is_file()]


def _most_alike(path: Path, ids: Iterable[str]) -> tuple[int, str]:
    """Number of ids that the attributes of a file's first element with most of them hold, and its file and line."""
    file = XmlFile(path)
    return _found(path, file, _Reader(file, ids))


def _of_type(path: Path, fault: re.Match[str]) -> tuple[int, str]:
    """1, and file and line of the first vehicle type with a fault in an attribute; 0 if there is none."""
    file = XmlFile(path)
    return _found(path, file, _TypeReader(file, fault))


def _found(path: Path, file: XmlFile, reader: "_Reader | _TypeReader") -> tuple[int, str]:
    try:
        file.read(reader, _MOST_BYTES)
    except InputError:
        return 0, ""
    return reader.most, f"{path}:{reader.line}"


class _Reader:
    is_done = False

    def __init__(self, file: XmlFile, ids: Iterable[str]) -> None:
        self._file, self._ids = file, frozenset(ids)
        self.most = self.line = 0

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        held = {tag} | {part for value in attributes.values() for part in (value, *_PARTS.split(value))}
        # Of two, the one that is called so.
        alike = 2 * len(held & self._ids) + (attributes.get("id") in self._ids)
        if alike > self.most:
            self.most, self.line = alike, self._file.line

    def end(self, _: str) -> None:
        pass


class _TypeReader:
    is_done = False

    def __init__(self, file: XmlFile, fault: re.Match[str]) -> None:
        self._file, self._name = file, fault[1] or fault[2]
        self._limits = [holds for phrase, holds in _LIMITS.items() if phrase in fault.string]
        self.most = self.line = 0

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        if tag == "vType" and not self.most and self._name in attributes and self._is_faulty(attributes[self._name]):
            self.most, self.line = 1, self._file.line

    def _is_faulty(self, value: str) -> bool:
        try:
            number = float(value)
        except ValueError:
            return True
        return not all(holds(number) for holds in self._limits)

    def end(self, _: str) -> None:
        pass
