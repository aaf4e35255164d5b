"""A picture of drivers in fog: speed, overdriving and close following against visibility, with what is published."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fogsim.core.kinematics import DECELERATION, REACTION_TIME, safe_speed
from fogsim.reproduce.drivers.passages import BRAKING, THINKING_TIME
from fogsim.reproduce.drivers.plan import DEFAULT, MEDIUM, SEEING, SPARSE, Case, Plan, Results, interval
from fogsim.reproduce.figure_image import figure_image
from fogsim.units import KMH_PER_MPS

_COLOURS = {DEFAULT: "tab:blue", SEEING: "tab:orange"}
_CLEAR_AT = 600.0
"""Where clear air is drawn [m]."""


def picture(results: Results, plan: Plan) -> NDArray[np.uint8]:
    """Draw it (rows, cols, 3)."""
    figure = Figure(figsize=(12.8, 8.6), dpi=100, layout="constrained")
    panels = figure.subplots(2, 2)
    _draw_speed(panels[0, 0], results, plan)
    _draw_overdriving(panels[0, 1], results, plan)
    _draw_headways(panels[1, 0], results, plan)
    _draw_ttc(panels[1, 1], results, plan)
    for axes in panels.flat:
        _finish(axes, plan, columns=2 if axes in panels[1] else 1)
    return figure_image(figure)


def _finish(axes: Axes, plan: Plan, columns: int) -> None:
    axes.set_xscale("log")
    places = [_place(v) for v in plan.visibilities]
    axes.set_xticks(places, [f"{v:.0f}" if np.isfinite(v) else "∞" for v in plan.visibilities])
    axes.set_xticks([], minor=True)
    axes.set_xlabel("V_met [m]")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8, ncols=columns)


def _place(visibility: float) -> float:
    return min(visibility, _CLEAR_AT)


def _curve(axes: Axes, results: Results, plan: Plan, case: Case, measure: str, factor: float, style: str) -> None:
    """Means with their intervals over visibility, of the case's population and demand."""
    cases = [Case(case.population, case.demand, v) for v in sorted(plan.visibilities)]
    intervals = [interval(results.over_seeds(one, measure)) for one in cases]
    mean, low, high = (factor * np.array([getattr(one, name) for one in intervals]) for name in ("mean", "low", "high"))
    places = [_place(one.visibility) for one in cases]
    colour = _COLOURS.get(case.population, "tab:green")
    axes.fill_between(places, low, high, color=colour, alpha=0.2, linewidth=0.0)
    axes.plot(places, mean, style, color=colour, label=f"{case.population}, {case.demand:.0f}/h")


def _draw_speed(axes: Axes, results: Results, plan: Plan) -> None:
    demand = SPARSE if SPARSE in plan.demands else plan.demands[0]
    for population in plan.populations:
        _curve(axes, results, plan, Case(population, demand, np.inf), "free_speed", 1.0, "o-")
    sight = np.linspace(25.0, 300.0, 100)
    for name, reaction, braking, style in (
        ("Highway Code", THINKING_TIME, BRAKING, ":"),
        ("AASHTO", REACTION_TIME, DECELERATION, "--"),
    ):
        safe = [KMH_PER_MPS * safe_speed(float(v), reaction, braking) for v in sight]
        axes.plot(sight, safe, style, color="grey", linewidth=1.0, label=f"stops within sight ({name})")
    axes.plot([30.0], [29.0], "k*", markersize=11, label="A16 below 35 m, no signs: 29 km/h")
    axes.plot(
        [100.0, 100.0], [101.0, 116.0], "k_", markersize=11, label="M4 above 91 m, lanes 2 and 3: 101 and 116 km/h"
    )
    axes.set_ylim(0.0, 135.0)
    axes.set_ylabel("mean free speed [km/h]")


def _draw_overdriving(axes: Axes, results: Results, plan: Plan) -> None:
    demand = MEDIUM if MEDIUM in plan.demands else plan.demands[0]
    for population in plan.populations:
        _curve(axes, results, plan, Case(population, demand, np.inf), "overdriving", 100.0, "o-")
    axes.plot([30.0, 50.0], [50.0, 50.0], "k-", marker="^", label="SR281: more than half at ≤ 50 m")
    axes.plot([150.0], [50.0], "kv", label="LR958: less than half at 150 m")
    axes.set_ylim(-3.0, 103.0)
    axes.set_ylabel("too fast to stop within V_met, Highway Code [%]")


def _draw_headways(axes: Axes, results: Results, plan: Plan) -> None:
    for population in plan.populations:
        for demand, style in zip(plan.demands, ("o-", "s--", "^:"), strict=False):
            _curve(axes, results, plan, Case(population, demand, np.inf), "headway_below_2", 100.0, style)
    axes.plot([150.0], [100.0 / 3.0], "k*", markersize=11, label="LR958: one third at 150 m")
    axes.set_ylim(0.0, 1.4 * axes.get_ylim()[1])
    axes.set_ylabel("time headways below 2 s [%]")


def _draw_ttc(axes: Axes, results: Results, plan: Plan) -> None:
    for population in plan.populations:
        for demand, style in zip(plan.demands, ("o-", "s--", "^:"), strict=False):
            _curve(axes, results, plan, Case(population, demand, np.inf), "ttc_50", 1.0, style)
    axes.set_ylim(0.0, 1.4 * axes.get_ylim()[1])
    axes.set_ylabel("median time to collision of closing followers [s]")
