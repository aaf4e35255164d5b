"""Published figures next to ours, one cell of a paper's table at a time."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from fogsim.errors import InputError, UnknownNameError

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
