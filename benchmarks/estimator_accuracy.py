"""Accuracy of the estimators on the closed loop's own frames, by visibility, and the time of one estimate.

Frames come from the motorway scenario in homogeneous fog, in running traffic, with the told pitch wrong by a fixed
error. Errors are |V_est − V| / V of single frames that the estimator calls valid.

    python benchmarks/estimator_accuracy.py [--json] [--size 640x480] [--pitch-error 0.0] [--seconds 20] [--seeds 2]
"""

import argparse
import json
import math
import time
from typing import Any

import numpy as np

import fogsim
from fogsim.estimators import ESTIMATORS, make
from fogsim.values import Observation

VISIBILITIES = (30, 50, 100, 200, 300, 400, 800, math.inf)


def observations(visibility: float, size: str, seconds: float, seed: int) -> list[Observation]:
    """What the ego sees in fog of one visibility, twice a second."""
    width, height = size.split("x")
    overrides = [
        f"fog.visibility_m={visibility}",
        f"camera.width={width}",
        f"camera.height={height}",
        f"duration_s={seconds}",
        "clocks.camera_period_s=0.5",
    ]
    scenario = fogsim.load_scenario("motorway_fog_bank", overrides)
    return [step.observation for step in fogsim.run(scenario, seed)]


def measure(method: str, visibility: float, seen: list[Observation], pitch_error: float) -> dict[str, Any]:
    """One record."""
    true = seen[0].frame.camera
    told = fogsim.Camera(
        true.width,
        true.height,
        true.focal_length,
        true.principal_point,
        true.mount_height,
        true.pitch + math.radians(pitch_error),
        true.roll,
        true.response,
    )
    estimator = make(method, told)
    estimates, spent = [], []
    for observation in seen:
        started = time.perf_counter()
        estimates.append(estimator.update(observation))
        spent.append(time.perf_counter() - started)
    valid = [e for e in estimates if e.valid]
    record: dict[str, Any] = {
        "method": method,
        "visibility": None if math.isinf(visibility) else visibility,
        "camera": f"{true.width}x{true.height}",
        "pitch_error_deg": pitch_error,
        "frames": len(seen),
        "valid_share": round(len(valid) / len(seen), 3),
        "no_fog_share": round(sum(e.extinction == 0 for e in valid) / len(seen), 3),
        "median_pct": None,
        "p95_pct": None,
        "ms": round(1e3 * float(np.median(spent)), 2),
    }
    errors = [100 * abs(e.visibility - visibility) / visibility for e in valid if e.extinction > 0]
    if errors and math.isfinite(visibility):
        record["median_pct"], record["p95_pct"] = (round(float(np.percentile(errors, q)), 2) for q in (50, 95))
    return record


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a list of flat records")
    parser.add_argument("--size", default="640x480", help="camera WIDTHxHEIGHT")
    parser.add_argument("--pitch-error", type=float, default=0.0, help="error of the told pitch [deg]")
    parser.add_argument("--seconds", type=float, default=20.0, help="simulated time for each visibility and seed")
    parser.add_argument("--seeds", type=int, default=2, help="seeds for each visibility")
    arguments = parser.parse_args()
    records = []
    for visibility in VISIBILITIES:
        seen = [
            o
            for seed in range(arguments.seeds)
            for o in observations(visibility, arguments.size, arguments.seconds, seed)
        ]
        records += [measure(method, visibility, seen, arguments.pitch_error) for method in ESTIMATORS]
    if arguments.json:
        print(json.dumps(records, indent=2))
        return
    print("  ".join(f"{key:>15}" for key in records[0]))
    for record in records:
        print("  ".join(f"{'-' if value is None else value!s:>15}" for value in record.values()))


if __name__ == "__main__":
    main()
