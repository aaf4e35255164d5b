"""Numbers of events behind a study's rates, and metrics whose events are too few to compare policies."""

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from fogsim.study.comparison import Difference, number_of
from fogsim.study.main_metrics import metric_words
from fogsim.study.plan import Study
from fogsim.study.table import Row

_EVENTS = re.compile(r".*(collisions|conflicts|encroachments)(_below_\d+_s)?(_per_(?P<per>\w+))?")
_DENOMINATORS: Mapping[str | None, tuple[str, float]] = {
    "vehicle_km": ("traffic_vehicle_distance_m", 1e3),
    "million_vehicle_km": ("traffic_vehicle_distance_m", 1e9),
    "vehicle_h": ("traffic_vehicle_time_s", 3600.0),
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


def rows_of_cells(study: Study, rows: Sequence[Row]) -> dict[tuple[str, ...], list[Row]]:
    """Rows by the levels of all factors."""
    cells: dict[tuple[str, ...], list[Row]] = {}
    for row in rows:
        cells.setdefault(tuple(str(row[name]) for name in study.factors), []).append(row)
    return cells


def scarce_events(study: Study, rows: Sequence[Row], differences: Sequence[Difference]) -> list[str]:
    """A line for metrics without any event, and one for those with too few in every comparison to show a difference.

    With n events, at most n seeds differ, and the paired permutation test cannot give less than 2^(1 − n).
    """
    cells, needed = rows_of_cells(study, rows), 1 + math.ceil(-math.log2(1.0 - study.confidence))
    none, few = [], []
    for metric in dict.fromkeys(one.metric for one in differences):
        words = metric_words(metric)
        counts = [_both(study, cells, one) for one in differences if one.metric == metric]
        if words.better == "less" and not any(number_of(row.get(metric)) for row in rows):
            none.append(words.label)
        elif counts and None not in counts and (most := max(filter(None, counts), default=0)) < needed:
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


def _both(study: Study, cells: Mapping[tuple[str, ...], Sequence[Row]], one: Difference) -> int | None:
    """Events in a cell and in the baseline that it is compared to."""
    levels: dict[str, Any] = dict(one.levels)
    both = [tuple(levels.values()), tuple({**levels, **study.baseline}.values())]
    counts = [event_count(one.metric, cells[cell]) for cell in both]
    return None if None in counts else sum(count for count in counts if count is not None)
