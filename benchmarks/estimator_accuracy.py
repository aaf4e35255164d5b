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

    python benchmarks/estimator_accuracy.py [--json] [--docs] [--methods …] [--cameras 4] [--scenes 12] [--draws 4]
        [--workers 2] [--surface dry] [--repairs 0.05] [--keep FILE]

`--surface` and `--repairs` are the scenario's `pavement`: roads that brighten towards the horizon, and change along it.
`--keep FILE` writes what is measured to a file as it comes; a later call with the same arguments goes on from there.
"""

import argparse
import dataclasses
import math
import os
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import cache
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from estimator_scenes import CAMERAS, Drive, Road, camera, drive, photograph, with_leader, without_leader
from estimator_tables import BINS, TIMED, records, tables
from harness import Kept, Row, parse_options, progress, publish, timed

from fogsim.core.registry import parameters
from fogsim.estimators import ESTIMATORS, make
from fogsim.estimators.zhu2015 import zhu_category
from fogsim.values import Camera, Observation, Pavement, RoadSurface
from fogsim.values.scene import USUAL_PAVEMENT

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
