"""A study's results in words: significant differences only."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from fogsim.scenario.wording.sentences import empty_start
from fogsim.study.comparison import Difference, number_of
from fogsim.study.drawing import Grid
from fogsim.study.main_metrics import MetricWords, metric_words, percent, short_number, signed
from fogsim.study.plan import Study, equal_cells, grid_text
from fogsim.study.table import Row, rows_of_cells

_EVENTS = re.compile(r".*(collisions|conflicts|encroachments|events)(_below_\d+_s)?(_per_(?P<per>\w+))?")
_DENOMINATORS: Mapping[str | None, tuple[str, float]] = {
    "vehicle_km": ("traffic_vehicle_distance_m", 1e3),
    "million_vehicle_km": ("traffic_vehicle_distance_m", 1e9),
    "vehicle_h": ("traffic_vehicle_time_s", 3600.0),
    "cohort_vehicle": ("traffic_cohort_vehicles", 1.0),
}
"""Metric that a rate's events are divided by, and how much of it is one unit."""


class _TableCell(NamedTuple):
    """A number, or a name with a hint, and small lines below it, the last ones bold."""

    text: str
    below: Sequence[str] = ()
    bold: Sequence[str] = ()
    hint: str = ""


class Table(NamedTuple):
    """A table whose last columns, as many as `numbers`, hold numbers."""

    head: Sequence[str]
    rows: Sequence[Sequence[str | _TableCell]]
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
                _TableCell(metric_words(metric).axis, _first_part(remarks.get(metric)), hint=metric),
                *(_mean_cell(study, metric, of_cell.get(cell, []), found.get((metric, cell))) for cell in cells),
            ]
            for metric in metrics
        ]
        tables.append((title, Table(["metric", *grid.policies], body, len(grid.policies))))
    return tables


def _first_part(remark: str | None) -> list[str]:
    return [] if remark is None else [remark.partition(":")[0]]


def _mean_cell(study: Study, metric: str, rows: Sequence[Row], one: Difference | None) -> _TableCell:
    scale = metric_words(metric).scale
    values = [v for row in rows if (v := number_of(row.get(metric))) is not None]
    text = short_number(scale * sum(values) / len(values)) if values else "–"
    events = _events(event_count(metric, rows))
    if one is None:
        return _TableCell(text, events)
    said = [one.untested or signed(scale * one.difference)]
    if one.low is not None and one.high is not None:
        said.append(f"({signed(scale * one.low, 2)} … {signed(scale * one.high, 2)})")
    return _TableCell(text, events, said) if one.is_shown(study.confidence) else _TableCell(text, [*events, *said])


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
    """Events under the baseline and in the cell compared to it, of their common seeds; None if it counts none."""
    both = [cells[tuple(levels.values())] for levels in ({**one.levels, **study.baseline}, one.levels)]
    common = {row["seed"] for row in both[0]} & {row["seed"] for row in both[1]}
    of_baseline, here = (event_count(one.metric, [row for row in rows if row["seed"] in common]) for rows in both)
    return of_baseline, here


def _events(count: int | None) -> list[str]:
    return [] if count is None else [f"{count} event{'' if count == 1 else 's'}"]


def comparison_table(
    study: Study, rows: Sequence[Row], differences: Sequence[Difference], remarks: Mapping[str, str]
) -> Table:
    """Every comparison with its interval, p-values, events and required seeds, in the metric's own unit."""
    cells = rows_of_cells(study.factors, rows)
    numbers = ("baseline", "mean", "difference", f"{percent(study.confidence)} interval", "p", "p adjusted", "seeds")
    head = ["metric", *study.factors, *numbers, f"seeds for ± {percent(study.wanted_interval)}"]
    body: list[list[str | _TableCell]] = []
    for one in differences:
        unknown = one.untested or remarks.get(one.metric, "–")
        interval = (
            unknown if one.low is None or one.high is None else f"{short_number(one.low)} … {short_number(one.high)}"
        )
        means = zip((one.baseline_mean, one.mean), events_of_both(study, cells, one), strict=True)
        body.append(
            [
                *(one.metric, *one.levels.values()),
                *(_TableCell(short_number(mean), _events(count)) for mean, count in means),
                *(signed(one.difference), interval),
                *(_shown(one.p_value), _shown(one.adjusted_p_value), str(one.pairs)),
                "–" if one.seeds_for_half_width is None else str(one.seeds_for_half_width),
            ]
        )
    return Table(head, body, len(numbers) + 1)


def _shown(value: float | None) -> str:
    return "–" if value is None else f"{value:.2g}"


class Summary(NamedTuple):
    """What the report says first; findings are lists with a title for each combination of the other factors."""

    compared: str
    warnings: Sequence[str]
    findings: Sequence[tuple[str, Sequence[str]]]
    notes: Sequence[str]


def summary(
    study: Study, rows: Sequence[Row], differences: Sequence[Difference], remarks: Mapping[str, str]
) -> Summary:
    """Summary of the report, from the differences of the metrics that it shows first."""
    telling = [one for one in differences if one.metric not in remarks]
    warnings = _warnings(study, rows, differences)
    return Summary(_compared(study, rows), warnings, list(_findings(study, telling)), _doubts(study, telling))


def _warnings(study: Study, rows: Sequence[Row], differences: Sequence[Difference]) -> list[str]:
    """Reasons for which the study may show nothing, or something else than it seems."""
    done = [row for row in rows if row["status"] == "complete"]
    empty = dict.fromkeys(filter(None, map(empty_start, study.cells().values())))
    return [*equal_cells(study), *empty, *scarce_events(study, done, differences)]


def scarce_events(study: Study, rows: Sequence[Row], differences: Sequence[Difference]) -> list[str]:
    """A line for metrics without any event, and one for those with too few in every comparison to show a difference.

    With n events, at most n seeds differ, and the paired permutation test cannot give less than 2^(1 − n).
    """
    cells, needed = rows_of_cells(study.factors, rows), 1 + math.ceil(-math.log2(1.0 - study.confidence))
    none, few = [], []
    for metric in dict.fromkeys(one.metric for one in differences):
        words = metric_words(metric)
        both = [events_of_both(study, cells, one) for one in differences if one.metric == metric]
        counts = [of_baseline + here for of_baseline, here in both if of_baseline is not None and here is not None]
        if words.better == "lower" and not any(number_of(row.get(metric)) for row in rows):
            none.append(words.label)
        elif counts and (most := max(counts)) < needed:
            few.append(f"{words.label} (at most {most})")
    kilometres = math.fsum(number_of(row.get("traffic_vehicle_distance_m")) or 0.0 for row in rows) / 1000.0
    advice = "raise the demand, add an incident, or choose another metric."
    said = f"This scene produces no such event in any of its {len(rows)} runs ({kilometres:.4g} vehicle-km)"
    rare = f"Fewer than the {needed} events that a difference needs at least, in every comparison"
    return [
        f"{text}: {'; '.join(names)}. To compare policies, {advice}"
        for text, names in ((said, none), (rare, few))
        if names
    ]


def _compared(study: Study, rows: Sequence[Row]) -> str:
    done = sum(row["status"] == "complete" for row in rows)
    return (
        f"{grid_text(study)}, {'all' if done == len(rows) else done} complete. "
        f"Policies are compared to {' · '.join(study.baseline.values())} with the same seed."
    )


def _findings(study: Study, differences: Sequence[Difference]) -> Iterator[tuple[str, list[str]]]:
    """Shown and untested differences of each metric, in a list for each combination of the other factors."""
    grid = Grid(study)
    for panel, title in grid.panels.items():
        cells = {grid.cell(policy, panel) for policy in grid.policies}
        here = [one for one in differences if tuple(one.levels.values()) in cells]
        by_metric = {one.metric: [each for each in here if each.metric == one.metric] for one in here}
        named = {one.metric for one in here if one.untested or one.is_shown(study.confidence)}
        items = [_finding(grid, metric, by_metric[metric]) for metric in by_metric if metric in named]
        nothing = [metric_words(metric).label for metric in by_metric if metric not in named]
        if nothing:
            items.append(f"No difference could be shown in: {', '.join(nothing)}.")
        if items:
            yield title, items


def _finding(grid: Grid, metric: str, differences: Sequence[Difference]) -> str:
    """Policies that differ from the baseline in one metric, by how much, and those without a shown difference."""
    words = metric_words(metric)
    groups: dict[str, list[str]] = {}
    for one in sorted(differences, key=lambda each: each.difference):
        policy = one.levels[grid.policy_factor]
        if one.is_shown(grid.study.confidence):
            told = f"{policy} ({signed(words.scale * one.difference)})"
            groups.setdefault(_verdict(one, words), []).append(told)
    unshown = [
        one.levels[grid.policy_factor] + (f" ({one.untested})" if one.untested else "")
        for one in differences
        if not one.is_shown(grid.study.confidence)
    ]
    said = [f"{verdict} with {', '.join(policies)}" for verdict, policies in groups.items()]
    said += [f"no difference could be shown for {', '.join(unshown)}"] if unshown else []
    unit = "percentage points" if words.unit == "%" else words.unit
    return f"{words.label}{f' [{unit}]' if unit else ''}: {'; '.join(said)}."


def _verdict(one: Difference, words: MetricWords) -> str:
    """Whether a difference is an improvement, if the metric ranks policies."""
    direction = "lower" if one.difference < 0 else "higher"
    if words.better is None:
        return direction
    return "better" if direction == words.better else "worse"


def _doubts(study: Study, differences: Sequence[Difference]) -> list[str]:
    """Number of comparisons, and the limits of this number of comparisons and seeds."""
    tested = [one for one in differences if one.p_value is not None]
    if not tested:
        return ["Nothing was compared."]
    level = 1.0 - study.confidence
    shown = sum(one.is_shown(study.confidence) for one in tested)
    kept = sum(one.is_shown(study.confidence) and (one.adjusted_p_value or 1.0) <= level for one in tested)
    said = [
        f"A difference counts as shown where its {percent(study.confidence)} interval excludes 0 and the paired "
        f"permutation test has p ≤ {level:.2g}: {shown} of {len(tested)} comparisons that vary. If no policy did "
        f"anything, about {level * len(tested):.0f} would by chance; adjusted to their number (Benjamini & Hochberg "
        f"1995), {kept} are."
    ]
    pairs = max(one.pairs for one in tested)
    if 2.0 ** (1 - pairs) > level:
        said.append(
            f"Of {pairs} seeds, the test can show nothing at this confidence: its least p is {2.0 ** (1 - pairs):.2g}."
        )
    needed = _seeds_needed(tested)
    if needed:
        said.append(
            f"Seeds for intervals of ± {percent(study.wanted_interval)} of the baseline's mean everywhere: {needed}."
        )
    return said


def _seeds_needed(differences: Sequence[Difference]) -> str:
    most: dict[str, int] = {}
    for one in differences:
        if one.seeds_for_half_width is not None:
            most[one.metric] = max(most.get(one.metric, 0), one.seeds_for_half_width)
    return "; ".join(f"{metric_words(metric).label} {seeds}" for metric, seeds in most.items())
