"""What comes out when a paper's evaluation is run again."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.reproduce.paper_cells import PaperCell
from fogsim.values import Estimate

Cell = str | float | bool | None

Watch = Callable[[int, int], None]
"""Called with the steps that are done and how many there are."""


def unwatched(done: int, total: int) -> None:
    """Watch that shows nothing."""


def found_visibility(estimate: Estimate | None) -> float | None:
    """Visibility of the fog that a method has found [m]; None without an estimate, and where it sees no fog."""
    return estimate.visibility if estimate is not None and estimate.valid and estimate.extinction > 0.0 else None


class Steps:
    """Counts the steps of an evaluation, of similar length each, and calls a watch after every one and at the start."""

    def __init__(self, total: int, watch: Watch) -> None:
        self._done, self._total, self._watch = 0, total, watch
        watch(0, total)

    def advance(self) -> None:
        """Count one more."""
        self._done += 1
        self._watch(self._done, self._total)


Rows = tuple[tuple[str, ...], ...]
"""A table as it is shown: the headings, then the rows."""


@dataclass(frozen=True, slots=True)
class TitledTable:
    """One of several tables: its title, and its headings and rows."""

    title: str
    rows: Rows


@dataclass(frozen=True, slots=True)
class Reproduction:
    """A paper's evaluation on our frames."""

    paper: str  # Its name
    # One flat record for each case: what was set, what each variant of the method found; None without an estimate
    records: tuple[Mapping[str, Cell], ...]
    # What is shown: the headings, then the rows; the paper's figure is next to ours. The first of `tables`, if there
    # are several
    table: Rows
    notes: tuple[str, ...]  # What the paper leaves open, and where and why we do not reach it
    picture: NDArray[np.uint8]  # (rows, cols, 3) uint8: A picture like the paper's
    tables: tuple[TitledTable, ...] = ()  # All tables, of a paper that has several
    # Further records: what becomes of the method where the paper leaves something open, or a repair is left out
    sweeps: tuple[Mapping[str, Cell], ...] = ()
    # Every figure of the paper's evaluation that can be compared, whether it is reached or not
    cells: tuple[PaperCell, ...] = ()

    @property
    def all_tables(self) -> tuple[TitledTable, ...]:
        """All tables, one or several."""
        return self.tables or (TitledTable(self.paper, self.table),)
