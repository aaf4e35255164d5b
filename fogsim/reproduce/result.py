"""What comes out when a paper's evaluation is run again."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Cell = str | float | bool | None


@dataclass(frozen=True, slots=True)
class Reproduction:
    """A paper's evaluation on our frames.

    Attributes
    ----------
    paper : str
        Its name.
    records : tuple of mappings
        One flat record for each case: what was set, what each variant of the method found; None where it cannot tell.
    table : tuple of tuples of str
        What is told: the headings, then the rows; the paper's figure stands beside ours.
    notes : tuple of str
        What the paper leaves open, and where and why we do not reach it.
    picture : (rows, cols, 3) uint8
        A picture like the paper's.
    """

    paper: str
    records: tuple[Mapping[str, Cell], ...]
    table: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...]
    picture: NDArray[np.uint8]
