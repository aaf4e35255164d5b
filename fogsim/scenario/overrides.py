"""Single keys that the command line puts in place of the file's."""

import copy
from collections.abc import Iterable
from typing import Any

from fogsim.errors import InputError, shown
from fogsim.scenario.plain_yaml import DEEPEST, KeyPath, PlainYamlError, parse_yaml

TAKES_THE_PLACE_OF = {
    ("fog", "visibility_m"): ("outside_visibility_m", "banks"),
    ("fog", "outside_visibility_m"): ("visibility_m",),
    ("fog", "banks"): ("visibility_m",),
    ("traffic", "config"): ("net", "routes", "additional"),
    ("traffic", "net"): ("config",),
}
"""Setting the key on the left leaves out those beside it that exclude it: ``--set fog.visibility_m=80`` makes the fog
homogeneous whatever kind the file has."""

LONGEST_TOLD = 200
"""Most characters of an override that a message repeats."""


def told_override(text: str) -> str:
    """An override as messages name it."""
    return f"--set {text if text.isprintable() and len(text) <= LONGEST_TOLD else shown(text)}"


def override_path(text: str) -> KeyPath:
    """Key path of a well-formed override; a number in it is a place in a list."""
    return tuple(int(key) if _is_place(key) else key for key in text.partition("=")[0].strip().split("."))


def _is_place(key: str) -> bool:
    return key.isdecimal() and len(key) < 10


def parse_override(text: str) -> tuple[tuple[str, ...], Any]:
    """Split ``key.path=value``; the value is read as YAML.

    Raises
    ------
    InputError
        If there is no key or no ``=``, or the value is no YAML.
    """
    key, equals, value = text.partition("=")
    path = tuple(key.strip().split("."))
    if not equals or not all(path):
        raise InputError(f"{told_override(text)}: expected key.path=value, for example --set fog.visibility_m=80")
    if len(path) > DEEPEST:
        raise InputError(f"{told_override(text)}: a key path has at most {DEEPEST} keys, got {len(path)}")
    try:
        return path, parse_yaml(value)[0]
    except PlainYamlError as error:
        raise InputError(f"{told_override(text)}: the value is not valid YAML: {error.problem}") from error


def apply_overrides(data: dict[str, Any], overrides: Iterable[str]) -> dict[str, Any]:
    """Copy of plain data with overrides applied in order.

    Parameters
    ----------
    data : dict
        Content of a scenario file.
    overrides : iterable of str
        Each ``key.path=value``; a number in the path is a place in a list.

    Raises
    ------
    InputError
        If a path leads through something that has no keys, or beyond a list's end.
    """
    result = copy.deepcopy(data)
    for text in overrides:
        path, value = parse_override(text)
        _set(result, path, value, text)
        parent = result.get(path[0])
        if isinstance(parent, dict):
            for sibling in TAKES_THE_PLACE_OF.get((path[0], path[1] if len(path) > 1 else ""), ()):
                parent.pop(sibling, None)
    return result


def _set(data: dict[str, Any], path: tuple[str, ...], value: object, text: str) -> None:
    block: Any = data
    for depth, key in enumerate(path[:-1]):
        place = key if isinstance(block, dict) else _place(block, key, path[: depth + 1], text)
        # A block of which the file has but the name is an empty one.
        if isinstance(block, dict) and block.get(key) is None:
            block[key] = {}
        block = block[place]
    if isinstance(block, dict):
        block[path[-1]] = value
    else:
        block[_place(block, path[-1], path, text)] = value


def _place(block: object, key: str, path: tuple[str, ...], text: str) -> int:
    above = ".".join(path[:-1])
    if not isinstance(block, list):
        raise InputError(f"{told_override(text)}: {above} is a single value and has no keys below it")
    if not block:
        raise InputError(f"{told_override(text)}: {above} is an empty list; set it as a whole, {above}=[…]")
    if not _is_place(key) or int(key) >= len(block):
        raise InputError(
            f"{told_override(text)}: {above} is a list of {len(block)}; its places are 0 … {len(block) - 1}"
        )
    return int(key)
