"""Limit of a file's number of runs."""

import math
from collections.abc import Mapping

MOST_RUNS = 100_000
"""Maximum number of runs of a study and of cases of a scenario file."""

_MOST_NAMED = 5
_MOST_DIGITS = 15


def grid_mistake(sizes: Mapping[str, int]) -> str | None:
    """Why a grid has too many runs, from its number of levels per factor; None if it has not."""
    number = math.prod(sizes.values())
    if number <= MOST_RUNS:
        return None
    named = [f"{size} {name}" for name, size in sizes.items() if size > 1]
    factors = " × ".join([*named[:_MOST_NAMED], *(["…"] if len(named) > _MOST_NAMED else [])])
    shown = f"{number:,}" if number < 10**_MOST_DIGITS else f"more than 10^{_MOST_DIGITS}"
    return f"{factors} are {shown} runs; at most {MOST_RUNS:,} are allowed"
