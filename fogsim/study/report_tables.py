"""Tables of a study's report."""

import math
import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from fogsim.study.comparison import Difference, number_of
from fogsim.study.drawing import Grid
from fogsim.study.main_metrics import metric_words, signed
from fogsim.study.plan import Study
from fogsim.study.table import Row, rows_of_cells

_EVENTS = re.compile(r".*(collisions|conflicts|encroachments|events)(_below_\d+_s)?(_per_(?P<per>\w+))?")
_DENOMINATORS: Mapping[str | None, tuple[str, float]] = {
    "vehicle_km": ("traffic_vehicle_distance_m", 1e3),
    "million_vehicle_km": ("traffic_vehicle_distance_m", 1e9),
    "vehicle_h": ("traffic_vehicle_time_s", 3600.0),
    "cohort_vehicle": ("traffic_cohort_vehicles", 1.0),
}
"""Metric that a rate's events are divided by, and how much of it is one unit."""


class TableCell(NamedTuple):
    """A number, or a name with a hint, and small lines below it, the last ones bold."""

    text: str
    below: Sequence[str] = ()
    bold: Sequence[str] = ()
    hint: str = ""


class Table(NamedTuple):
    """A table whose last columns, as many as `numbers`, hold numbers."""

    head: Sequence[str]
    rows: Sequence[Sequence[str | TableCell]]
    numbers: int = 0


def main_tables(
    study: Study,
    rows: Sequence[Row],
    metrics: Sequence[str],
    differences: Sequence[Difference],
    remarks: Mapping[str, str],
) -> list[tuple[str, Table]]:
    """Means and differences of metrics: a table per combination of the other factors, a column per policy."""
    grid = Grid(study)
    of_cell = rows_of_cells(study.factors, rows)
    found = {(one.metric, tuple(one.levels.values())): one for one in differences}
    tables = []
    for panel, title in grid.panels.items():
        cells = [grid.cell(policy, panel) for policy in grid.policies]
        body = [
            [
                TableCell(metric_words(metric).axis, _first_part(remarks.get(metric)), hint=metric),
                *(_mean_cell(study, metric, of_cell.get(cell, []), found.get((metric, cell))) for cell in cells),
            ]
            for metric in metrics
        ]
        tables.append((title, Table(["metric", *grid.policies], body, len(grid.policies))))
    return tables


def _first_part(remark: str | None) -> list[str]:
    return [] if remark is None else [remark.partition(":")[0]]


def _mean_cell(study: Study, metric: str, rows: Sequence[Row], one: Difference | None) -> TableCell:
    scale = metric_words(metric).scale
    values = [v for row in rows if (v := number_of(row.get(metric))) is not None]
    text = f"{scale * sum(values) / len(values):.3g}" if values else "–"
    events = _events(event_count(metric, rows))
    if one is None:
        return TableCell(text, events)
    said = [signed(scale * one.difference)]
    if one.low is not None and one.high is not None:
        said.append(f"({signed(scale * one.low, 2)} … {signed(scale * one.high, 2)})")
    return TableCell(text, events, said) if one.is_shown(study.confidence) else TableCell(text, [*events, *said])


def event_count(metric: str, rows: Sequence[Row]) -> int | None:
    """Events behind a metric in all runs together; None if it counts none, or no run has it."""
    found = _EVENTS.fullmatch(metric)
    if found is None or (found["per"] and found["per"] not in _DENOMINATORS):
        return None
    key, unit = _DENOMINATORS.get(found["per"], ("", 1.0))
    counts = [
        value * (of / unit)
        for row in rows
        if (value := number_of(row.get(metric))) is not None
        and (of := number_of(row.get(key)) if key else 1.0) is not None
    ]
    return round(math.fsum(counts)) if counts else None


def events_of_both(
    study: Study, cells: Mapping[tuple[str, ...], Sequence[Row]], one: Difference
) -> tuple[int | None, int | None]:
    """Events under the baseline and in the cell that is compared to it; None if the metric counts none."""
    of_baseline, here = tuple({**one.levels, **study.baseline}.values()), tuple(one.levels.values())
    return event_count(one.metric, cells[of_baseline]), event_count(one.metric, cells[here])


def _events(count: int | None) -> list[str]:
    return [] if count is None else [f"{count} event{'' if count == 1 else 's'}"]


def comparison_table(
    study: Study, rows: Sequence[Row], differences: Sequence[Difference], remarks: Mapping[str, str]
) -> Table:
    """Every comparison with its interval, p-values, events and required seeds, in the metric's own unit."""
    cells = rows_of_cells(study.factors, rows)
    numbers = ("baseline", "mean", "difference", f"{study.confidence:.0%} interval", "p", "p adjusted", "seeds")
    head = ["metric", *study.factors, *numbers, f"seeds for ± {study.wanted_interval:.0%}"]
    body: list[list[str | TableCell]] = []
    for one in differences:
        interval = remarks.get(one.metric, "–") if one.low is None else f"{one.low:.3g} … {one.high:.3g}"
        means = zip((one.baseline_mean, one.mean), events_of_both(study, cells, one), strict=True)
        body.append(
            [
                *(one.metric, *one.levels.values()),
                *(TableCell(f"{mean:.3g}", _events(count)) for mean, count in means),
                *(f"{one.difference:+.3g}", interval),
                *(_shown(one.p_value), _shown(one.adjusted_p_value), str(one.pairs)),
                "–" if one.seeds_for_half_width is None else str(one.seeds_for_half_width),
            ]
        )
    return Table(head, body, len(numbers) + 1)


def _shown(value: float | None) -> str:
    return "–" if value is None else f"{value:.2g}"
