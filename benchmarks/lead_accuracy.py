"""Accuracy of the estimators that follow the vehicle ahead, over visibilities, exposures, cameras and vehicles.

On a straight road a vehicle drives away from 25 to 90 m; frames are taken every 2.5 m. Each range is drawn once for a
camera and a vehicle, with the own vehicle's pitch swaying and the vehicle ahead weaving a little, then fogged with each
visibility and exposed such that the airlight has 120, 200 or 255 levels. The estimators get the camera without the
sway and with a pitch that is off by an error of the whole sequence, the camera's place behind the bumper, and the
radar's noisy range. An error is |V_est − V| / V after the last
frame, of estimates that are valid and see fog; `bias_pct` is the median of (V_est − V) / V, `coverage` the share of
90 % intervals of k that hold the truth, `ms` the fastest mean time of a frame. `airlight`, `camera` and `vehicle` are
"all" in the first records, then each in turn is distinguished over visibilities from 50 to 300 m.
"""

import argparse
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from harness import Row, columns, mean, median, parse_options, publish, quantile, timed

from fogsim.calibration.staged_road import StagedVehicle, road_renderer
from fogsim.estimators import make
from fogsim.render import Renderer
from fogsim.reproduce.huang2015_chase import FASTER, OWN_SPEED, drawn, fogged
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, Estimate, Frame, LeadMeasurement, Observation, Response
from fogsim.values.estimate import NORMAL_90_PERCENT

CAMERAS = {
    "688 px, 52°": Camera(688, 515, 700.0, (343.5, 257.0), 1.3, math.radians(1.0)),
    "640 px, 58°": Camera(640, 480, 577.0, (319.5, 239.5), 1.38, math.radians(2.0), response=Response.SRGB),
    "1280 px, 40°": Camera(1280, 720, 1760.0, (639.5, 359.5), 1.6, math.radians(2.0), response=Response.SRGB),
    "1024 px, 54°": Camera(1024, 640, 1000.0, (500.0, 330.0), 1.5, math.radians(1.5), response=Response.GAMMA),
}
VEHICLES = {
    "red hatchback": StagedVehicle("car", 4.05, 1.78, 1.47, (0.45, 0.05, 0.04)),
    "black saloon": StagedVehicle("car", 4.75, 1.80, 1.44, (0.05, 0.05, 0.06)),
    "white SUV": StagedVehicle("car", 4.60, 1.90, 1.70, (0.70, 0.70, 0.70)),
    "white van": StagedVehicle("van", 5.90, 2.00, 2.40, (0.75, 0.75, 0.75)),
    "blue lorry": StagedVehicle("truck", 16.5, 2.55, 4.00, (0.10, 0.20, 0.50)),
}
OTHERS = {
    "grey estate": StagedVehicle("car", 4.80, 1.83, 1.50, (0.30, 0.30, 0.31), name="followed 3"),
    "small yellow car": StagedVehicle("car", 3.60, 1.64, 1.50, (0.60, 0.45, 0.05)),
    "dark van": StagedVehicle("van", 5.30, 1.95, 2.00, (0.06, 0.06, 0.08)),
    "red lorry": StagedVehicle("truck", 12.0, 2.50, 3.60, (0.40, 0.05, 0.05)),
}
"""Others than those of the tables, of other shapes and paints; the id of the first makes an estate of it."""
VISIBILITIES = (30.0, 50.0, 100.0, 200.0, 300.0, 500.0, 800.0)
AIRLIGHT_LEVELS = (120.0, 200.0, 255.0)
METHODS: dict[str, tuple[str, dict[str, Any]]] = {
    "huang2015_lead, published": ("huang2015_lead", {"as_published": True}),
    "huang2015_lead": ("huang2015_lead", {}),
    "huang2015_lead, camera's ranges": ("huang2015_lead", {"range_from": "camera"}),
    "huang2015, published": ("huang2015", {"as_published": True}),
    "huang2015": ("huang2015", {}),
    "lead_contrast": ("lead_contrast", {}),
}
NEAREST, FARTHEST = 25.0, 90.0
SETBACK = 1.7
"""From the own bumper, where ranges begin, back to the camera [m]."""

MIDDLING = (50.0, 300.0)


@dataclass(frozen=True, slots=True)
class Fog:
    """One fog and exposure, and the estimators that see it."""

    visibility: float
    levels: float
    estimators: dict[str, Any]
    latest: dict[str, Estimate]
    spent: dict[str, float]


def fogs(arguments: argparse.Namespace, camera: Camera, first: int) -> list[Fog]:
    """Every visibility, at exposures that change from one to the next."""
    found = []
    for i, visibility in enumerate(VISIBILITIES):
        estimators = {}
        for name in arguments.methods:
            method, options = METHODS[name]
            estimators[name] = make(method, camera, setback=SETBACK, **options)
        levels = AIRLIGHT_LEVELS[(first + i) % len(AIRLIGHT_LEVELS)]
        found.append(Fog(visibility, levels, estimators, {}, dict.fromkeys(estimators, 0.0)))
    return found


def follow(
    arguments: argparse.Namespace,
    renderer: Renderer,
    camera: Camera,
    vehicle: StagedVehicle,
    seen: list[Fog],
    seed: int,
) -> int:
    """Let a vehicle drive away in every fog; the number of frames."""
    rng = np.random.default_rng(seed)
    ranges = np.arange(NEAREST, FARTHEST + 1e-9, arguments.step)
    left, begin = rng.normal(0.0, 0.3), rng.uniform(0.0, 100.0)
    misaligned = arguments.pitch_deviation * rng.normal()
    for ahead in ranges:
        now = (ahead - NEAREST) / FASTER
        sway = math.radians(misaligned + arguments.sway * rng.normal())
        weaving = replace(vehicle, left=left + 0.05 * rng.normal())
        scene = drawn(
            renderer, replace(camera, pitch=camera.pitch + sway), weaving, float(ahead), begin + now * OWN_SPEED
        )
        gap = float(ahead) - SETBACK + arguments.range_noise * float(rng.normal())
        for fog in seen:
            frame = Frame(now, fogged(scene, fog.visibility, fog.levels, rng), camera)
            look(fog, Observation(frame, OWN_SPEED, LeadMeasurement(gap, FASTER + 0.1 * float(rng.normal()))))
    return len(ranges)


def look(fog: Fog, seen: Observation) -> None:
    """Show a frame to every estimator."""
    for name, estimator in fog.estimators.items():
        fog.latest[name], spent = timed(partial(estimator.update, seen))
        fog.spent[name] += spent


def sequences(arguments: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """What every method found at the end of every sequence."""
    with road_renderer() as renderer:
        for i, (camera_name, camera) in enumerate(list(CAMERAS.items())[: arguments.cameras]):
            vehicles = OTHERS if arguments.others else VEHICLES
            for j, (vehicle_name, vehicle) in enumerate(list(vehicles.items())[: arguments.vehicles]):
                seed = arguments.seed + 100 * i + j
                seen = fogs(arguments, camera, i + j)
                frames = follow(arguments, renderer, camera, vehicle, seen, seed)
                for fog in seen:
                    for name, estimate in fog.latest.items():
                        told = {"camera": camera_name, "vehicle": vehicle_name, "airlight": f"{fog.levels:g}"}
                        yield {"method": name, **told, **outcome(fog, estimate, fog.spent[name] / frames)}


def outcome(fog: Fog, estimate: Estimate, spent: float) -> Row:
    """One sequence's error."""
    truth = extinction_from_visibility(fog.visibility)
    sees = estimate.valid and estimate.extinction > 0
    return {
        "visibility": fog.visibility,
        "valid": estimate.valid,
        "error": 100.0 * (estimate.visibility / fog.visibility - 1.0) if sees else None,
        "covered": abs(estimate.extinction - truth) <= NORMAL_90_PERCENT * estimate.standard_deviation,
        "ms": spent,
    }


def record(rows: list[dict[str, Any]], **told: str) -> dict[str, Any]:
    """Flat record of a group of sequences."""
    errors = [row["error"] for row in rows if row["error"] is not None]
    valid = [row for row in rows if row["valid"]]
    return {
        "method": rows[0]["method"],
        "airlight": "all",
        "camera": "all",
        "vehicle": "all",
        **told,
        "sequences": len(rows),
        "median_pct": median(np.abs(errors), 2),
        "p95_pct": quantile(np.abs(errors), 0.95, 2),
        "bias_pct": median(errors, 2),
        "valid_share": round(len(valid) / len(rows), 3),
        "coverage": mean([row["covered"] for row in valid], 3),
        "ms": round(min(row["ms"] for row in rows), 2),
    }


def measure(arguments: argparse.Namespace) -> list[dict[str, Any]]:
    """All records."""
    rows = list(sequences(arguments))
    records = []
    for name in arguments.methods:
        for visibility in VISIBILITIES:
            group = [r for r in rows if r["method"] == name and r["visibility"] == visibility]
            records.append(record(group, visibility=f"{visibility:g}"))
    low, high = MIDDLING
    for key in ("airlight", "camera", "vehicle"):
        for name in arguments.methods:
            inside = [r for r in rows if r["method"] == name and low <= r["visibility"] <= high]
            for value in dict.fromkeys(r[key] for r in inside):
                group = [r for r in inside if r[key] == value]
                records.append(record(group, visibility=f"{low:g}-{high:g}", **{key: value}))
    return records


def tables(records: list[Row]) -> list[str]:
    """Lines of the docs' tables: one by visibility, and one by what else changes."""
    parts = ("airlight", "camera", "vehicle")
    whole = [{k: v for k, v in r.items() if k not in parts} for r in records if all(r[p] == "all" for p in parts)]
    apart = [r for r in records if any(r[p] != "all" for p in parts) and "published" not in r["method"]]
    return [*columns(whole), "", *columns(apart)]


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        docs=("benchmarks/estimators.md", "lead accuracy"),
        methods=(list(METHODS), "what is measured", METHODS),
        cameras=(3, "how many of the cameras"),
        vehicles=(len(VEHICLES), "how many of the vehicles"),
        others=(False, "four other vehicles, an estate among them"),
        step=(2.5, "change of range between frames [m]"),
        range_noise=(0.25, "deviation of the told range [m]"),
        sway=(0.07, "deviation of the own vehicle's pitch [deg]"),
        pitch_deviation=(0.1, "deviation of the told pitch, constant over a sequence [deg]"),
        seed=(1, "of the sequences"),
    )
    records = measure(given)
    publish(given, records, docs=tables)


if __name__ == "__main__":
    main()
