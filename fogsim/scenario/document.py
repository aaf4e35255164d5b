"""A YAML file as plain data that remembers on which line each key stands."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from fogsim.errors import InputError

KeyPath = tuple[str | int, ...]


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
        """Copy in which the keys that overrides set stand where the overrides do.

        Parameters
        ----------
        overrides : iterable of str
            ``key.path=value`` each, known to be well formed.
        """
        origins = dict(self.origins)
        for text in overrides:
            keys = text.partition("=")[0].strip().split(".")
            at = tuple(int(key) if key.isdecimal() else key for key in keys)
            origins = {key: origin for key, origin in origins.items() if key[: len(at)] != at}
            for length in range(1, len(at)):
                origins.setdefault(at[:length], f"--set {text}")
            origins[at] = f"--set {text}"
        return replace(self, origins=origins)


def read_document(path: Path) -> Document:
    """Read a YAML file.

    Raises
    ------
    InputError
        If it cannot be read, is no YAML, has a key twice, or is no mapping.
    """
    try:
        text = path.read_text(encoding="utf-8")
        root = yaml.compose(text, Loader=yaml.SafeLoader)
        data = yaml.safe_load(text)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not valid YAML: {' '.join(str(error).split())}") from error
    if not isinstance(data, dict) or root is None:
        raise InputError(f"{path}: expected a mapping of keys to values, got {type(data).__name__}")
    lines: dict[KeyPath, int] = {}
    _collect_lines(path, root, (), lines)
    return Document(path, data, {key: f"{path}:{line}" for key, line in lines.items()})


def _collect_lines(path: Path, node: yaml.Node, at: KeyPath, lines: dict[KeyPath, int]) -> None:
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            here = (*at, str(key.value))
            if here in lines:
                raise InputError(
                    f"{path}:{key.start_mark.line + 1}: {dotted(here)}: this key stands twice, "
                    f"first on line {lines[here]}"
                )
            lines[here] = key.start_mark.line + 1
            _collect_lines(path, value, here, lines)
    elif isinstance(node, yaml.SequenceNode):
        for index, value in enumerate(node.value):
            here = (*at, index)
            lines[here] = value.start_mark.line + 1
            _collect_lines(path, value, here, lines)


def dotted(key_path: Sequence[str | int]) -> str:
    """Key path as it is written after ``--set``."""
    return ".".join(map(str, key_path))
