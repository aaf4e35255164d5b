"""Single keys that the command line puts in place of the file's."""

import copy
from collections.abc import Iterable
from typing import Any

import yaml

from fogsim.errors import InputError

TAKES_THE_PLACE_OF = {
    ("fog", "visibility_m"): ("outside_visibility_m", "banks"),
    ("fog", "outside_visibility_m"): ("visibility_m",),
    ("fog", "banks"): ("visibility_m",),
    ("traffic", "config"): ("net", "routes", "additional"),
    ("traffic", "net"): ("config",),
}
"""Setting the key on the left leaves out those beside it that exclude it: ``--set fog.visibility_m=80`` makes the fog
homogeneous whatever kind the file has."""


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
        raise InputError(f"--set {text}: expected key.path=value, for example --set fog.visibility_m=80")
    try:
        return path, yaml.safe_load(value)
    except yaml.YAMLError as error:
        raise InputError(f"--set {text}: the value is not valid YAML: {' '.join(str(error).split())}") from error


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
        if isinstance(block, dict):
            block = block.setdefault(key, {})
        else:
            block = block[_place(block, key, path[: depth + 1], text)]
    if isinstance(block, dict):
        block[path[-1]] = value
    else:
        block[_place(block, path[-1], path, text)] = value


def _place(block: object, key: str, path: tuple[str, ...], text: str) -> int:
    above = ".".join(path[:-1])
    if not isinstance(block, list):
        raise InputError(f"--set {text}: {above} is a single value and has no keys below it")
    if not key.isdecimal() or int(key) >= len(block):
        raise InputError(f"--set {text}: {above} is a list of {len(block)}; its places are 0 … {len(block) - 1}")
    return int(key)
