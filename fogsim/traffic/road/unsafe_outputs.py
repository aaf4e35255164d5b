"""What SUMO's files and options must not ask for: files outside the run's folder, and network connections."""

import os
import re
from collections.abc import Iterable, Mapping
from functools import lru_cache
from pathlib import Path

from fogsim.core.files.xml_reader import XmlFile, open_unpacked
from fogsim.errors import InputError, shown

_WRITING = frozenset(
    (
        *("save-configuration", "save-config", "C", "save-template", "save-schema", "vtk-output"),
        *("pedestrian.jupedsim.wkt", "pedestrian.jupedsim.py"),
    )
)
"""Options whose files SUMO writes without its output prefix, by all their names."""

_REMOVING = "save-state.period.keep"
_NAME_ENDS = ("output-suffix", "save-state.suffix")
_NOT_FILES = frozenset(("params", "explicit", "knownveh", "remove-vehicles", "filter-shapes", "output-prefix"))
"""Last parts of the names of options whose values may look like an address."""

_OUTPUTS = ("file", "output", "dest")
_ADDRESS = re.compile(r"(?:\[[^\]]*\][^:]*|[^:]{2,}):\s*[+-]?\d+")
_NO_ADDRESS = "SUMO's outputs go into files, not to a network address"
_VARIABLE = re.compile(r"\$\{(.+?)\}")
_ADDRESS_END = re.compile(rb":\s*[+-]?\d+\s*[\"']")
_READ_BY = frozenset(("calibrator", "rerouter", "variableSpeedSign"))
"""Elements whose attribute ``file`` is one that SUMO reads."""
_INDIRECT = (b"${", b"&#", b"include", b"<!DOCTYPE", b"\0", *(tag.encode() for tag in _READ_BY))
"""Bytes without which an address stands in a file as it is, and no other file is read."""
_PLAIN = re.compile(
    rb"(?:\xef\xbb\xbf)?\s*<(?!\?xml[^>]*encoding\s*=\s*(?![\"'](?:utf-8|us-ascii|iso-8859-1)[\"']))", re.IGNORECASE
)
"""Beginning of a file whose encoding has the letters of ASCII."""
_CHUNK, _LONGEST_END = 2**22, 100
_MOST = 2**33
"""Maximum size and number of elements of a file."""


def expanded(value: str) -> str:
    """A value with its environment variables, as SUMO replaces them."""
    known = {**os.environ, "PID": "0"}
    return _VARIABLE.sub(lambda found: known.get(found[1], ""), re.sub(r"(^|,)~", r"\1${HOME}", value)).strip()


def _is_address(name: str) -> bool:
    return _ADDRESS.fullmatch(expanded(name)) is not None


def unsafe_option(name: str, value: str) -> str | None:
    """Why a SUMO option may not have a value; None if it may."""
    if name in _WRITING and value:
        return "SUMO would write that file outside the run's folder"
    if name == _REMOVING and value not in ("", "0"):
        return "SUMO would remove files outside the run's folder"
    if name in _NAME_ENDS and "/" in expanded(value):
        return "SUMO's outputs go into the run's directory; the end of their names must hold no folder"
    return _NO_ADDRESS if name.rpartition(".")[2] not in _NOT_FILES and _is_address(value) else None


def read_name(tag: str, attributes: Mapping[str, str]) -> str:
    """Name of the file that an element makes SUMO read, "" if it names none."""
    return expanded(attributes.get("href" if tag == "include" else "file" if tag in _READ_BY else "", ""))


def check_outputs(paths: Iterable[Path]) -> None:
    """Raise InputError if a SUMO file, or one that it names, sends outputs to an address or names missing files.

    SUMO ends the process if some of those are missing.
    """
    waiting, seen = [path.resolve() for path in paths], set[Path]()
    while waiting:
        path = waiting.pop()
        if path not in seen and path.is_file():
            seen.add(path)
            for name, line in _checked_file(path, path.stat().st_mtime_ns, path.stat().st_size).items():
                if not name.is_file():
                    raise InputError(f"{path}:{line}: there is no file {shown(name.name)} in {name.parent}")
                waiting.append(name)


@lru_cache(maxsize=256)
def _checked_file(path: Path, changed: int, size: int) -> dict[Path, int]:  # noqa: ARG001 - a changed file is read again
    """Files that a checked file names, and on which lines; `changed` [ns] and `size` [bytes] are its own."""
    reader = _OutputReader(path, file := XmlFile(path))
    if _needs_reading(path):
        file.read_all(reader, _MOST, _MOST)
    return reader.read


def _needs_reading(path: Path) -> bool:
    """Whether a file may name an address or another file: a quick look at its bytes spares the reading of most."""
    with open_unpacked(path) as file:
        text = file.read(_CHUNK)
        if _PLAIN.match(text) is None:
            return True
        while text:
            if any(mark in text for mark in _INDIRECT) or _ADDRESS_END.search(text):
                return True
            chunk = file.read(_CHUNK)
            text = text[-_LONGEST_END:] + chunk if chunk else b""
    return False


class _OutputReader:
    """Reads names of outputs and of files that SUMO reads."""

    is_done = False

    def __init__(self, path: Path, file: XmlFile) -> None:
        self._folder, self._file = path.parent, file
        self.read: dict[Path, int] = {}

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        names = [attributes[key] for key in _OUTPUTS if key in attributes]
        if tag.endswith("param") and attributes.get("key", "").rpartition(".")[2] == "file":
            names.append(attributes.get("value", ""))
        for name in names:
            if _is_address(name):
                raise ValueError(f"{_NO_ADDRESS}, got {shown(name)}")
        name = read_name(tag, attributes)
        if name:
            self.read.setdefault((self._folder / name).resolve(), self._file.line)

    def end(self, tag: str) -> None:
        pass
