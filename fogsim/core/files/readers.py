"""Reading untrusted files: regular files only, of limited size, with one error for all faults."""

import itertools
import json
import math
import os
import stat
from collections.abc import Mapping, Sequence
from io import BufferedReader
from pathlib import Path
from typing import Any, NoReturn

from fogsim.errors import InputError, nearest, shown, suggest

MAPS = "FOGSIM_MAPS"
"""Environment variable with the user's folder of maps."""

_OPENDRIVE, SUMO = ".xodr", ".net.xml"
"""How names of maps end."""


def find_map(written: str, folder: Path) -> Path:
    """File of a map: `written` relative to a folder, or its name in the user's folder of maps; InputError if none."""
    posix = written.replace("\\", "/")
    for path in (folder / written, folder / posix):
        if _is_map(path):
            return path
    name = Path(posix).name
    for ending in (_OPENDRIVE, SUMO):
        name = name.removesuffix(ending)
    maps = os.environ.get(MAPS, "")
    if not maps:
        expected = f"expected an OpenDRIVE file ({_OPENDRIVE}) that is there"
        raise InputError(f"{expected}, or a map in a folder that --maps names; got {shown(written)}")
    for ending in (_OPENDRIVE, SUMO):
        if name and _is_map(Path(maps) / f"{name}{ending}"):
            return Path(maps) / f"{name}{ending}"
    there = sorted(one.name for one in Path(maps).glob("*") if _is_map(one))
    what = suggest(f"{name}{_OPENDRIVE}", there) if there else f"it contains no {_OPENDRIVE} or {SUMO} file"
    raise InputError(f"there is no map {shown(name)} in {maps}; {what}")


def _is_map(path: Path) -> bool:
    """Whether a file is there and is a map, by its name."""
    return path.name.lower().endswith((_OPENDRIVE, SUMO)) and path.is_file()


_MOST_BYTES = 64 * 2**20
"""Default limit of files that are read whole [bytes]."""

FARTHEST = 1e8
"""Largest number in a file without a narrower limit: UTM coordinates reach 1e7 m."""


def open_regular(path: Path) -> BufferedReader:
    """Open a regular file for reading; pipes and devices, which may never end, and folders raise InputError."""
    try:
        # Opening a pipe would otherwise wait for a writer.
        descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
        if stat.S_ISREG(os.fstat(descriptor).st_mode):
            return open(descriptor, "rb")  # noqa: PTH123 - a descriptor has no Path; the caller closes it
        os.close(descriptor)
    except ValueError as error:  # a NUL in the name
        raise InputError(f"{shown(str(path))}: {error}") from None
    except FileNotFoundError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}{nearest_file(path)}") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    raise InputError(f"{path}: cannot be read: not a regular file")


_MOST_NAMES = 1000
"""Files of a folder among which the nearest name is searched."""


def nearest_file(path: Path) -> str:
    """End of a message about a missing file: the nearest name in its folder, or the missing folder."""
    try:
        names = sorted(one.name for one in itertools.islice(path.parent.iterdir(), _MOST_NAMES))
    except FileNotFoundError:
        return f"; there is no folder {shown(str(path.parent))}"
    except (OSError, ValueError):  # ValueError: a NUL in the name
        return ""
    near = nearest(path.name, names)
    return f"; did you mean {near!r}?" if near else ""


def read_bytes(path: Path, most: int = _MOST_BYTES) -> bytes:
    """Content of a regular file of at most `most` bytes."""
    try:
        with open_regular(path) as file:
            # Reading `most` at once would allocate it.
            size = os.fstat(file.fileno()).st_size
            content = file.read(min(size, most) + 1)
            if len(content) > size:  # files in /proc have no size
                content += file.read(most + 1 - len(content))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    if len(content) > most:
        raise InputError(f"{path}: cannot be read: larger than {most} bytes")
    return content


def read_text(path: Path, most: int = _MOST_BYTES) -> str:
    """Text of a regular file in UTF-8, with or without a byte order mark; errors name the line and the byte."""
    content = read_bytes(path, most)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = 1 + content[: error.start].count(b"\n")
        raise InputError(
            f"{path}:{line}: expected UTF-8 text, got the byte 0x{error.object[error.start]:02x}"
        ) from error


def read_json(path: Path, most: int = _MOST_BYTES) -> Any:
    """Value of a JSON file; NaN, Infinity, 1e999 and deep nesting raise InputError."""
    text = read_text(path, most)
    try:
        return json.loads(text, parse_constant=_refuse_constant, parse_float=_finite)
    except json.JSONDecodeError as error:
        raise InputError(f"{path}:{error.lineno}: not valid JSON: {error.msg}") from error
    except RecursionError as error:
        raise InputError(f"{path}: not valid JSON: nested too deeply") from error
    except ValueError as error:
        raise InputError(f"{path}: not valid JSON: {error}") from error


def column_names(path: Path, names: Sequence[str] | None) -> Sequence[str]:
    """Columns of a CSV; InputError if two have one name, since `csv.DictReader` would keep the last."""
    found = names or ()
    twice = next((name for name in found if name and found.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"{path}:1: two columns are named {shown(twice)}")
    return found


def refuse_other_length(where: str, row: Mapping[Any, Any]) -> None:
    """InputError unless a row of `csv.DictReader` has as many cells as the heading."""
    if None in row:
        raise InputError(f"{where}: more cells than columns; are decimals written with commas?")
    if None in row.values():
        raise InputError(f"{where}: fewer cells than columns")


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not a number of JSON")


def _finite(written: str) -> float:
    value = float(written)
    if math.isinf(value):
        raise ValueError(f"{shown(written)} is larger than any number here")
    return value


def number_within(where: str, name: str, value: object, least: float = -FARTHEST, most: float = FARTHEST) -> float:
    """The value as a number; InputError unless it is from `least` to `most`."""
    if isinstance(value, int | float) and not isinstance(value, bool) and least <= value <= most:
        return float(value)
    place = f"{where}: " if where else ""
    raise InputError(f"{place}{name} must be a number within {least:g} … {most:g}, got {shown(value)}")


def number_in_text(where: str, name: str, text: str, least: float = -FARTHEST, most: float = FARTHEST) -> float:
    """The number that a text holds; InputError unless it is from `least` to `most`."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not least <= number <= most:
        number_within(where, name, text, least, most)
    return number
