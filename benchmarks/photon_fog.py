"""How `joint_road` and `lead_contrast` read fog whose airlight is that of photons, and even fog next to it.

Drives of `fogsim reproduce airlight` along a road alone, and behind a vehicle that drives away; V_met 50 to 300 m,
cameras 1.3 and 2.5 m above the road, land of albedos 0.05 to 0.8, droplets of three kinds. Errors are |V_est − V| / V
of valid estimates [%]; `held` is the share of 90 % intervals that hold the truth, `told` that of estimates that are
valid.

Constants were chosen on pool 0, whose drives are others; pool 1 is what is reported.

    python benchmarks/photon_fog.py [--json] [--docs] [--pool 1] [--drives 4] [--droplets moderate_radiation …]
"""

import argparse
import json
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from docs_table import lines_of, write_table
from rich.console import Console
from rich.progress import track

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
METHODS = (EVEN_AIRLIGHT, "joint_road", *CHASE_METHODS)
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
        for kind in (drive_alone, follow)
        for n in range(drives)
    ]
    fogs = tuple(cases(droplets))
    with road_renderer() as renderer:
        for height, kind, number in track(todo, "drives", console=Console(stderr=True)):
            for case, method, estimate in kind(renderer, replace(CAMERA, mount_height=height), fogs, number):
                if method in METHODS:
                    found.setdefault((case, method), []).append(estimate)
    return found


def records(found: Found) -> list[dict[str, Any]]:
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


def record(method: str, fog: str, albedo: str | None, estimates: list[tuple[Estimate, float]]) -> dict[str, Any]:
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
        "bias_pct": round(float(np.median(off)), 1) if told else None,
        "median_pct": round(float(np.median(np.abs(off))), 1) if told else None,
        "p95_pct": round(float(np.percentile(np.abs(off), 95)), 1) if told else None,
        "held": round(float(np.mean(held)), 2) if told else None,
    }


def write_docs(rows: list[dict[str, Any]]) -> None:
    """Put the table into the page."""
    fogs = sorted(dict.fromkeys((row["fog"], row["ground_albedo"]) for row in rows), key=lambda fog: fog[0])
    table = []
    for fog, albedo in fogs:
        told = {row["method"]: row for row in rows if (row["fog"], row["ground_albedo"]) == (fog, albedo)}
        cells = [told[method] for method in METHODS]
        texts = (f"{c['median_pct']}/{c['p95_pct']} ({c['held']}; {c['told']})" if c["told"] else "—" for c in cells)
        table.append((fog, albedo or "", *texts))
    write_table("explanation/airlight.md", "mended", lines_of(("fog", "albedo", *METHODS), table))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a list of flat records")
    parser.add_argument("--docs", action="store_true", help="write the table of docs/explanation/airlight.md")
    parser.add_argument("--pool", type=int, choices=(0, 1), default=1)
    parser.add_argument("--drives", type=int, default=4, help="of each camera and kind")
    parser.add_argument("--droplets", nargs="+", choices=[str(kind) for kind in Droplets], default=list(KINDS))
    arguments = parser.parse_args()
    rows = records(measure(arguments.pool, arguments.drives, tuple(arguments.droplets)))
    if arguments.docs:
        write_docs(rows)
    if arguments.json:
        print(json.dumps(rows, indent=2))
        return
    for row in rows:
        print("  ".join(f"{value!s:>12}" for value in row.values()))


if __name__ == "__main__":
    main()
