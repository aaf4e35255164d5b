"""What the pictures of the sign map cost next to the loop's steps, in one run: a scenario with a sign every 100 m.

python benchmarks/sign_map.py [--json] [--size 320x240 --size 640x480] [--steps 60]
"""

import argparse
import json
import statistics
import time
from typing import Any

import fogsim
from fogsim.values import Command

SCENARIO = "sign_missing_and_moved"


def measure(size: str, steps: int) -> dict[str, Any]:
    """One record for a size of the camera."""
    width, height = map(int, size.split("x"))
    settings = [f"camera.width={width}", f"camera.height={height}", "sensors.faults=[]", "expect={}"]
    step_times, map_times, signs = [], [], []
    with fogsim.ClosedLoop(fogsim.load_scenario(SCENARIO, settings)) as loop:
        step = loop.start(1)
        command = Command()
        for _ in range(steps):
            began = time.perf_counter()
            step = loop.advance(command)
            between = time.perf_counter()
            painted = step.observation.sign_map, step.observation.sign_map_from_above
            map_times.append(time.perf_counter() - between)
            step_times.append(between - began)
            signs.append(len(step.observation.signs) if painted[0].any() else 0)
    return {
        "scenario": SCENARIO,
        "camera": size,
        "signs": statistics.median(signs),
        "step_ms": round(1e3 * statistics.median(step_times), 2),
        "sign_map_ms": round(1e3 * statistics.median(map_times), 3),
        "share_percent": round(100.0 * statistics.median(a / b for a, b in zip(map_times, step_times, strict=True)), 2),
    }


def main() -> None:
    """Print a record, or a line, for each size."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="a list of records")
    parser.add_argument("--size", action="append", help="WIDTHxHEIGHT of the camera; may be repeated")
    parser.add_argument("--steps", type=int, default=60)
    arguments = parser.parse_args()
    records = [measure(size, arguments.steps) for size in arguments.size or ("320x240", "640x480")]
    if arguments.json:
        print(json.dumps(records))
        return
    for record in records:
        print(
            f"{record['camera']}: {record['signs']:.0f} signs, {record['sign_map_ms']:.3f} ms beside "
            f"{record['step_ms']:.1f} ms a step, {record['share_percent']:.2f} %"
        )


if __name__ == "__main__":
    main()
