"""How a study's figures look: panels, colours and markers for people who see colours differently, SVG and CSV."""

import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fogsim.study.plan import Study

INK, MUTED, GRID = "#1c2733", "#66727e", "#e3e8ed"
WIDTH = 7.2
"""Width of a figure over both columns of a page [in]."""

_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#882255", "#999933")
"""Okabe & Ito's colours (2008), the two that white paper swallows replaced by two of Tol's; black is the baseline's."""

_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">")
_DASHES: Sequence[tuple[int, tuple[float, ...]]] = ((0, ()), (0, (5, 1.5)), (0, (1.5, 1.5)), (0, (6, 1.5, 1.5, 1.5)))


@dataclass(frozen=True, slots=True)
class StudyFigure:
    """A figure and the numbers in it.

    Attributes
    ----------
    name : str
        Name of its files, without ending.
    caption : str
        What it shows.
    svg : str
        The figure.
    columns : sequence of str
        Columns of its table.
    rows : sequence of sequences
        Rows of its table.
    """

    name: str
    caption: str
    svg: str
    columns: Sequence[str]
    rows: Sequence[Sequence[object]]


class Look(NamedTuple):
    """How a policy is drawn.

    Attributes
    ----------
    colour, marker : str
        Colour and marker.
    dashes : (float, tuple of float)
        Style of its lines.
    """

    colour: str
    marker: str
    dashes: tuple[int, tuple[float, ...]]


class Grid:
    """A study's grid as figures lay it out: a policy is a colour, all other factors together are panels.

    Parameters
    ----------
    study : Study
        The study; its baseline's first factor is that of the policies.
    """

    def __init__(self, study: Study) -> None:
        self.study = study
        self.policy_factor = next(iter(study.baseline))
        self.baseline = study.baseline[self.policy_factor]
        self.policies = study.factors[self.policy_factor]
        others = [name for name in study.factors if name != self.policy_factor]
        cells = dict.fromkeys(tuple(run.levels[name] for name in others) for run in study.runs)
        self.panels: Mapping[tuple[str, ...], str] = {
            cell: " · ".join(f"{name}: {level}" for name, level in zip(others, cell, strict=True)) for cell in cells
        }
        compared = [policy for policy in self.policies if policy != self.baseline]
        self.looks = {self.baseline: Look("#000000", _MARKERS[0], _DASHES[0])}
        for i, policy in enumerate(compared):
            marker, dashes = _MARKERS[(i + 1) % len(_MARKERS)], _DASHES[(i + 1) % len(_DASHES)]
            self.looks[policy] = Look(_COLOURS[i % len(_COLOURS)], marker, dashes)

    def cell(self, policy: str, panel: tuple[str, ...]) -> tuple[str, ...]:
        """Levels of all factors, in their order.

        Parameters
        ----------
        policy : str
            Level of the policies' factor.
        panel : tuple of str
            Levels of the others.
        """
        others = iter(panel)
        return tuple(policy if name == self.policy_factor else next(others) for name in self.study.factors)

    def figure(self, height: float, across: int = 2, *, same_axes: bool = True) -> tuple[Figure, "PanelAxes"]:
        """Make a figure with a panel for each cell of the other factors.

        Parameters
        ----------
        height : float
            Height of a panel [in].
        across : int
            Most panels beside one another.
        same_axes : bool
            Whether all panels have the same axes.
        """
        number = len(self.panels)
        columns = min(number, across)
        rows = -(-number // columns)
        figure = Figure(figsize=(WIDTH, 0.75 + rows * height), layout="constrained")
        grid = figure.subplots(rows, columns, squeeze=False, sharex=same_axes, sharey=same_axes)
        panels = list(zip(self.panels, grid.flat, strict=False))
        for unused in grid.flat[number:]:
            unused.remove()
        for panel, axes in panels:
            dress(axes)
            if self.panels[panel]:
                axes.set_title(self.panels[panel], fontsize=8.5, loc="left", color=INK)
        for i, (_, axes) in enumerate(panels):
            axes.tick_params(labelbottom=not same_axes or i + columns >= number)
        return figure, PanelAxes(panels)


class PanelAxes:
    """The panels of a figure.

    Parameters
    ----------
    panels : sequence of (tuple of str, Axes)
        Levels and axes of each.
    """

    def __init__(self, panels: Sequence[tuple[tuple[str, ...], Axes]]) -> None:
        self._panels = panels

    def __iter__(self) -> Iterator[tuple[tuple[str, ...], Axes]]:
        return iter(self._panels)


def dress(axes: Axes) -> None:
    """Give axes the looks of all.

    Parameters
    ----------
    axes : Axes
        The axes.
    """
    axes.grid(visible=True, color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(MUTED)
    axes.tick_params(labelsize=8, color=MUTED, labelcolor=INK, length=3)


def label_figure(figure: Figure, across: str, upwards: str) -> None:
    """Name the axes of the lowest and the leftmost panels, and list the policies below all.

    Parameters
    ----------
    figure : Figure
        With its panels; lines and markers that have a label.
    across, upwards : str
        What the axes show, with units.
    """
    shown: dict[str, Artist] = {}
    for axes in figure.axes:
        place = axes.get_subplotspec()
        if place is not None and place.is_first_col():
            axes.set_ylabel(upwards, fontsize=8.5, color=INK)
        if axes.xaxis.get_tick_params()["labelbottom"]:
            axes.set_xlabel(across, fontsize=8.5, color=INK)
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            shown.setdefault(label, handle)
    if shown:
        figure.legend(
            list(shown.values()),
            list(shown),
            loc="outside lower center",
            ncols=min(len(shown), 4),
            frameon=False,
            fontsize=8,
            handlelength=2.8,
            columnspacing=1.6,
        )


def svg_of(figure: Figure, name: str) -> str:
    """A figure as SVG; the same study gives the same bytes.

    Parameters
    ----------
    figure : Figure
        The figure.
    name : str
        From which the names of its parts are made.
    """
    text = io.StringIO()
    FigureCanvasSVG(figure)
    with mpl.rc_context({"svg.hashsalt": name}):
        figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()


def padded(values: NDArray[np.float64]) -> tuple[float, float]:
    """Limits of an axis around values, with a little room, and never of no length.

    Parameters
    ----------
    values : (n,) float64
        What is drawn.
    """
    low, high = float(values.min()), float(values.max())
    room = 0.06 * (high - low) or 0.06 * abs(high) or 1.0
    return low - room, high + room
