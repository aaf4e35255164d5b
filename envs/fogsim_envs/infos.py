"""Infos as flat dictionaries of numbers, for libraries that stack or store them."""

from collections.abc import Mapping
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.values import DriverWarning, Ending

_WORDS: Mapping[str, tuple[str, ...]] = {
    "ending": ("", *(one.value for one in Ending)),
    "warning": ("", *(one.value for one in DriverWarning)),
    "fault": ("", "ego", "other"),
}
"""Words by the number that stands for each."""


def flat_numbers(info: Mapping[str, Any], prefix: str = "") -> dict[str, float]:
    """Numbers of a nested info under keys like ``truth/visibility_m``; other values are left out."""
    flat: dict[str, float] = {}
    for key, value in info.items():
        if isinstance(value, Mapping):
            flat |= flat_numbers(value, f"{prefix}{key}/")
        elif key in _WORDS:
            flat[f"{prefix}{key}"] = float(_WORDS[key].index(value))
        elif isinstance(value, Real):
            flat[f"{prefix}{key}"] = float(value)
    return flat


def flat_arrays(infos: Mapping[str, Any], prefix: str = "") -> dict[str, NDArray[np.float64]]:
    """Numbers of a vector's nested infos under the keys of `flat_numbers`, an array each."""
    flat: dict[str, NDArray[np.float64]] = {}
    for key, value in infos.items():
        if isinstance(value, Mapping):
            flat |= flat_arrays(value, f"{prefix}{key}/")
        else:
            numbers = [_WORDS[key].index(word) for word in value.tolist()] if key in _WORDS else value
            flat[f"{prefix}{key}"] = np.array(numbers, float)
    return flat


def word_of(info: Mapping[str, Any], key: str) -> str:
    """A word of an info, nested or flat; empty if it has none."""
    value = info.get(key) or ""
    return value if isinstance(value, str) else _WORDS[key][int(value)]


def numbers_of(info: Mapping[str, Any], group: str) -> dict[str, float]:
    """Numbers of a group of an info, nested or flat, such as ``reward_terms``; empty if it has none."""
    flat = {key.removeprefix(f"{group}/"): value for key, value in info.items() if key.startswith(f"{group}/")}
    return flat or dict(info.get(group, {}))


def row_of(infos: Mapping[str, Any], row: int) -> dict[str, Any]:
    """Info of one environment of a vector, in which all are nested arrays or numbers."""
    return {key: row_of(one, row) if isinstance(one, Mapping) else one[row] for key, one in infos.items()}
