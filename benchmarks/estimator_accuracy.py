"""Accuracy of the daytime estimators over cameras, exposures and visibilities, and the time of one estimate.

Scenes come from the motorway scenario in running traffic, once a camera; each is then fogged with visibilities drawn
evenly in ln V from 25 to 1500 m (and clear air), exposed such that the airlight has 120, 200 or 255 levels, and handed
to the estimators with a told pitch that is off by a normal error they are not told. "lead" frames have the tracked
vehicle's range, "no lead" frames do not (the vehicles are there all the same). Errors are |V_est − V| / V of estimates
that are valid and see fog; `coverage` is the share of 90 % intervals of k that hold the truth.

    python benchmarks/estimator_accuracy.py [--json] [--docs] [--methods …] [--cameras 4] [--scenes 6] [--draws 2]
"""

import argparse
import dataclasses
import json
import math
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

import fogsim
from fogsim.atmosphere import Air
from fogsim.camera import Sensor, expose
from fogsim.estimators import make
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, Observation, Step
from fogsim.values.estimate import NORMAL_90_PERCENT

CAMERAS = (
    (640, 480, 58.0, 1.38, 2.0),
    (688, 515, 45.0, 1.3, 1.0),
    (1280, 720, 40.0, 1.6, 3.0),
    (512, 383, 70.0, 2.0, 4.0),
)
"""Width, height [px], horizontal field of view [deg], mount height [m] and pitch [deg]."""

AIRLIGHT_LEVELS = (120.0, 200.0, 255.0)
BINS = (25.0, 50.0, 100.0, 200.0, 400.0, 800.0, 1500.0)
METHODS = ("negru2013", "joint_road")
DOCS = Path(__file__).resolve().parent.parent / "docs" / "estimators.md"
MARK, END = "<!-- table: accuracy -->", "<!-- end of table -->"


def scenes(size: tuple[int, int, float, float, float], count: int, seed: int) -> list[Step]:
    """Instants of a drive in traffic, seen by one camera."""
    width, height, view, mount, pitch = size
    overrides = [
        "fog.visibility_m=200",
        f"duration_s={4 * count}",
        "clocks.camera_period_s=0.5",
        f"camera.width={width}",
        f"camera.height={height}",
        f"camera.field_of_view_deg={view}",
        f"camera.mount_height_m={mount}",
        f"camera.pitch_deg={pitch}",
    ]
    steps = fogsim.run(fogsim.load_scenario("motorway_fog_bank", overrides), seed)
    return [step for i, step in enumerate(steps) if i % 8 == 0][:count]


def fogged(step: Step, visibility: float, levels: float, rng: np.random.Generator) -> np.ndarray:
    """The scene of a step in another fog and at another exposure."""
    extinction = extinction_from_visibility(visibility)
    field = dataclasses.replace(step.truth.fog, extinction=extinction, banks=())
    radiance = Air(field).radiance(step.view, step.truth.camera, step.truth.pose)
    saturation = float(np.dot((0.2126, 0.7152, 0.0722), field.airlight)) * 255.0 / levels
    return expose(radiance, Sensor(saturation), step.truth.camera.response, rng)


def mispitched(camera: Camera, rng: np.random.Generator, deviation: float) -> Camera:
    """The calibration as it is told: the pitch is off."""
    return dataclasses.replace(camera, pitch=camera.pitch + math.radians(rng.normal(0.0, deviation)))


def observations(arguments: argparse.Namespace) -> Iterator[tuple[float, Camera, Observation]]:
    """Visibility, told camera and what the vehicle has, over cameras, scenes, exposures and fogs."""
    rng = np.random.default_rng(arguments.seed)
    for size in CAMERAS[: arguments.cameras]:
        for step in scenes(size, arguments.scenes, arguments.seed):
            drawn = np.exp(rng.uniform(math.log(BINS[0]), math.log(BINS[-1]), len(BINS) * arguments.draws))
            for visibility in [*drawn, math.inf]:
                image = fogged(step, float(visibility), float(rng.choice(AIRLIGHT_LEVELS)), rng)
                told = mispitched(step.truth.camera, rng, arguments.pitch_deviation)
                yield float(visibility), told, dataclasses.replace(step.observation, frame=image)


def look(method: str, visibility: float, told: Camera, seen: Observation) -> dict[str, Any]:
    """One estimate with its error."""
    estimator = make(method, told)
    # The first call makes room and compiles.
    estimator.update(seen)
    estimator.reset()
    started = time.perf_counter()
    found = estimator.update(seen)
    spent = time.perf_counter() - started
    truth = extinction_from_visibility(visibility)
    fog = found.valid and found.extinction > 0 and truth > 0
    return {
        "visibility": visibility,
        "valid": found.valid,
        "error": abs(found.visibility / visibility - 1.0) if fog else None,
        "covered": abs(found.extinction - truth) <= NORMAL_90_PERCENT * found.standard_deviation,
        "clear": found.valid and found.visibility >= 1000.0,
        "ms": 1e3 * spent,
    }


def record(method: str, lead: str, low: float, high: float, rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Flat record of one bin of visibilities; of clear air, `median_pct` is none and `clear_share` tells."""
    valid = [row for row in rows if row["valid"]]
    errors = [100 * row["error"] for row in valid if row["error"] is not None]
    return {
        "method": method,
        "lead": lead,
        "visibility": f"{low:g}-{high:g}" if math.isfinite(high) else "inf",
        "frames": len(rows),
        "median_pct": round(float(np.median(errors)), 2) if errors else None,
        "p95_pct": round(float(np.percentile(errors, 95)), 2) if errors else None,
        "valid_share": round(len(valid) / len(rows), 3),
        "coverage": round(float(np.mean([row["covered"] for row in valid])), 3) if valid else None,
        "clear_share": round(float(np.mean([row["clear"] for row in rows])), 3),
        "ms": round(min(row["ms"] for row in rows), 2),
    }


def measure(arguments: argparse.Namespace) -> list[dict[str, Any]]:
    """All records."""
    rows: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for visibility, told, seen in observations(arguments):
        for method in arguments.methods:
            for lead, given in (("told", seen), ("untold", dataclasses.replace(seen, lead=None))):
                rows.setdefault((method, lead), []).append(look(method, visibility, told, given))
    records = []
    for (method, lead), all_rows in rows.items():
        for low, high in [*pairwise(BINS), (math.inf, math.inf)]:
            inside = [r for r in all_rows if low <= r["visibility"] < high or r["visibility"] == low]
            if inside:
                records.append(record(method, lead, low, high, inside))
    return records


def table(records: list[dict[str, Any]]) -> str:
    """Records as a table of the docs."""
    lines = ["| " + " | ".join(records[0]) + " |", "|" + "---|" * len(records[0])]
    lines += ["| " + " | ".join("–" if v is None else str(v) for v in r.values()) + " |" for r in records]
    return "\n".join(lines)


def write_docs(records: list[dict[str, Any]]) -> None:
    """Put the table into the docs."""
    text = DOCS.read_text(encoding="utf-8")
    before, rest = text.split(MARK, 1)
    after = rest.split(END, 1)[1]
    DOCS.write_text(f"{before}{MARK}\n\n{table(records)}\n\n{END}{after}", encoding="utf-8")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a list of flat records")
    parser.add_argument("--docs", action="store_true", help="write the table of docs/estimators.md")
    parser.add_argument("--methods", nargs="+", default=list(METHODS), help="estimators of single frames")
    parser.add_argument("--pitch-deviation", type=float, default=0.1, help="deviation of the told pitch [deg]")
    parser.add_argument("--cameras", type=int, default=len(CAMERAS), help="how many of the cameras")
    parser.add_argument("--scenes", type=int, default=6, help="scenes for each camera")
    parser.add_argument("--draws", type=int, default=2, help="visibilities for each bin and scene, on average")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    records = measure(arguments)
    if arguments.docs:
        write_docs(records)
    print(json.dumps(records, indent=2) if arguments.json else table(records))


if __name__ == "__main__":
    main()
