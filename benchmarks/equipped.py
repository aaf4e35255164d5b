"""What cameras in other vehicles cost: time of a step by how many look, and by processes that draw for them.

The motorway's fog bank with pictures of 320×240; the same seed, so that all runs have the same traffic until advice to
others has an effect. Time of a step over that with the ego's camera alone, fastest of several runs.

    python benchmarks/equipped.py [--json] [--seconds 10] [--runs 3]
"""

import argparse
import json
import time

import fogsim
from fogsim.loop import ClosedLoop
from fogsim.values import Command

SHARES = (0.0, 0.1, 0.2, 0.4)
PROCESSES = (0, 1)


def step_time(share: float, processes: int, seconds: float) -> tuple[float, float]:
    """Mean time of a step [s], and mean number of cameras next to the ego's."""
    settings = [f"duration_s={seconds}", "camera.width=320", "camera.height=240", f"traffic.equipped={share}"]
    scenario = fogsim.load_scenario("motorway_fog_bank", settings)
    with ClosedLoop(scenario, camera_processes=processes) as loop:
        step, looked, took, count = loop.start(1), 0, 0.0, 0
        while step.ending is None:
            begun = time.perf_counter()
            step = loop.advance(Command())
            # The first pictures of a vehicle build its scene.
            if step.time > 1.0:
                took, looked, count = took + time.perf_counter() - begun, looked + len(step.equipped), count + 1
    return took / count, looked / count


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a list of flat records")
    parser.add_argument("--seconds", type=float, default=10.0, help="simulated, of each run")
    parser.add_argument("--runs", type=int, default=3)
    arguments = parser.parse_args()
    rows = []
    for share in SHARES:
        for processes in PROCESSES if share else (0,):
            found = [step_time(share, processes, arguments.seconds) for _ in range(arguments.runs)]
            rows.append(
                {
                    "equipped_share": share,
                    "cameras_beside_the_egos": round(found[0][1], 1),
                    "processes": processes,
                    "step_ms": round(1000.0 * min(took for took, _ in found), 1),
                    "slowest_run_ms": round(1000.0 * max(took for took, _ in found), 1),
                }
            )
            rows[-1]["over_ego_alone"] = round(rows[-1]["step_ms"] / rows[0]["step_ms"], 2)
    if arguments.json:
        print(json.dumps(rows, indent=2))
        return
    for row in rows:
        print("  ".join(f"{key} {value}" for key, value in row.items()))


if __name__ == "__main__":
    main()
