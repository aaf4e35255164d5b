"""What `estimator_accuracy.py` makes of its rows: flat records, and the tables of docs/benchmarks/estimators.md."""

import math
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

from estimator_scenes import CAMERAS
from harness import Row, lines_of, mean, median, quantile

from fogsim.estimators.zhu2015 import zhu_category
from fogsim.units import extinction_from_visibility
from fogsim.values.estimate import NORMAL_90_PERCENT

BINS = (25.0, 50.0, 100.0, 200.0, 400.0, 800.0, 1500.0)
EDGES, OFF_EDGE = (100.0, 300.0, 1000.0), 0.05
LEADS = ("absent", "unmeasured", "measured")
MIDDLE = (50.0, 400.0)  # visibilities of the table of conditions [m]
TIMED = (688, 515)


def record(table: str, form: str, lead: str, condition: str, visibility: str, rows: list[Row]) -> Row:
    """Flat record of rows that belong together; what cannot be said of them is None."""
    valid = [row for row in rows if row["valid"]]
    truth = [extinction_from_visibility(row["visibility"]) for row in valid]
    errors = [
        100.0 * abs(k / row["extinction"] - 1.0)
        for k, row in zip(truth, valid, strict=True)
        if k > 0 and row["extinction"] > 0
    ]
    covered = [
        abs(row["extinction"] - k) <= NORMAL_90_PERCENT * row["deviation"] for k, row in zip(truth, valid, strict=True)
    ]
    right = [row["class"] == zhu_category(row["visibility"]) for row in valid]
    off_edge = [all(abs(row["visibility"] / edge - 1.0) > OFF_EDGE for edge in EDGES) for row in valid]
    times = [row["ms"] for row in rows if row["ms"] is not None]
    return {
        "table": table,
        "method": form,
        "lead": lead,
        "condition": condition,
        "visibility": visibility,
        "frames": len(rows),
        "valid_share": mean([row["valid"] for row in rows], 3),
        "median_pct": median(errors, 2),
        "p95_pct": quantile(errors, 0.95, 2),
        "coverage": mean(covered, 3),
        "class_share": mean(right, 3),
        "class_off_edge_share": mean([hit for hit, off in zip(right, off_edge, strict=True) if off], 3),
        "ms": round(min(times), 2) if times else None,
    }


def grouped(rows: list[Row], *keys: str) -> Iterator[tuple[tuple[Any, ...], list[Row]]]:
    """Rows by what they have in common, in the order of their first."""
    groups: dict[tuple[Any, ...], list[Row]] = {}
    for row in rows:
        groups.setdefault(tuple(row[key] for key in keys), []).append(row)
    yield from groups.items()


def records(rows: list[Row]) -> Iterator[Row]:
    """By visibility, by class of fog, and by condition in middling fog."""
    rows = sorted(rows, key=lambda row: (LEADS.index(row["lead"]), row["camera"], row["levels"], not row["marks"]))
    for (form, lead), own in grouped(rows, "form", "lead"):
        for low, high in [*pairwise(BINS), (math.inf, math.inf)]:
            inside = [row for row in own if low <= row["visibility"] < high or row["visibility"] == low]
            if inside:
                name = f"{low:g}-{high:g}" if math.isfinite(high) else "inf"
                yield record("visibility", form, lead, "all", name, inside)
    for (form, lead), own in grouped([row for row in rows if row["form"].startswith("zhu2015")], "form", "lead"):
        with_class = [row | {"true": zhu_category(row["visibility"]).value} for row in own]
        for (category,), inside in grouped(sorted(with_class, key=lambda row: row["visibility"]), "true"):
            yield record("class", form, lead, "all", category, inside)
    low, high = MIDDLE
    middle = [row for row in rows if low <= row["visibility"] < high]
    for name, value in CONDITIONS.items():
        named = [row | {"condition": value(row)} for row in middle]
        for (form, lead, condition), own in grouped(named, "form", "lead", "condition"):
            yield record("condition", form, lead, f"{name} {condition}", f"{low:g}-{high:g}", own)


def camera_name(row: Row) -> str:
    """Size and field of view."""
    width, height, view, *_ = CAMERAS[row["camera"]]
    return f"{width}×{height}, {view:g}°"


CONDITIONS: dict[str, Callable[[Row], str]] = {
    "camera": camera_name,
    "airlight": lambda row: f"{row['levels']:g}",
    "marks": lambda row: "painted" if row["marks"] else "missing",
}


def crossed(own: list[Row], across: str, cell: Callable[[Row], str]) -> str:
    """Table with a line for each method and lead, and a column for each value of one key."""
    counts = {one[across]: one["frames"] for one in own}
    rows = []
    for (form, lead), cells in grouped(own, "method", "lead"):
        known = {one[across]: cell(one) for one in cells}
        rows.append((form, lead, *(known.get(name, "–") for name in counts)))
    return "\n".join(lines_of(("method", "lead", *(f"{name} (n = {n})" for name, n in counts.items())), rows))


def cell_of(*keys: str) -> Callable[[Row], str]:
    """What is written of a record: its values, the unknown as a dash."""
    return lambda one: " / ".join("–" if one[key] is None else str(one[key]) for key in keys)


def timing(own: list[Row]) -> str:
    """Fastest estimate of each method [ms]."""
    fastest = {
        form: min((one["ms"] for one in ones if one["ms"] is not None), default=None)
        for (form,), ones in grouped(own, "method")
    }
    told = "; ".join(f"{form} {ms}" for form, ms in fastest.items() if ms is not None)
    return f"Fastest estimate at {TIMED[0]}×{TIMED[1]} on one core [ms]: {told or 'not measured'}."


def tables(all_records: list[Row]) -> str:
    """Records as the tables of the docs."""
    own = {name: [one for one in all_records if one["table"] == name] for name in ("visibility", "class", "condition")}
    errors, sureness = cell_of("median_pct", "p95_pct"), cell_of("valid_share", "coverage")
    low, high = MIDDLE
    parts = (
        "Error of V_met, median / 95th percentile [%], by V_met [m]; n frames; only valid ones count:",
        crossed([one for one in own["visibility"] if one["visibility"] != "inf"], "visibility", errors),
        "Valid share / coverage of the 90 % intervals:",
        crossed(own["visibility"], "visibility", sureness),
        f"Error [%] for {low:g} … {high:g} m by camera, exposure and lane marks:",
        crossed(own["condition"], "condition", errors),
        "zhu2015's classes of one frame: right share of the valid / of those more than 5 % off an edge / valid share:",
        crossed(own["class"], "visibility", cell_of("class_share", "class_off_edge_share", "valid_share")),
        timing(own["visibility"]),
    )
    return "\n\n".join(parts)
