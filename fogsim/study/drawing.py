"""Style of a study's figures: panels, colours and markers that colour-blind readers can distinguish, SVG and CSV."""

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
from matplotlib.text import Text
from numpy.typing import NDArray

from fogsim.study.plan import Study

INK, MUTED, GRID = "#1c2733", "#66727e", "#e3e8ed"
WIDTH = 7.2
"""Width of a figure over both columns of a page [in]."""

_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#882255", "#999933")
"""Okabe & Ito's colours (2008), the two that are faint on white replaced by two of Tol's; black is the baseline's."""

_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">")
_DASHES: Sequence[tuple[int, tuple[float, ...]]] = ((0, ()), (0, (5, 1.5)), (0, (1.5, 1.5)), (0, (6, 1.5, 1.5, 1.5)))


@dataclass(frozen=True, slots=True)
class StudyFigure:
    """A figure as SVG, and the table of the numbers in it; `name` is that of its files, without suffix."""

    name: str
    caption: str
    svg: str
    columns: Sequence[str]
    rows: Sequence[Sequence[object]]


class Look(NamedTuple):
    """Colour, marker and line style of a policy."""

    colour: str
    marker: str
    dashes: tuple[int, tuple[float, ...]]


class Grid:
    """Layout of a study's figures: a colour for each policy, a panel for each combination of the other factors."""

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
        """Levels of all factors in order, from a policy and the others' levels."""
        others = iter(panel)
        return tuple(policy if name == self.policy_factor else next(others) for name in self.study.factors)

    def figure(self, height: float, across: int = 2, *, same_axes: bool = True) -> tuple[Figure, "_PanelAxes"]:
        """Figure with a panel of `height` [in] for each combination of the other factors, at most `across` in a row."""
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
        return figure, _PanelAxes(panels)


class _PanelAxes:
    """The panels of a figure, as levels and axes."""

    def __init__(self, panels: Sequence[tuple[tuple[str, ...], Axes]]) -> None:
        self._panels = panels

    def __iter__(self) -> Iterator[tuple[tuple[str, ...], Axes]]:
        return iter(self._panels)


def dress(axes: Axes) -> None:
    """Apply the common style to axes."""
    axes.grid(visible=True, color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(MUTED)
    axes.tick_params(labelsize=8, color=MUTED, labelcolor=INK, length=3)


def label_figure(figure: Figure, across: str, upwards: str) -> None:
    """Label the axes of the lowest and the leftmost panels, and list the policies below all."""
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
    """A figure as SVG; the same study gives the same bytes, since ids of elements derive from `name`."""
    text = io.StringIO()
    FigureCanvasSVG(figure)
    for label in figure.findobj(Text):
        label.set_parse_math(False)  # a user's name can have dollar signs
    with mpl.rc_context({"svg.hashsalt": name}):
        figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()


def padded(values: NDArray[np.float64]) -> tuple[float, float]:
    """Limits of an axis around values, with a margin and never of zero length."""
    low, high = float(values.min()), float(values.max())
    room = 0.06 * (high - low) or 0.06 * abs(high) or 1.0
    return low - room, high + room
