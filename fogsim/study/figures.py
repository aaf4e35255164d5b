"""Figures of metrics: differences to the baseline, and safety against delay."""

from collections.abc import Sequence

import numpy as np

from fogsim.study.comparison import Difference, mean_interval, number_of
from fogsim.study.drawing import MUTED, Grid, StudyFigure, label_figure, svg_of
from fogsim.study.main_metrics import metric_words
from fogsim.study.plan import Study
from fogsim.study.table import Row, rows_of_cells


def differences_figure(study: Study, metric: str, differences: Sequence[Difference]) -> StudyFigure:
    """Differences of one metric to the baseline with their intervals: a line per policy, a panel per fog."""
    grid, words = Grid(study), metric_words(metric)
    by_cell = {tuple(one.levels.values()): one for one in differences}
    compared = [
        policy for policy in reversed(grid.policies) if policy in {d.levels[grid.policy_factor] for d in differences}
    ]
    figure, panels = grid.figure(0.35 + 0.19 * len(compared), across=4)
    for panel, axes in panels:
        for place, policy in enumerate(compared):
            one = by_cell.get(grid.cell(policy, panel))
            if one is None:
                continue
            look = grid.looks[policy]
            if one.low is not None and one.high is not None:
                ends = (words.scale * one.low, words.scale * one.high)
                axes.plot(ends, (place, place), color=look.colour, linewidth=2.0, solid_capstyle="butt")
            filled = look.colour if one.is_shown(study.confidence) else "white"
            axes.plot(
                words.scale * one.difference,
                place,
                look.marker,
                color=look.colour,
                markersize=5.5,
                markerfacecolor=filled,
            )
        axes.axvline(0.0, color=MUTED, linewidth=0.9, zorder=0.5)
        axes.set_yticks(range(len(compared)), compared)
        axes.set_ylim(-0.6, len(compared) - 0.4)
        axes.grid(visible=False, axis="y")
        axes.locator_params(axis="x", nbins=4)
    figure.supxlabel(f"{words.axis}, difference to {grid.baseline}", fontsize=8.5)
    caption = (
        f"{words.label}: difference to {grid.baseline} of runs with the same seed, mean and {study.confidence:.0%} "
        "interval. Filled: a difference is shown; open: none could be shown."
    )
    columns = [*study.factors, "difference", "low", "high"]
    rows = [[*one.levels.values(), one.difference, one.low, one.high] for one in differences]
    return StudyFigure(metric, caption, svg_of(figure, metric), columns, rows)


def trade_off_figure(study: Study, rows: Sequence[Row], across: str, upwards: str) -> StudyFigure:
    """Means of two metrics of completed runs with their intervals: a point per policy, a panel per fog."""
    grid = Grid(study)
    by_cell = rows_of_cells(study.factors, rows)
    figure, panels = grid.figure(2.4, same_axes=False)
    scales = metric_words(across).scale, metric_words(upwards).scale
    table = []
    for panel, axes in panels:
        for policy, look in grid.looks.items():
            cell = grid.cell(policy, panel)
            found = [
                _mean_and_interval(by_cell.get(cell, []), metric, study.confidence) for metric in (across, upwards)
            ]
            (x, *of_x), (y, *of_y) = found
            if x is None or y is None:
                continue
            table.append([*cell, x, *of_x, y, *of_y])
            errors = [_errors(mean, ends, scale) for (mean, *ends), scale in zip(found, scales, strict=True)]
            axes.errorbar(
                *(scales[0] * x, scales[1] * y, errors[1], errors[0]),
                fmt=look.marker,
                color=look.colour,
                markersize=6.0,
                elinewidth=0.9,
                alpha=0.9,
                label=policy,
            )
        if not any(axes.dataLim.intervaly):
            # Around only zeros matplotlib would show negative numbers, which do not occur.
            axes.set_ylim(-0.05, 1.0)
    label_figure(figure, metric_words(across).axis, metric_words(upwards).axis)
    name = f"trade_off_{upwards}"
    caption = (
        f"{metric_words(upwards).label} against {metric_words(across).label}: mean of all seeds; bars are its "
        f"{study.confidence:.0%} bootstrap intervals. The panels' axes differ."
    )
    ends = [f"{metric}{end}" for metric in (across, upwards) for end in ("", "_low", "_high")]
    return StudyFigure(name, caption, svg_of(figure, name), [*study.factors, *ends], table)


def _mean_and_interval(
    rows: Sequence[Row], metric: str, confidence: float
) -> tuple[float | None, float | None, float | None]:
    values = np.array([v for row in rows if (v := number_of(row.get(metric))) is not None])
    if not len(values):
        return None, None, None
    return float(values.mean()), *mean_interval(values, confidence)


def _errors(mean: float | None, ends: Sequence[float | None], scale: float) -> list[list[float]] | None:
    """Lengths of the two error bars at a point, as matplotlib needs them."""
    low, high = ends
    if mean is None or low is None or high is None:
        return None
    return [[scale * (mean - low)], [scale * (high - mean)]]
