"""Time of a first run, which compiles its kernels, and of a second one, which finds them on the disk.

Each is a `fogsim run` of one simulated second in a process of its own, the first with an empty folder for what is
compiled. Processor time says more than wall time on a machine that does other work too; both are printed, with the
machine's load when the run began, and how many kernels the first run kept.

It measures the FogSim of the Python that runs it: away from the checkout, that of an environment with a wheel.

    python benchmarks/cold_start.py [--json] [--repeat 3] [--scenario motorway_fog_bank ...]
"""

import json
import os
import platform
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from harness import parse_options

SCENARIOS = ("motorway_fog_bank", "night_motorway_fog")


def main() -> None:
    """Measure, and print a table or JSON."""
    told = parse_options(__doc__, repeat=(3, "repetitions"), scenario=(list(SCENARIOS), "which"))
    records = [record for name in told.scenario for record in measured(name, told.repeat)]
    if told.json:
        print(json.dumps({"machine": machine(), "records": records}, indent=2))
        return
    print(", ".join(f"{name} {value}" for name, value in machine().items()))
    for record in records:
        wall, processor = (" … ".join(f"{t:.1f}" for t in sorted(record[key])) for key in ("wall_s", "processor_s"))
        print(
            f"{record['scenario']}, {record['run']}: {statistics.median(record['wall_s']):.1f} s ({wall}), processor "
            f"{statistics.median(record['processor_s']):.1f} s ({processor}), load {record['load']}, "
            f"{record['kernels']} kernels kept"
        )


def machine() -> dict[str, Any]:
    """What it was measured on."""
    return {"python": platform.python_version(), "processor": platform.processor(), "processors": os.cpu_count()}


def measured(scenario: str, repeat: int) -> list[dict[str, Any]]:
    """Times of first and second runs of a scenario [s], one of each a repetition."""
    records: list[dict[str, Any]] = [
        {"scenario": scenario, "run": run, "wall_s": [], "processor_s": [], "load": []} for run in ("first", "second")
    ]
    for _ in range(repeat):
        with tempfile.TemporaryDirectory() as folder:
            for record in records:
                record["load"].append(round(os.getloadavg()[0], 1))
                wall, processor = timed_run(scenario, Path(folder))
                record["wall_s"].append(round(wall, 2))
                record["processor_s"].append(round(processor, 2))
                record["kernels"] = sum(1 for _ in Path(folder, "kernels").rglob("*.nbc"))
    return records


def timed_run(scenario: str, folder: Path) -> tuple[float, float]:
    """Run one simulated second with kernels in a folder: wall time, and processor time of the process [s]."""
    command = [sys.executable, "-m", "fogsim", "run", scenario, "--set", "duration_s=1", "--no-video", "--overwrite"]
    before, started = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    subprocess.run(
        [*command, "--out", str(folder / "results")],
        # As in the Makefile: modules are compiled by whoever needs them first.
        env={**os.environ, "NUMBA_CACHE_DIR": str(folder / "kernels"), "PYTHONDONTWRITEBYTECODE": ""},
        capture_output=True,
        check=True,
    )
    wall, after = time.monotonic() - started, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


if __name__ == "__main__":
    main()
