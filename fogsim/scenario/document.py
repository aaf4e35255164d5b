"""A YAML file as plain data that remembers on which line each key stands."""

import stat
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fogsim.errors import InputError
from fogsim.scenario.overrides import override_path, told_override
from fogsim.scenario.plain_yaml import MOST_BYTES, KeyPath, PlainYamlError, dotted, parse_yaml

__all__ = ["Document", "KeyPath", "dotted", "read_document"]


@dataclass(frozen=True, slots=True)
class Document:
    """Plain data from a file.

    Attributes
    ----------
    path : Path
        The file.
    data : dict
        Its content.
    origins : mapping from key path to str
        Where each key stands: ``file:line``, or the override that set it.
    """

    path: Path
    data: dict[str, Any]
    origins: Mapping[KeyPath, str]

    def where(self, key_path: KeyPath) -> str:
        """Where a key stands, or the nearest block around it that has a place."""
        for length in range(len(key_path), 0, -1):
            origin = self.origins.get(key_path[:length])
            if origin is not None:
                return origin
        return str(self.path)

    def overridden(self, overrides: Iterable[str]) -> "Document":
        """Copy in which the keys that overrides set, and all below them, stand where the overrides do.

        Blocks around them stand at both places.

        Parameters
        ----------
        overrides : iterable of str
            ``key.path=value`` each, known to be well formed.
        """
        origins = dict(self.origins)
        for text in overrides:
            at, told = override_path(text), told_override(text)
            origins = {key: origin for key, origin in origins.items() if key[: len(at)] != at}
            for block in (at[:length] for length in range(1, len(at))):
                origins[block] = f"{origins[block]} with {told}" if block in origins else told
            origins[at] = told
        return replace(self, origins=origins)


def read_document(path: Path) -> Document:
    """Read a YAML file.

    Raises
    ------
    InputError
        If it cannot be read, is no regular file of UTF-8 text, is too large (see `plain_yaml`), is no YAML, has a key
        twice, or is no mapping.
    """
    try:
        data, lines = parse_yaml(_text(path))
    except PlainYamlError as error:
        where = path if error.line is None else f"{path}:{error.line}"
        raise InputError(f"{where}: not valid YAML: {error.problem}") from error
    if not isinstance(data, dict):
        raise InputError(f"{path}: expected a mapping of keys to values, got {type(data).__name__}")
    return Document(path, data, {key: f"{path}:{line}" for key, line in lines.items()})


def _text(path: Path) -> str:
    try:
        # What is no regular file (a pipe, a device) may never end.
        if not stat.S_ISREG(path.stat().st_mode):
            raise InputError(f"{path}: cannot be read: it is no regular file")
        with path.open("rb") as file:
            raw = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    if len(raw) > MOST_BYTES:
        raise InputError(f"{path}: cannot be read: it has more than {MOST_BYTES} bytes")
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError as error:
        line = 1 + raw[: error.start].count(b"\n")
        raise InputError(
            f"{path}:{line}: not valid YAML: not UTF-8 text, got the byte 0x{raw[error.start]:02x}"
        ) from error
