"""Figures of profiles: survival of time to collision, speed along the road, map of collisions."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator
from numpy.typing import NDArray

from fogsim.metrics.road_speeds import CELL_LENGTH
from fogsim.study.drawing import MUTED, Grid, StudyFigure, label_figure, padded, svg_of
from fogsim.study.plan import Study
from fogsim.study.profiles import CLASS_WIDTH, CLASSES, Cell, PooledProfiles
from fogsim.units import KMH_PER_MPS, visibility_from_extinction

_EVEN = 1.15
"""Fog whose extinction varies by less than this factor is uniform, and not shaded."""

_LEAST_TIME = 5.0
"""Least vehicle time for drawing a mean speed at a position [s]."""


def survival_figure(study: Study, cells: Mapping[Cell, PooledProfiles]) -> StudyFigure:
    """Share of vehicle-time above each time to collision: 1 − TET as a share (Minderhoud & Bovy 2001)."""
    grid = Grid(study)
    figure, panels = grid.figure(2.2)
    thresholds = CLASS_WIDTH * np.arange(CLASSES + 1)
    rows = []
    all_below: list[float] = []
    for panel, axes in panels:
        for policy, look in grid.looks.items():
            pooled = cells.get(cell := grid.cell(policy, panel))
            if pooled is None:
                continue
            shares = np.concatenate(([1.0], pooled.survival()))
            below = np.where(shares < 1.0, 100 * (1 - shares), np.nan)
            all_below += below[1:].tolist()
            axes.plot(thresholds, below, color=look.colour, linestyle=look.dashes, linewidth=1.4, label=policy)
            rows += [[*cell, float(t), float(s), pooled.vehicle_time] for t, s in zip(thresholds, shares, strict=True)]
        axes.set_xlim(0.0, thresholds[-1])
    _scale_near_hundred(next(iter(panels))[1], np.array(all_below))
    label_figure(figure, "Time to collision (TTC), x [s]", "Vehicle-time with TTC > x [%]")
    caption = (
        "Survival of time to collision: share of the time of all vehicles in which their TTC with the leader is above "
        "x (1 − TET share; Minderhoud & Bovy 2001). Time without a leader, and of followers slower than 5 m/s, counts "
        "as above. Curves begin where there was any time below."
    )
    columns = [*study.factors, "time_to_collision_s", "share_above", "vehicle_time_s"]
    return StudyFigure("ttc_survival", caption, svg_of(figure, "ttc_survival"), columns, rows)


def _scale_near_hundred(axes: Axes, values: NDArray[np.float64]) -> None:
    """Make the panels' common axis logarithmic in 100 % minus a share [%], labelled 90, 99, 99.9 % upwards."""
    above_zero = values[values > 0.0]
    least, most = (above_zero.min(), above_zero.max()) if len(above_zero) else (0.01, 10.0)
    axes.set_ylim(1.4 * most, least / 1.4)
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 - value:.6g}"))
    axes.yaxis.set_minor_locator(NullLocator())


def speed_figure(study: Study, cells: Mapping[Cell, PooledProfiles]) -> StudyFigure | None:
    """Mean speed over the fog along the ego's route, or ``traffic.along`` without an ego; None if no road is known."""
    if not any(len(pooled.speeds()) for pooled in cells.values()):
        return None
    grid = Grid(study)
    figure, panels = grid.figure(2.2)
    rows = []
    for panel, axes in panels:
        here = [cells[cell] for policy in grid.policies if (cell := grid.cell(policy, panel)) in cells]
        _shade_fog(axes, here)
        for policy, look in grid.looks.items():
            pooled = cells.get(cell := grid.cell(policy, panel))
            if pooled is None:
                continue
            speeds = pooled.speeds()
            rows += [[*cell, *map(float, values)] for values in speeds]
            place, speed, time = _with_gaps(speeds).T
            shown = np.where(time >= _LEAST_TIME, KMH_PER_MPS * speed, np.nan)
            axes.plot(place / 1000, shown, color=look.colour, linestyle=look.dashes, linewidth=1.4, label=policy)
    label_figure(figure, "Place along the road [km]", "Mean speed of all [km/h]")
    road = "the ego's road" if _have_ego(cells) else "the road of traffic.along"
    caption = (
        f"Mean speed of all vehicles on {road} and in its direction, way over time, in stretches of "
        f"{CELL_LENGTH:.0f} m with at least {_LEAST_TIME:.0f} s of vehicles' time; shaded: extinction of the fog."
    )
    columns = [*study.factors, "place_m", "mean_speed_mps", "vehicle_time_s"]
    return StudyFigure("speed_over_road", caption, svg_of(figure, "speed_over_road"), columns, rows)


def _have_ego(cells: Mapping[Cell, PooledProfiles]) -> bool:
    return any(sums[0] > 0.0 for pooled in cells.values() for sums in pooled.road.values())


def _with_gaps(table: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rows by position, with NaN between distant ones, so that no line is drawn across."""
    if len(table) < 2:
        return table.reshape(-1, 3)
    breaks = np.flatnonzero(np.diff(table[:, 0]) > 1.5 * CELL_LENGTH) + 1
    return np.insert(table, breaks, np.nan, axis=0)


def _shade_fog(axes: Axes, pooled: list[PooledProfiles]) -> None:
    """Shade a road by the mean extinction at each position, and label the least visibility."""
    sums: dict[float, NDArray[np.float64]] = {}
    for one in pooled:
        for place, extinction in one.extinctions():
            sums[place] = sums.get(place, np.zeros(2)) + np.array([extinction, 1.0])
    if not sums:
        return
    places = np.array(sorted(sums))
    extinctions = np.array([sums[place][0] / sums[place][1] for place in places])
    thickest = float(extinctions.max())
    if thickest <= 0.0:
        return
    even = thickest < _EVEN * float(extinctions.min())
    said = f"V_met {'' if even else '≥ '}{visibility_from_extinction(thickest):.0f} m"
    axes.set_title(said, fontsize=8, loc="right", color=MUTED)
    if even:
        return
    for place, extinction in zip(places, extinctions, strict=True):
        ends = (place - CELL_LENGTH / 2) / 1000, (place + CELL_LENGTH / 2) / 1000
        axes.axvspan(*ends, color="#8fa1b3", alpha=0.45 * extinction / thickest, linewidth=0, zorder=0.1)


def collisions_figure(study: Study, cells: Mapping[Cell, PooledProfiles]) -> StudyFigure | None:
    """Positions of the collisions over the ego's path in plan; None if none has a position."""
    rows = [[*cell, *hit] for cell, pooled in cells.items() for hit in pooled.collisions]
    hits = [(hit.x, hit.y) for pooled in cells.values() for hit in pooled.collisions if hit.x is not None]
    if not hits:
        return None
    grid = Grid(study)
    places = np.concatenate([*(pooled.path for pooled in cells.values()), np.array(hits, dtype=np.float64)])
    x, y = padded(places[:, 0]), padded(places[:, 1])
    shape = (y[1] - y[0]) / (x[1] - x[0])
    across = 1 if shape < 0.3 else 2
    figure, panels = grid.figure(min(4.5, 0.45 + 6.2 / across * shape), across=across)
    for panel, axes in panels:
        for policy, look in grid.looks.items():
            pooled = cells.get(grid.cell(policy, panel))
            if pooled is None:
                continue
            axes.plot(*pooled.path.T, color="#c3ccd5", linewidth=3.0, zorder=0.6, solid_capstyle="round")
            at = np.array([(hit.x, hit.y) for hit in pooled.collisions if hit.x is not None], dtype=np.float64)
            if len(at):
                (marks,) = axes.plot(*at.T, look.marker, color=look.colour, label=policy, markersize=6.0, alpha=0.85)
                marks.set(markerfacecolor="none", markeredgewidth=1.2)
        axes.set_xlim(*x)
        axes.set_ylim(*y)
        axes.set_aspect("equal")
    label_figure(figure, "East [m]", "North [m]")
    where, way = ("near the ego ", "the ego's way") if _have_ego(cells) else ("", "the road of traffic.along, if any")
    caption = f"Where collisions of any vehicles {where}were, all seeds together; grey: {way}."
    columns = [*study.factors, "seed", "time_s", "x_m", "y_m", "impact_speed_mps"]
    return StudyFigure("collisions_map", caption, svg_of(figure, "collisions_map"), columns, rows)
