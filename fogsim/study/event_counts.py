"""Numbers of events behind a study's rates, and metrics whose events are too few to compare policies."""

import math
import re
from collections.abc import Mapping, Sequence

from fogsim.study.comparison import Difference, number_of
from fogsim.study.main_metrics import metric_words
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
        if words.better in {"less", "lower"} and not any(number_of(row.get(metric)) for row in rows):
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


def events_of_both(
    study: Study, cells: Mapping[tuple[str, ...], Sequence[Row]], one: Difference
) -> tuple[int | None, int | None]:
    """Events under the baseline and in the cell that is compared to it; None if the metric counts none."""
    of_baseline, here = tuple({**one.levels, **study.baseline}.values()), tuple(one.levels.values())
    return event_count(one.metric, cells[of_baseline]), event_count(one.metric, cells[here])
