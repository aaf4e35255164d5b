"""Time and memory of environment resets: milliseconds each, and growth of the process per reset.

    python benchmarks/resets.py [--json] [--resets 200] [--size 64x48]

The first tenth of the resets is not counted (libraries load, caches fill). Memory is the resident set size.
"""

import argparse
import json
import os
import statistics
import time
from pathlib import Path

import gymnasium

import fogsim_envs  # noqa: F401 - registers the environments


def resident_bytes() -> int:
    """Resident set size of this process [bytes] (Linux)."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a list of flat records")
    parser.add_argument("--resets", type=int, default=200, help="how many resets")
    parser.add_argument("--size", default="64x48", help="camera WIDTHxHEIGHT")
    arguments = parser.parse_args()
    width, height = map(int, arguments.size.split("x"))
    env = gymnasium.make("fogsim/FogAdvisory-v0", image_size=(width, height))
    warm_up = max(1, arguments.resets // 10)
    spent, start_bytes = [], 0
    for index in range(arguments.resets):
        if index == warm_up:
            start_bytes = resident_bytes()
        started = time.perf_counter()
        env.reset(seed=index)
        spent.append(1e3 * (time.perf_counter() - started))
        env.step(env.action_space.sample())
    growth = (resident_bytes() - start_bytes) / (arguments.resets - warm_up)
    env.close()
    record = {
        "env": "fogsim/FogAdvisory-v0",
        "resets": arguments.resets,
        "ms_median": round(statistics.median(spent[warm_up:]), 1),
        "ms_max": round(max(spent[warm_up:]), 1),
        "growth_kib_per_reset": round(growth / 1024, 2),
    }
    print(json.dumps([record], indent=2) if arguments.json else "\n".join(f"{k:22} {v}" for k, v in record.items()))


if __name__ == "__main__":
    main()
