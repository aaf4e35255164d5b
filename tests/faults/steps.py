"""A run without a simulation."""

import time
from collections.abc import Generator
from pathlib import Path

from fogsim.values import Ending, Step
from tests.recorders.synthetic import make_step

STEPS = 40
LONG = 250.0
"""Longer than any test waits [s]."""


def drawn_run(
    steps: int = STEPS, *, pause: float = 0.0, seen: Path | None = None, hold: int | None = None
) -> Generator[Step, None, None]:
    """Give steps of 0.1 s after a pause [s] each, but not that of number `hold`, and note how many have been taken."""
    for index in range(steps):
        if seen is not None:
            seen.write_text(str(index), encoding="utf-8")
        time.sleep(LONG if index == hold else pause)
        yield make_step(index, time=0.1 * index, ending=Ending.TIME if index == steps - 1 else None)
