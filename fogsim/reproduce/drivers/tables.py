"""Tables and records of the evaluation of drivers in fog."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fogsim.core.kinematics import DECELERATION, REACTION_TIME, safe_speed
from fogsim.reproduce.drivers.findings import FINDINGS, Finding, Look, Verdict
from fogsim.reproduce.drivers.plan import (
    DEFAULT,
    MEDIUM,
    SEEING,
    SIGNED,
    SPARSE,
    Case,
    Interval,
    Pair,
    Plan,
    Results,
    interval,
)
from fogsim.reproduce.drivers.road import BRAKING, THINKING_TIME, Measures, PairMeasures
from fogsim.reproduce.result import Cell, Rows, TitledTable, figure_image
from fogsim.units import KMH_PER_MPS, finite_or_none

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


_COLUMNS: Mapping[str, tuple[str, float, int]] = {
    "free_speed": ("free speed, km/h", 1.0, 1),
    "free_speed_sd": ("its sd", 1.0, 1),
    "overdriving": ("overdrives, %", 100.0, 0),
    "overdriving_aashto": ("by AASHTO, %", 100.0, 0),
    "headway_15": ("headway 15 %, s", 1.0, 2),
    "headway_below_1": ("< 1 s, %", 100.0, 1),
    "headway_below_2": ("< 2 s, %", 100.0, 1),
    "following_headway": ("followers' headway, s", 1.0, 2),
    "following_distance": ("and gap, m", 1.0, 1),
    "ttc_15": ("TTC 15 %, s", 1.0, 0),
    "ttc_50": ("TTC 50 %, s", 1.0, 0),
}
"""Heading, factor and digits of what the tables of traffic show."""


def tables(results: Results, plan: Plan) -> tuple[TitledTable, ...]:
    """Published findings with ours, then the traffic of every population."""
    seeds, populations = f"{len(plan.seeds)} seeds", tuple(plan.populations)
    found = TitledTable(
        f"What is published, and ours ({seeds}, mean [95 % interval])", _findings_table(results, populations)
    )
    names = [*populations, *dict.fromkeys(c.population for c in plan.cases if c.population not in populations)]
    note = f"({seeds}, mean ± half the 95 % interval)"
    traffic = (TitledTable(f"Traffic: {name} {note}", _traffic(results, plan, name)) for name in names)
    return (found, *traffic)


def _findings_table(results: Results, populations: Sequence[str]) -> Rows:
    """Every finding next to ours of some populations."""
    heading = ["published", "source", "size", *(cell for name in populations for cell in (name, "agrees"))]
    rows = [tuple(heading)]
    for finding in FINDINGS:
        row = [f"{'* ' if finding.six else ''}{finding.text}", finding.source, str(finding.published)]
        for name in populations:
            ours, verdict = _compared(finding, results, name)
            digits = 2 if abs(ours.mean) < 3.0 else 1
            row += [_cell(ours, 1.0, digits), "—" if verdict is Verdict.UNKNOWN else verdict.value]
        rows.append(tuple(row))
    return tuple(rows)


def _compared(finding: Finding, results: Results, population: str) -> tuple[Interval, Verdict]:
    """Ours of a population, and whether it agrees."""
    ours = interval(finding.values(Look(results, population)))
    return ours, finding.verdict(ours.mean)


def _cell(value: Interval, factor: float, digits: int) -> str:
    if math.isnan(value.mean):
        return "—"
    mean, low, high = (f"{factor * number + 0.0:.{digits}f}" for number in (value.mean, value.low, value.high))
    return f"{mean} [{low}, {high}]"


def _spread(value: Interval, factor: float, digits: int) -> str:
    if math.isnan(value.mean):
        return "—"
    return f"{factor * value.mean:.{digits}f} ± {0.5 * factor * (value.high - value.low):.{digits}f}"


def _traffic(results: Results, plan: Plan, population: str) -> Rows:
    rows = [("demand, 1/h", "V_met, m", *(heading for heading, _, _ in _COLUMNS.values()))]
    for case in plan.cases:
        if case.population == population:
            cells = (
                _spread(interval(results.over_seeds(case, name)), factor, digits)
                for name, (_, factor, digits) in _COLUMNS.items()
            )
            rows.append((f"{case.demand:.0f}", _metres(case.visibility), *cells))
    return tuple(rows)


def _metres(visibility: float) -> str:
    return f"{visibility:.0f}" if math.isfinite(visibility) else "∞"


def records(results: Results, plan: Plan) -> tuple[Mapping[str, Cell], ...]:
    """Flat records: one for each measure of each case and pair, then one for each finding of each population."""
    described: list[tuple[Case | Pair, dict[str, Cell], tuple[str, ...]]] = [
        *((case, _case_record(case), Measures._fields) for case in plan.cases),
        *((pair, _pair_record(pair), PairMeasures._fields) for pair in plan.pairs),
    ]
    found: list[Mapping[str, Cell]] = [
        record | _interval_record(measure, interval(results.over_seeds(case, measure)))
        for case, record, measures in described
        for measure in measures
    ]
    for population in plan.populations:
        for finding in FINDINGS:
            ours, verdict = _compared(finding, results, population)
            agreement: dict[str, Cell] = {
                "published": str(finding.published),
                "source": finding.source,
                "one_of_six": finding.six,
                "verdict": verdict.value,
            }
            found.append({"population": population} | _interval_record(finding.name, ours) | agreement)
    return tuple(found)


def _case_record(case: Case) -> dict[str, Cell]:
    return {
        "population": case.population,
        "demand_per_h": case.demand,
        "visibility_m": finite_or_none(case.visibility),
        "signs": case.population == SIGNED,
    }


def _pair_record(pair: Pair) -> dict[str, Cell]:
    return {
        "population": pair.population,
        "leader_speed_mps": pair.leader_speed,
        "visibility_m": finite_or_none(pair.visibility),
    }


def _interval_record(name: str, value: Interval) -> dict[str, Cell]:
    return {
        "measure": name,
        "mean": finite_or_none(value.mean),
        "low": finite_or_none(value.low),
        "high": finite_or_none(value.high),
    }
