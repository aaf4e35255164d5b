"""How `joint_road` and `lead_contrast` read fog whose airlight is that of photons, and even fog next to it.

Drives of `fogsim reproduce airlight` along a road alone, and behind a vehicle that drives away; V_met 50 to 300 m,
cameras 1.3 and 2.5 m above the road, land of albedos 0.05 to 0.8, droplets of three kinds. Errors are |V_est − V| / V
of valid estimates [%]; `held` is the share of 90 % intervals that hold the truth, `told` that of estimates that are
valid.

Constants were chosen on pool 0, whose drives are others; pool 1 is what is reported.
"""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np
from harness import Row, lines_of, mean, median, parse_options, progress, publish, quantile

from fogsim.atmosphere import Droplets
from fogsim.calibration.staged_road import road_renderer
from fogsim.reproduce.airlight import CHASE_METHODS
from fogsim.reproduce.airlight.evaluation import EVEN_AIRLIGHT, Case, drive_alone, follow
from fogsim.reproduce.road_sweeps import CAMERA
from fogsim.values import Estimate

ALBEDOS = (0.05, 0.1, 0.2, 0.4, 0.8)
ALL_ALBEDOS = f"{ALBEDOS[0]:g} … {ALBEDOS[-1]:g}"
VISIBILITIES = (50.0, 100.0, 150.0, 200.0, 300.0)
HEIGHTS = (1.3, 2.5)
ALONE = (EVEN_AIRLIGHT, "joint_road")
METHODS = (*ALONE, *CHASE_METHODS)
KINDS = ("moderate_radiation", "heavy_radiation", "heavy_advection")
Found = dict[tuple[Case, str], list[Estimate]]


def cases(droplets: tuple[str, ...]) -> Iterator[Case]:
    """Every fog."""
    for visibility in VISIBILITIES:
        yield Case(None, visibility)
        for kind in droplets:
            for albedo in ALBEDOS:
                yield Case(albedo, visibility, Droplets(kind))


def measure(pool: int, drives: int, droplets: tuple[str, ...]) -> Found:
    """Estimates of every fog and method."""
    found: Found = {}
    todo = [
        (height, kind, 1000 * (pool + 1) + n)
        for height in HEIGHTS
        for kind in (partial(drive_alone, methods=ALONE), follow)
        for n in range(drives)
    ]
    fogs = tuple(cases(droplets))
    with road_renderer() as renderer:
        for height, kind, number in progress(todo, "drives"):
            for case, method, estimate in kind(renderer, replace(CAMERA, mount_height=height), fogs, number):
                found.setdefault((case, method), []).append(estimate)
    return found


def records(found: Found) -> list[Row]:
    """A record for each method, fog and albedo, over all visibilities."""
    groups: dict[tuple[str, str, str | None], list[tuple[Estimate, float]]] = {}
    for (case, method), estimates in found.items():
        fog = "koschmieder" if case.albedo is None else f"photons, {case.droplets.replace('_', ' ')}"
        told = [(one, case.visibility) for one in estimates]
        groups.setdefault((method, fog, None if case.albedo is None else f"{case.albedo:g}"), []).extend(told)
        if case.albedo is not None:
            groups.setdefault((method, fog, ALL_ALBEDOS), []).extend(told)
    # Over all albedos after each by itself.
    return [record(*key, groups[key]) for key in sorted(groups, key=lambda key: key[2] == ALL_ALBEDOS)]


def record(method: str, fog: str, albedo: str | None, estimates: list[tuple[Estimate, float]]) -> Row:
    """Errors and intervals of a group."""
    told = [(one, truth) for one, truth in estimates if one.valid and one.extinction > 0.0]
    off = 100.0 * np.array([one.visibility / truth - 1.0 for one, truth in told])
    held = [one.visibility_interval[0] <= truth <= one.visibility_interval[1] for one, truth in told]
    return {
        "method": method,
        "fog": fog,
        "ground_albedo": albedo,
        "n": len(estimates),
        "told": round(len(told) / len(estimates), 2),
        "bias_pct": median(off, 1),
        "median_pct": median(np.abs(off), 1),
        "p95_pct": quantile(np.abs(off), 0.95, 1),
        "held": mean(held, 2),
    }


def docs_table(rows: list[Row]) -> list[str]:
    """Lines of the table of docs/explanation/airlight.md."""
    fogs = sorted(dict.fromkeys((row["fog"], row["ground_albedo"]) for row in rows), key=lambda fog: fog[0])
    table = []
    for fog, albedo in fogs:
        told = {row["method"]: row for row in rows if (row["fog"], row["ground_albedo"]) == (fog, albedo)}
        cells = [told[method] for method in METHODS]
        texts = (f"{c['median_pct']}/{c['p95_pct']} ({c['held']}; {c['told']})" if c["told"] else "—" for c in cells)
        table.append((fog, albedo or "", *texts))
    return lines_of(("fog", "albedo", *METHODS), table)


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        docs=("explanation/airlight.md", "mended"),
        pool=1,
        drives=(4, "of each camera and kind"),
        droplets=(list(KINDS), "which", [str(kind) for kind in Droplets]),
    )
    rows = records(measure(given.pool, given.drives, tuple(given.droplets)))
    publish(given, rows, docs=docs_table)


if __name__ == "__main__":
    main()
