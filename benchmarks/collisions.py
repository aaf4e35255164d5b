"""What fog and advice do to safety: collisions of the motorway's traffic around its standing lead vehicle.

Traffic alone, without a camera: for each visibility, policy and seed, the motorway in homogeneous fog for 160 s, in
which the lead stands in the middle lane for a while. Policies: ``none`` (drivers are left alone, with the speed choice
given), ``oracle`` (every driver is advised the speed from which one can stop within the true visibility, and complies).

    python benchmarks/collisions.py [--json] [--seeds 20] [--visibility 60 --visibility 1000]
                                    [--speed-choice unaffected]

Intervals are 95 % bootstrap intervals of the mean over seeds.
"""

import argparse
import json
from typing import Any

import numpy as np

import fogsim
from fogsim.atmosphere import FieldAccess
from fogsim.scenario import build
from fogsim.traffic import libsumo_traffic
from fogsim.traffic.drivers import within_sight
from fogsim.values import Collision, Command, SpeedAdvice

SECONDS = 160


def one_run(visibility: float, oracle: bool, speed_choice: str, seed: int) -> list[Collision]:
    """Collisions of one run."""
    scenario = fogsim.load_scenario(
        "motorway_fog_bank",
        [
            f"fog.visibility_m={visibility}",
            f"drivers.speed_choice={speed_choice}",
            "traffic.events.0.hold_s=90",
            "traffic.reading_radius_m=100000",
        ],
    )
    traffic = libsumo_traffic(build.traffic_setup(scenario))
    # Homogeneous fog lies everywhere: the route that banks are laid along does not matter.
    traffic.enter_fog(FieldAccess(build.fog_field(scenario, np.zeros((2, 3)))))
    advised = within_sight(visibility)
    collisions: list[Collision] = []
    try:
        traffic.start(seed)
        steps = round(SECONDS / scenario.clocks.traffic_step_s)
        command = Command()
        for index in range(steps):
            if index % 10 == 0:
                snapshot = traffic.observe()
                if snapshot is None:
                    break
                collisions += snapshot.collisions
                if oracle:
                    command = Command(SpeedAdvice(advised), advised_speeds=dict.fromkeys(snapshot.state.ids, advised))
            traffic.advance(command)
    finally:
        traffic.close()
    return collisions


def measure(visibility: float, oracle: bool, speed_choice: str, seeds: int) -> dict[str, Any]:
    """One record over all seeds."""
    runs = [one_run(visibility, oracle, speed_choice, seed) for seed in range(seeds)]
    counts = np.array([len(run) for run in runs])
    rng = np.random.default_rng(0)
    means = rng.choice(counts, (10_000, seeds)).mean(axis=1)
    impacts = [c.impact_speed for run in runs for c in run]
    return {
        "visibility": visibility,
        "policy": "oracle" if oracle else "none",
        "speed_choice": speed_choice,
        "seeds": seeds,
        "collisions_mean": round(float(counts.mean()), 3),
        "collisions_low": round(float(np.percentile(means, 2.5)), 3),
        "collisions_high": round(float(np.percentile(means, 97.5)), 3),
        "runs_with_collision": int((counts > 0).sum()),
        "impact_speed_mean": round(float(np.mean(impacts)), 2) if impacts else None,
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a list of flat records")
    parser.add_argument("--seeds", type=int, default=20, help="seeds for each visibility and policy")
    parser.add_argument("--visibility", type=float, action="append", help="visibility [m] (default 60 and 1000)")
    parser.add_argument("--speed-choice", default="unaffected", help="how fast drivers drive in fog by themselves")
    arguments = parser.parse_args()
    records = [
        measure(visibility, oracle, arguments.speed_choice, arguments.seeds)
        for visibility in arguments.visibility or [60.0, 1000.0]
        for oracle in (False, True)
    ]
    if arguments.json:
        print(json.dumps(records, indent=2))
        return
    print("  ".join(f"{key:>19}" for key in records[0]))
    for record in records:
        print("  ".join(f"{'-' if value is None else value!s:>19}" for value in record.values()))


if __name__ == "__main__":
    main()
