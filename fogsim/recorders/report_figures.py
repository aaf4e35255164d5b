"""Figures of the report, drawn without any of matplotlib's global state."""

import io
from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator
from numpy.typing import NDArray

from fogsim.recorders.report_data import AHEAD, AheadCurves, Curves
from fogsim.recorders.style import ON_LIGHT, method_colours
from fogsim.units import KMH_PER_MPS
from fogsim.values import DriverWarning

TRUTH, BELIEF, ADVICE, ALARM, SPEED = "#c28a00", "#1f6fd0", "#1f9d61", "#cf3a34", "#1c2733"
_MUTED = "#7b8794"
"""Colours of what is drawn; `ALARM` is of collisions and dangers."""

_VISIBILITY_TICKS = (20, 50, 100, 200, 500, 1000, 2000)
_MOST_MARGIN = 300.0
"""Safety margins beyond this are drawn at it, so that the dangerous part can be read [m]."""


_WARNINGS = {DriverWarning.FOG_AHEAD: "#e39a1f", DriverWarning.CANNOT_SEE: _MUTED, DriverWarning.CAMERA_DEGRADED: ALARM}


def draw_figures(curves: Curves, time_to_collision_threshold: float = 3.0) -> list[tuple[str, bytes]]:
    """Draw every figure of the report.

    Returns caption and PNG of each figure (str, bytes). Takes `time_to_collision_threshold` [s].
    """

    def figure(heights: Sequence[float], draw: Callable[[Sequence[Axes]], None]) -> bytes:
        return figure_over_time(curves.time, curves.collisions, heights, draw)

    ahead: list[tuple[str, bytes]] = []
    if curves.ahead.time:
        said = f"Visibility at the place {AHEAD:.0f} m ahead along the road: true, and believed with its 90 % interval."
        ahead.append((said, figure((2.9,), lambda axes: _draw_ahead(axes[0], curves.ahead))))
    return [
        (
            "Meteorological visibility: what was true ahead of the camera, what each method said frame by frame, "
            "and what was believed with its 90 % interval.",
            figure((3.4,), lambda axes: _draw_visibility(axes[0], curves)),
        ),
        *ahead,
        (
            "Speed of the ego, the advice in force and the speed limit; along the top, what the driver was warned of.",
            figure((2.5,), lambda axes: _draw_speed(axes[0], curves)),
        ),
        (
            "Gap to the vehicle ahead, and time to collision while it is approached.",
            figure((1.9, 1.7), lambda axes: _draw_conflict(axes, curves, time_to_collision_threshold)),
        ),
        (
            "Safety margin: true visibility ahead minus the distance in which the ego could stop. "
            "Where it is negative, something standing on the road could not have been avoided.",
            figure((2.5,), lambda axes: _draw_margin(axes[0], curves)),
        ),
    ]


def figure_over_time(
    time: Sequence[float],
    collisions: Sequence[float],
    heights: Sequence[float],
    draw: Callable[[Sequence[Axes]], None],
) -> bytes:
    """Draw quantities over time, collisions marked, as PNG (`time` [s], `collisions` [s], `heights` [inch])."""

    def draw_marked(axes: Sequence[Axes]) -> None:
        draw(axes)
        for axis in axes:
            for number, instant in enumerate(collisions):
                label = "collision" if number == 0 else None
                axis.axvline(instant, color=ALARM, linewidth=1.2, linestyle=(0, (4, 2)), zorder=5, label=label)
            axis.set_xlim(time[0], max(time[-1], time[0] + 1e-3))

    return drawn_figure(heights, draw_marked, "time [s]")


def drawn_figure(heights: Sequence[float], draw: Callable[[Sequence[Axes]], None], across: str) -> bytes:
    """Draw a figure in the look of the report, as PNG (`heights` [inch])."""
    figure = Figure(figsize=(9.2, sum(heights)), dpi=144)
    # The same margins in every figure, in inches, so that all time axes stand under one another.
    height = sum(heights)
    figure.subplots_adjust(left=0.08, right=0.985, bottom=0.45 / height, top=1 - 0.3 / height, hspace=0.12)
    grid = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=list(heights))
    axes = [row[0] for row in grid]
    draw(axes)
    for axis in axes:
        _dress(axis, legend=axis is axes[0])
    axes[-1].set_xlabel(across, fontsize=9)
    buffer = io.BytesIO()
    FigureCanvasAgg(figure)
    figure.savefig(buffer, format="png")
    return buffer.getvalue()


def _dress(axis: Axes, *, legend: bool) -> None:
    """Give an axis the look of the report."""
    axis.yaxis.set_label_coords(-0.052, 0.5)
    axis.grid(visible=True, color="#e3e8ed", linewidth=0.7)
    axis.set_axisbelow(True)
    axis.spines[["top", "right"]].set_visible(False)
    axis.spines[["left", "bottom"]].set_color("#aab4be")
    axis.tick_params(colors="#44505c", labelsize=8)
    handles, _ = axis.get_legend_handles_labels()
    if handles and legend:
        axis.legend(
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            borderaxespad=0.2,
            ncols=len(handles),
            frameon=False,
            fontsize=8,
            markerscale=2.0,
            columnspacing=1.4,
            handlelength=2.4,
        )


def _draw_visibility(axis: Axes, curves: Curves) -> None:
    low, high = (np.clip(plottable(values), *_ends()) for values in (curves.low, curves.high))
    axis.fill_between(curves.time, low, high, color=BELIEF, alpha=0.18, linewidth=0, label="90 % interval")
    axis.plot(curves.time, curves.belief, color=BELIEF, linewidth=1.6, label="belief")
    colours = method_colours(list(curves.estimates), ON_LIGHT)
    for method, points in curves.estimates.items():
        times, values = np.array(points, dtype=np.float64).reshape(-1, 2).T
        colour = [part / 255.0 for part in colours[method]]
        axis.scatter(times, values, s=5, color=colour, linewidths=0, alpha=0.7, label=method)
    dashes = (0, (5, 1.5))
    axis.plot(
        curves.time, shown_visibility(curves.truth), color=TRUTH, linewidth=1.8, linestyle=dashes, label="truth ahead"
    )
    scale_visibility(axis)


def _draw_ahead(axis: Axes, curves: AheadCurves) -> None:
    low, high = (np.clip(plottable(values), *_ends()) for values in (curves.low, curves.high))
    axis.fill_between(curves.time, low, high, color=BELIEF, alpha=0.18, linewidth=0, label="90 % interval")
    believed = np.clip(plottable(curves.belief), *_ends())
    axis.plot(curves.time, believed, color=BELIEF, linewidth=1.6, label=f"believed {AHEAD:.0f} m ahead")
    truth = shown_visibility(curves.truth)
    axis.plot(curves.time, truth, color=TRUTH, linewidth=1.8, linestyle=(0, (5, 1.5)), label="truth there")
    scale_visibility(axis)


def scale_visibility(axis: Axes) -> None:
    """Let an axis be of visibility [m]."""
    axis.set_yscale("log")
    axis.set_ylim(*_ends())
    axis.yaxis.set_major_locator(FixedLocator(_VISIBILITY_TICKS))
    axis.yaxis.set_minor_locator(NullLocator())
    axis.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.0f}"))
    axis.set_ylabel("visibility [m]", fontsize=9)


def shown_visibility(values: Sequence[float | None]) -> NDArray[np.float64]:
    """Visibilities to plot [m]; clear air is at the upper end of the axis (`values` [m])."""
    return np.clip(np.nan_to_num(plottable(values), nan=_ends()[1]), *_ends())


def _draw_speed(axis: Axes, curves: Curves) -> None:
    axis.plot(curves.time, plottable(curves.limit) * KMH_PER_MPS, color=_MUTED, linewidth=1.0, label="speed limit")
    advice = plottable(curves.advice) * KMH_PER_MPS
    axis.plot(curves.time, advice, color=ADVICE, linewidth=1.6, drawstyle="steps-post", label="advice")
    axis.plot(curves.time, plottable(curves.speed) * KMH_PER_MPS, color=SPEED, linewidth=1.6, label="speed")
    axis.set_ylim(0.0, 1.06 * axis.get_ylim()[1])
    axis.set_ylabel("speed [km/h]", fontsize=9)
    for warning, colour in _WARNINGS.items():
        given = np.array([one is warning for one in curves.warning])
        if given.any():
            across = axis.get_xaxis_transform()
            label = warning.value.replace("_", " ")
            axis.fill_between(curves.time, 0.95, 1.0, where=given, transform=across, color=colour, lw=0, label=label)


def _draw_conflict(axes: Sequence[Axes], curves: Curves, threshold: float) -> None:
    axes[0].plot(curves.time, plottable(curves.gap), color=SPEED, linewidth=1.6)
    axes[0].set_ylim(bottom=min(0.0, *(gap for gap in curves.gap if gap is not None), 0.0))
    axes[0].set_ylabel("gap [m]", fontsize=9)
    axes[1].axhspan(0, threshold, color=ALARM, alpha=0.10, linewidth=0)
    axes[1].plot(curves.time, plottable(curves.time_to_collision), color=SPEED, linewidth=1.6)
    axes[1].set_ylim(0, 20)
    axes[1].set_ylabel("time to\ncollision [s]", fontsize=9)


def _draw_margin(axis: Axes, curves: Curves) -> None:
    margin = np.minimum(np.nan_to_num(plottable(curves.margin), nan=_MOST_MARGIN), _MOST_MARGIN)
    axis.fill_between(curves.time, margin, 0, where=margin < 0, color=ALARM, alpha=0.25, linewidth=0, interpolate=True)
    axis.axhline(0, color=_MUTED, linewidth=1.0)
    axis.plot(curves.time, margin, color=SPEED, linewidth=1.6)
    axis.set_ylabel("margin [m]", fontsize=9)


def _ends() -> tuple[float, float]:
    return float(_VISIBILITY_TICKS[0]), float(_VISIBILITY_TICKS[-1])


def plottable(values: Sequence[float | None]) -> NDArray[np.float64]:
    """Make an array to plot; matplotlib leaves a gap where a value is missing."""
    return np.array(values, dtype=np.float64)
