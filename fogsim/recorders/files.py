"""Writing files so that none is ever half written under its final name."""

import json
from collections.abc import Mapping
from pathlib import Path

from fogsim.errors import InputError

PARTIAL_SUFFIX = ".part"
"""What the name of a file ends in until it is whole."""


def partial_path(path: Path) -> Path:
    """Where a file is written until it is whole: its name with ``.part`` behind it."""
    return path.with_name(path.name + PARTIAL_SUFFIX)


def publish(path: Path) -> None:
    """Give a file that is whole its final name, in place of one that is there, in one move."""
    partial_path(path).replace(path)


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all."""
    partial_path(path).write_text(text, encoding="utf-8")
    publish(path)


def write_json(path: Path, values: Mapping[str, object]) -> None:
    """Write a JSON file, whole or not at all.

    Raises
    ------
    InputError
        If a value is not finite or nothing that JSON can hold.
    """
    try:
        text = json.dumps(values, indent=2, ensure_ascii=False, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{path.name} holds only text, finite numbers, true, false, null, lists and mappings: {error}"
        ) from error
    write_text(path, text + "\n")
