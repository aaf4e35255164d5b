"""Reader of the tables under tests/data, whose headers say where they come from."""

from pathlib import Path

import numpy as np

FOLDER = Path(__file__).parents[1] / "data"


def read_table(name):
    """Table as a structured array; columns that hold no numbers are text."""
    lines = [line for line in (FOLDER / name).read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    return np.genfromtxt(lines, delimiter=",", names=True, dtype=None, encoding="utf-8")
