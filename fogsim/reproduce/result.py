"""What comes out when a paper's evaluation is run again, and published figures next to ours."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from typing import Literal

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from fogsim.errors import InputError, UnknownNameError
from fogsim.values import Estimate

CELL_HEADING = ("place", "row", "column", "paper", "as published", "corrected")
"""Headings of the rows of `PaperCell.shown`."""

_SIGNS = {"equal": "", "at_most": "≤ ", "at_least": "≥ "}


@dataclass(frozen=True, slots=True)
class PaperCell:
    """One published figure, and what FogSim's frames give in its place."""

    place: str  # Where the paper has it, such as "table 5.1"
    # row, column: what it is about, with units
    row: str
    column: str
    paper: float  # The published figure; infinite where the paper prints ∞
    as_published: float | None  # Result of the method as its authors describe it; None where it gives no valid estimate
    corrected: float | None  # Result of the default method, with repairs; None where it gives no valid estimate
    claim: Literal["equal", "at_most", "at_least"] = "equal"  # Whether the paper states a value or a limit
    # Largest deviation that counts as reached: relative for values, 0 for limits; in the figure's unit if `absolute`
    tolerance: float = 0.1
    absolute: bool = False  # Whether the tolerance is in the figure's own unit, as for shares in percent
    # What was estimated, if known: a corrected result no farther from it than the published one is reached, too
    truth: float | None = None

    def agrees(self, ours: float | None) -> bool:
        """Whether a result agrees with the published figure, as the method as published should."""
        if ours is None:
            return False
        if self.claim != "equal":
            return ours <= self.paper if self.claim == "at_most" else ours >= self.paper
        if math.inf in (self.paper, ours):
            return ours == self.paper
        return abs(ours - self.paper) <= (self.tolerance if self.absolute else self.tolerance * abs(self.paper))

    @property
    def reached(self) -> tuple[bool, bool]:
        """Whether the figure is reached: as published by agreement, corrected also by an error that is no larger."""
        ours, truth = self.corrected, self.truth
        nearer = ours is not None and truth is not None and abs(ours - truth) <= abs(self.paper - truth)
        return self.agrees(self.as_published), nearer or self.agrees(ours)

    def shown(self, miss: str = "**{}**") -> tuple[str, ...]:
        """Row of a table, ours to as many decimals as the paper prints and those that are not reached as `miss`."""
        cells = [_SIGNS[self.claim] + _figure(self.paper)]
        for ours, reached in zip((self.as_published, self.corrected), self.reached, strict=True):
            figure = "—" if ours is None else _figure(ours, like=self.paper)
            cells.append(figure if reached else miss.format(figure))
        return (self.place, self.row, self.column, *cells)

    def record(self) -> dict[str, str | float | bool | None]:
        """Flat record for JSON, which has no infinity: "inf" stands for it."""
        figures = {"figure": self.paper, "as_published": self.as_published, "corrected": self.corrected}
        return {
            "place": self.place,
            "row": self.row,
            "column": self.column,
            "claim": self.claim,
            **{name: "inf" if figure == math.inf else figure for name, figure in figures.items()},
            "as_published_reached": self.reached[0],
            "corrected_reached": self.reached[1],
        }


def _figure(value: float, like: float | None = None) -> str:
    if math.isinf(value):
        return "∞"
    decimals = 0 if like is None or math.isinf(like) else len(f"{like:g}".partition(".")[2])
    return f"{value:g}" if like is None else f"{value:.{decimals}f}"


def reached_counts(cells: Sequence[PaperCell]) -> tuple[int, int]:
    """How many of a paper's figures are reached as published and corrected."""
    return sum(cell.reached[0] for cell in cells), sum(cell.reached[1] for cell in cells)


def chosen_tables(known: Sequence[str], table: str | None) -> tuple[str, ...]:
    """Tables of a paper that are run: all by default."""
    if table is not None and not known:
        raise InputError(f"table {table}: this evaluation has no numbered tables, so none can be chosen")
    if table is not None and table not in known:
        raise UnknownNameError("table", table, known)
    return tuple(known) if table is None else (table,)


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


def figure_image(figure: Figure) -> NDArray[np.uint8]:
    """Image (rows, cols, 3) of a figure."""
    FigureCanvasAgg(figure)
    drawn = BytesIO()
    figure.savefig(drawn, format="png")
    return np.asarray(Image.open(drawn).convert("RGB"))
