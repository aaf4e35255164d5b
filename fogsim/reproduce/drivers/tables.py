"""Tables and records of the evaluation of drivers in fog."""

import math
from collections.abc import Mapping, Sequence

from fogsim.reproduce.drivers.findings import FINDINGS
from fogsim.reproduce.drivers.passages import Measures
from fogsim.reproduce.drivers.plan import SIGNED, Case, Interval, Pair, Plan, Results, interval
from fogsim.reproduce.drivers.published import Finding, Look, Verdict
from fogsim.reproduce.drivers.road import PairMeasures
from fogsim.reproduce.result import Cell, Rows, TitledTable
from fogsim.units import finite_or_none

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
            row += [_cell(ours, 1.0, _digits(ours)), "—" if verdict is Verdict.UNKNOWN else verdict.value]
        rows.append(tuple(row))
    return tuple(rows)


def _compared(finding: Finding, results: Results, population: str) -> tuple[Interval, Verdict]:
    """Ours of a population, and whether it agrees."""
    ours = interval(finding.values(Look(results, population)))
    return ours, finding.verdict(ours.mean)


def _digits(ours: Interval) -> int:
    return 2 if abs(ours.mean) < 3.0 else 1


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
