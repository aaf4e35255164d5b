"""Figures of a study, drawn without any of matplotlib's global state, as SVG for papers."""

import io
from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from fogsim.study.comparison import Difference
from fogsim.study.plan import Study
from fogsim.study.table import Row

_INK, _MUTED, _GRID = "#1c2733", "#7b8794", "#e3e8ed"
_COLOURS = ("#1f6fd0", "#c28a00", "#1f9d61", "#cf3a34", "#7d4bc2", "#0f8b8d", "#8a5a44", "#b0447c")


def differences_figure(study: Study, metric: str, differences: Sequence[Difference]) -> str:
    """Differences of one metric to the baseline with their intervals, a line each, as SVG.

    Parameters
    ----------
    study : Study
        The study.
    metric : str
        The metric.
    differences : sequence of Difference
        Of this metric, at least one.
    """
    figure = Figure(figsize=(7.0, 0.7 + 0.3 * len(differences)), layout="constrained")
    axes = figure.subplots()
    first = next(iter(study.baseline))
    colours = _colours(study, first)
    for place, one in enumerate(reversed(differences)):
        colour = colours[one.levels[first]]
        if one.low is not None and one.high is not None:
            axes.plot((one.low, one.high), (place, place), color=colour, linewidth=2.0, solid_capstyle="butt")
        axes.plot(one.difference, place, "o", color=colour, markersize=5.0)
    axes.axvline(0.0, color=_MUTED, linewidth=1.0)
    labels = [" · ".join(one.levels.values()) for one in reversed(differences)]
    axes.set_yticks(range(len(labels)), labels)
    axes.set_ylim(-0.6, len(labels) - 0.4)
    against = " · ".join(study.baseline.values())
    axes.set_xlabel(f"{metric}, difference to {against}, {study.confidence:.0%} interval", fontsize=9)
    _dress(axes)
    return _svg(figure)


def trade_off_figure(study: Study, rows: Sequence[Row], across: str, upwards: str) -> str:
    """Means of two metrics for each cell of the grid, a colour for each policy, as SVG.

    Parameters
    ----------
    study : Study
        The study.
    rows : sequence of Row
        Its table.
    across, upwards : str
        Metrics of the horizontal and the vertical axis.
    """
    figure = Figure(figsize=(7.0, 4.2), layout="constrained")
    axes = figure.subplots()
    first = next(iter(study.baseline))
    others = [name for name in study.factors if name != first]
    colours = _colours(study, first)
    for level, colour in colours.items():
        points: list[tuple[float, float, str]] = []
        for cell in dict.fromkeys(tuple(str(row[name]) for name in others) for row in rows):
            of_cell = [r for r in rows if r[first] == level and tuple(str(r[name]) for name in others) == cell]
            x, y = _mean(of_cell, across), _mean(of_cell, upwards)
            if x is not None and y is not None:
                points.append((x, y, " · ".join(cell)))
        axes.plot([p[0] for p in points], [p[1] for p in points], "o-", color=colour, label=level, linewidth=1.0)
        for x, y, label in points:
            axes.annotate(label, (x, y), xytext=(4, 4), textcoords="offset points", fontsize=7, color=_MUTED)
    axes.set_xlabel(across, fontsize=9)
    axes.set_ylabel(upwards, fontsize=9)
    axes.legend(frameon=False, fontsize=8)
    _dress(axes)
    return _svg(figure)


def _colours(study: Study, factor: str) -> Mapping[str, str]:
    return {level: _COLOURS[i % len(_COLOURS)] for i, level in enumerate(study.factors[factor])}


def _mean(rows: Sequence[Row], metric: str) -> float | None:
    values = [float(v) for row in rows if isinstance(v := row.get(metric), int | float)]
    return sum(values) / len(values) if values else None


def _dress(axes: Axes) -> None:
    axes.grid(visible=True, color=_GRID, linewidth=0.7)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(colors=_INK, labelsize=8)


def _svg(figure: Figure) -> str:
    text = io.StringIO()
    FigureCanvasSVG(figure)
    # No date: the same study gives the same bytes.
    figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()
