"""What a wrong calibration does to the visibility: the same pictures read with the true camera and with a wrong one.

Instants of the motorway scenario are drawn with an empty own lane under four cameras, with lane marks and without, and
fogged with one visibility (see `estimator_scenes.py`). Each is read twice by a fresh estimator: as it is, and with the
camera's pitch stated 0.1° too high or too low, its focal length stated 10 % too long, or its mount 10 % too high.
``median_pct`` is the median of the change of V_met, ``median_size_pct`` and ``p95_size_pct`` the median and the 95th
percentile of its size [%]; ``valid_share`` the share of pictures in which both readings are valid.
"""

import argparse
import dataclasses
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from estimator_accuracy import METHODS, driven, road
from estimator_scenes import CAMERAS, camera, photograph, without_leader
from harness import Row, median, parse_options, publish, quantile

from fogsim.estimators import make
from fogsim.values import Camera, Observation

AIRLIGHT_LEVEL = 200.0
PITCH = math.radians(0.1)
TENTH = 1.1


def wrong(true: Camera) -> Iterator[tuple[str, Camera]]:
    """Cameras with wrong calibrations, by what is wrong with them."""
    for sign in (-1.0, 1.0):
        yield "pitch 0.1°", dataclasses.replace(true, pitch=true.pitch + sign * PITCH)
    yield "focal length +10 %", dataclasses.replace(true, focal_length=TENTH * true.focal_length)
    yield "mount height +10 %", dataclasses.replace(true, mount_height=TENTH * true.mount_height)


def visibility(method: str, told: Camera, seen: Observation) -> float:
    """Visibility from a fresh estimator [m]; nan where it gives none."""
    found = make(method, told).update(seen)
    return found.visibility if found.valid else math.nan


def measure(arguments: argparse.Namespace) -> list[Row]:
    """Change of the visibility in every picture, by every error and method [%]."""
    rng, rows = np.random.default_rng(arguments.seed), []
    drive, roads = driven(arguments.scenes, arguments.seed), road(arguments.scenes, arguments.seed)
    for number in range(arguments.cameras):
        true = camera(number)
        for instant in map(without_leader, drive.instants):
            for marks in (True, False):
                view = roads.view(instant.state, instant.ego, true, marks=marks)
                for truth in arguments.visibilities:
                    seen = Observation(photograph(view, true, drive.fog, truth, AIRLIGHT_LEVEL, rng), 25.0)
                    for method in arguments.methods:
                        right = visibility(method, true, seen)
                        rows += [
                            {"error": name, "method": method, "visibility": truth, "marks": marks}
                            | {"change": 100.0 * (visibility(method, told, seen) / right - 1.0)}
                            for name, told in wrong(true)
                        ]
    return rows


def records(rows: list[Row]) -> Iterator[Row]:
    """Quantiles over the pictures of each error, method, visibility and kind of road."""
    keys = ("error", "method", "visibility", "marks")
    groups: dict[tuple[Any, ...], list[float]] = {}
    for row in rows:
        groups.setdefault(tuple(row[key] for key in keys), []).append(row["change"])
    for group, changes in sorted(groups.items()):
        valid = np.array([change for change in changes if math.isfinite(change)])
        sizes = np.abs(valid)
        yield dict(zip(keys, group, strict=True)) | {
            "valid_share": round(len(valid) / len(changes), 3),
            "median_pct": median(valid, 2),
            "median_size_pct": median(sizes, 2),
            "p95_size_pct": quantile(sizes, 0.95, 2),
        }


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        methods=(list(METHODS), "estimators of single frames"),
        visibilities=([100.0, 400.0], "of the fog [m]"),
        cameras=(len(CAMERAS), "how many of the cameras"),
        scenes=(6, "instants of the drive"),
        seed=(1, "of the drive"),
    )
    publish(given, list(records(measure(given))))


if __name__ == "__main__":
    main()
