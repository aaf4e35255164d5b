"""Tables of a study's report."""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from html import escape

from fogsim.study.comparison import Difference, moved_denominators, number_of
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


def main_tables(
    study: Study,
    rows: Sequence[Row],
    metrics: Sequence[str],
    differences: Sequence[Difference],
    remarks: Mapping[str, str],
) -> str:
    """Means and differences of metrics: a table per combination of the other factors, a column per policy."""
    grid = Grid(study)
    of_cell = rows_of_cells(study.factors, rows)
    found = {(one.metric, tuple(one.levels.values())): one for one in differences}
    parts = ["<h2>Main metrics</h2>"]
    for panel, title in grid.panels.items():
        head = ["metric", *grid.policies]
        body = []
        for metric in metrics:
            cells = [grid.cell(policy, panel) for policy in grid.policies]
            values = [_mean_cell(study, metric, of_cell.get(cell, []), found.get((metric, cell))) for cell in cells]
            remark = f"<br><small>{escape(remarks[metric].partition(':')[0])}</small>" if metric in remarks else ""
            label = f'<span title="{escape(metric)}">{escape(metric_words(metric).axis)}</span>{remark}'
            body.append([label, *values])
        parts += [f"<h3>{escape(title)}</h3>" if title else "", _table(head, body, texts=1)]
    note = (
        "Mean over the seeds; below, the difference to the baseline with its interval; bold where a difference is "
        "shown. Shares in percent, their differences in percentage points."
    )
    notes = (note, *moved_denominators(study, rows))
    return "\n".join([*parts, *(f'<p class="note">{escape(one)}</p>' for one in notes)])


def _mean_cell(study: Study, metric: str, rows: Sequence[Row], one: Difference | None) -> str:
    scale = metric_words(metric).scale
    values = [v for row in rows if (v := number_of(row.get(metric))) is not None]
    text = f"{scale * sum(values) / len(values):.3g}" if values else "–"
    count = event_count(metric, rows)
    text += "" if count is None else f"<br><small>{_events(count)}</small>"
    if one is None:
        return text
    said = signed(scale * one.difference)
    if one.low is not None and one.high is not None:
        said += f"<br>({signed(scale * one.low, 2)} … {signed(scale * one.high, 2)})"
    return f"{text}<br><small>{f'<b>{said}</b>' if one.is_shown(study.confidence) else said}</small>"


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


def _events(count: int) -> str:
    return f"{count} event{'' if count == 1 else 's'}"


def comparison_table(
    study: Study, rows: Sequence[Row], differences: Sequence[Difference], remarks: Mapping[str, str]
) -> str:
    """Every comparison with its interval, p-values, events and required seeds, in the metric's own unit."""
    cells = rows_of_cells(study.factors, rows)
    numbers = ("baseline", "mean", "difference", f"{study.confidence:.0%} interval", "p", "p adjusted", "seeds")
    head = ["metric", *study.factors, *numbers, f"seeds for ± {study.wanted_interval:.0%}"]
    body = []
    for one in differences:
        interval = remarks.get(one.metric, "–") if one.low is None else f"{one.low:.3g} … {one.high:.3g}"
        body.append(
            [
                *(escape(text) for text in (one.metric, *one.levels.values())),
                *map(_with_events, (one.baseline_mean, one.mean), events_of_both(study, cells, one)),
                *(f"{one.difference:+.3g}", escape(interval)),
                *(_shown(one.p_value), _shown(one.adjusted_p_value), str(one.pairs)),
                "–" if one.seeds_for_half_width is None else str(one.seeds_for_half_width),
            ]
        )
    return _table(head, body, texts=1 + len(study.factors))


def _with_events(mean: float, count: int | None) -> str:
    return f"{mean:.3g}" if count is None else f"{mean:.3g}<br><small>{_events(count)}</small>"


def plain_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """HTML table of text."""
    return _table(head, [[escape(text) for text in row] for row in rows], texts=len(head))


def _table(head: Sequence[str], body: Sequence[Sequence[str]], texts: int) -> str:
    """A table whose first columns are text, and the others numbers; it scrolls if it is too wide."""
    kinds = ["" if i < texts else ' class="value"' for i in range(len(head))]
    top = "".join(f"<th{kind}>{escape(name)}</th>" for name, kind in zip(head, kinds, strict=True))
    lines = "\n".join(
        "<tr>" + "".join(f"<td{kind}>{cell}</td>" for cell, kind in zip(row, kinds, strict=True)) + "</tr>"
        for row in body
    )
    return f'<div class="scrolls"><table><tr>{top}</tr>\n{lines}</table></div>'


def _shown(value: float | None) -> str:
    return "–" if value is None else f"{value:.2g}"
