"""Accuracy of the daytime estimators of single frames: visibility, class of fog, intervals, and time of one estimate.

Instants of the motorway scenario in running traffic are drawn again under four cameras (three focal lengths and more,
mount heights, resolutions), with lane marks or without, and with a vehicle ahead in the own lane (12 to 80 m, of the
traffic's kinds) or none. Each picture is fogged with a visibility drawn evenly in ln V from 25 to 1500 m, or none, and
exposed such that the airlight has 120, 200 or 255 levels of light. The stated pitch is off by a normal error that
the estimators do not know.

`lead`: `absent`, no vehicle in the own lane; `measured`, one with a measured range is there; `unmeasured`, the same
picture without the range. Errors are |V_est − V| / V of estimates that are valid and see fog. `coverage` is the share
of 90 % intervals of k that hold the truth, of valid ones. `class_share` is the share of the valid ones in the right of
zhu2015's four classes, `class_off_edge_share` that of frames whose visibility is more than 5 % from an edge (100, 300,
1000 m). `ms` is the fastest at 688×515, on one core.

`--surface` and `--repairs` are the scenario's `pavement`: roads that brighten towards the horizon, and change along it.
`--keep FILE` writes what is measured to a file as it comes; a later call with the same arguments goes on from there.
"""

import argparse
import dataclasses
import math
import os
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import cache
from itertools import pairwise
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from estimator_scenes import CAMERAS, Drive, Road, camera, drive, photograph, with_leader, without_leader
from harness import Kept, Row, lines_of, mean, median, parse_options, progress, publish, quantile, timed

from fogsim.core.registry import parameters
from fogsim.estimators import ESTIMATORS, make
from fogsim.estimators.zhu2015 import zhu_category
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, Observation, Pavement, RoadSurface
from fogsim.values.estimate import NORMAL_90_PERCENT
from fogsim.values.scene import USUAL_PAVEMENT

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
    times = "; ".join(f"{form} {ms}" for form, ms in fastest.items() if ms is not None)
    return f"Fastest estimate at {TIMED[0]}×{TIMED[1]} on one core [ms]: {times or 'not measured'}."


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


AIRLIGHT_LEVELS = (120.0, 200.0, 255.0)
METHODS = ("negru2013", "zhu2015", "huang2015_rough", "joint_road")
PUBLISHED = ", as published"

Unit = tuple[int, int]
"""Number of a camera and of an instant: what is measured in one go."""


def look(form: str, told: Camera, seen: Observation) -> Row:
    """One estimate, and the time of it where it counts."""
    method = form.removesuffix(PUBLISHED)
    estimator = make(method, told, **({"as_published": True} if form != method else {}))
    found, spent = estimator.update(seen), None
    if (told.width, told.height) == TIMED:
        # The first call has made room and compiled.
        estimator.reset()
        _, spent = timed(lambda: estimator.update(seen))
    return {
        "form": form,
        "valid": found.valid,
        "extinction": found.extinction,
        "deviation": found.standard_deviation if found.valid else None,
        "class": found.diagnostics.get("class", zhu_category(found.visibility)),
        "ms": spent,
    }


@cache
def driven(scenes: int, seed: int) -> Drive:
    """The drive; each process makes its own, and all are the same."""
    return drive(scenes, seed)


@cache
def road(
    scenes: int, seed: int, surface: str = USUAL_PAVEMENT.surface, repairs: float = USUAL_PAVEMENT.repairs
) -> Road:
    """Its road, ready to be drawn."""
    return Road(driven(scenes, seed).signs, Pavement(RoadSurface(surface), repairs=repairs))


def measure_unit(
    unit: Unit, scenes: int, draws: int, seed: int, forms: tuple[str, ...], pitch: float, surface: str, repairs: float
) -> list[Row]:
    """Every fog, exposure and form of one instant under one camera."""
    number, index = unit
    rng, true = np.random.default_rng([seed, number, index]), camera(number)
    free = without_leader(driven(scenes, seed).instants[index])
    fogs = np.exp(rng.uniform(math.log(BINS[0]), math.log(BINS[-1]), (len(BINS) - 1) * draws))
    rows = []
    for visibility in [*map(float, fogs), *[math.inf] * draws]:
        marks, levels = bool(rng.integers(2)), float(rng.choice(AIRLIGHT_LEVELS))
        stated = dataclasses.replace(true, pitch=true.pitch + math.radians(rng.normal(0.0, pitch)))
        occupied, measured = with_leader(free, rng)
        condition = {"visibility": visibility, "marks": marks, "levels": levels, "camera": number}
        for lead, instant in (("absent", free), ("unmeasured", occupied)):
            view = road(scenes, seed, surface, repairs).view(instant.state, instant.ego, true, marks=marks)
            seen = Observation(photograph(view, true, driven(scenes, seed).fog, visibility, levels, rng), 25.0)
            rows += [condition | {"lead": lead} | look(form, stated, seen) for form in forms]
        seen = dataclasses.replace(seen, lead=measured)
        # The papers' own forms make nothing of a range.
        ranging = [form for form in forms if not form.endswith(PUBLISHED)]
        rows += [condition | {"lead": "measured"} | look(form, stated, seen) for form in ranging]
    return rows


def forms_of(methods: list[str]) -> tuple[str, ...]:
    """Methods, and their published forms where they have one."""
    forms = [
        (name, name + PUBLISHED) if "as_published" in parameters(ESTIMATORS[name]) else (name,) for name in methods
    ]
    return tuple(form for both in forms for form in both)


def measure(given: argparse.Namespace) -> list[Row]:
    """All rows: what is kept already, and the rest."""
    settings = [given.scenes, given.draws, given.seed, forms_of(given.methods), given.pitch_deviation]
    settings += [given.surface, given.repairs]
    kept = Kept(given.keep, settings)
    units = [(number, index) for index in range(given.scenes) for number in range(given.cameras)]
    missing = [unit for unit in units if unit not in kept.results]
    rows = [row for unit in units for row in kept.results.get(unit, [])]
    with ProcessPoolExecutor(given.workers, get_context("spawn")) as pool:
        running = {pool.submit(measure_unit, unit, *settings): unit for unit in missing}
        for done in progress(as_completed(running), "instants × cameras", len(missing)):
            kept.add(running[done], done.result())
            rows += done.result()
    return rows


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        docs=("benchmarks/estimators.md", "accuracy"),
        methods=(list(METHODS), "estimators of single frames"),
        pitch_deviation=(0.1, "deviation of the told pitch [deg]"),
        cameras=(len(CAMERAS), "how many of the cameras"),
        scenes=(12, "instants of the drive"),
        draws=(4, "visibilities by bin, instant and camera, on average"),
        workers=(min(2, os.cpu_count() or 1), "processes"),
        surface=(str(USUAL_PAVEMENT.surface), "of the roads", RoadSurface),
        repairs=(USUAL_PAVEMENT.repairs, "older and newer stretches"),
        keep=(Path, "file in which to keep what is measured, and from which to go on"),
        seed=(1, "of the drive"),
    )
    found = list(records(measure(given)))
    publish(given, found, lambda found: [tables(found)])


if __name__ == "__main__":
    main()
