"""A study's results in words: significant differences only."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from fogsim.scenario.wording.sentences import empty_start
from fogsim.study.comparison import Difference, number_of
from fogsim.study.drawing import Grid
from fogsim.study.main_metrics import MetricWords, metric_words, signed
from fogsim.study.plan import Study
from fogsim.study.report_tables import events_of_both
from fogsim.study.table import Row, rows_of_cells


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
    return [*empty, *scarce_events(study, done, differences)]


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
    shape = " × ".join(f"{len(levels)} {name}" for name, levels in study.factors.items())
    seeds = len({run.seed for run in study.runs})
    done = sum(row["status"] == "complete" for row in rows)
    return (
        f"{shape} × {seeds} seeds = {len(rows)} runs, {'all' if done == len(rows) else done} complete. "
        f"Policies are compared to {' · '.join(study.baseline.values())} with the same seed."
    )


def _findings(study: Study, differences: Sequence[Difference]) -> Iterator[tuple[str, list[str]]]:
    """Shown differences of each metric, in a list for each combination of the other factors."""
    grid = Grid(study)
    for panel, title in grid.panels.items():
        cells = {grid.cell(policy, panel) for policy in grid.policies}
        here = [one for one in differences if tuple(one.levels.values()) in cells]
        by_metric = {one.metric: [each for each in here if each.metric == one.metric] for one in here}
        shown = {m for m, found in by_metric.items() if any(one.is_shown(study.confidence) for one in found)}
        items = [_finding(grid, metric, by_metric[metric]) for metric in by_metric if metric in shown]
        nothing = [metric_words(metric).label for metric in by_metric if metric not in shown]
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
    unshown = [one.levels[grid.policy_factor] for one in differences if not one.is_shown(grid.study.confidence)]
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
        f"A difference counts as shown where its {study.confidence:.0%} interval excludes 0 and the paired permutation "
        f"test has p ≤ {level:.2g}: {shown} of {len(tested)} comparisons that vary. If no policy did anything, about "
        f"{level * len(tested):.0f} would by chance; adjusted to their number (Benjamini & Hochberg 1995), {kept} are."
    ]
    pairs = max(one.pairs for one in tested)
    if 2.0 ** (1 - pairs) > level:
        said.append(
            f"Of {pairs} seeds, the test can show nothing at this confidence: its least p is {2.0 ** (1 - pairs):.2g}."
        )
    needed = _seeds_needed(tested)
    if needed:
        said.append(
            f"Seeds for intervals of ± {study.wanted_interval:.0%} of the baseline's mean everywhere: {needed}."
        )
    return said


def _seeds_needed(differences: Sequence[Difference]) -> str:
    most: dict[str, int] = {}
    for one in differences:
        if one.seeds_for_half_width is not None:
            most[one.metric] = max(most.get(one.metric, 0), one.seeds_for_half_width)
    return "; ".join(f"{metric_words(metric).label} {seeds}" for metric, seeds in most.items())
