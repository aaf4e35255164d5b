"""Time of a first run, which compiles its kernels, and of a second one, which finds them on the disk.

Each is a `fogsim run` of one simulated second in a process of its own, the first with an empty folder for what is
compiled. Processor time says more than wall time on a machine that does other work too; both are printed, and how many
kernels the runs kept.

It measures the FogSim of the Python that runs it: away from the checkout, that of an environment with a wheel.
"""

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from harness import Row, median, parse_options, publish

SCENARIOS = ("motorway_fog_bank", "night_motorway_fog")


def main() -> None:
    """Measure and print."""
    given = parse_options(__doc__, repeat=(3, "repetitions"), scenario=(list(SCENARIOS), "which"))
    publish(given, [record for name in given.scenario for record in measured(name, given.repeat)])


def measured(scenario: str, repeat: int) -> list[Row]:
    """Records of first and second runs of a scenario, one of each a repetition."""
    spent: dict[str, list[tuple[float, float]]] = {"first": [], "second": []}
    for _ in range(repeat):
        with tempfile.TemporaryDirectory() as folder:
            for runs in spent.values():
                runs.append(timed_run(scenario, Path(folder)))
            kernels = sum(1 for _ in Path(folder, "kernels").rglob("*.nbc"))
    records = []
    for run, runs in spent.items():
        wall, processor = zip(*runs, strict=True)
        times = {"wall_s": median(wall, 1), "slowest_s": round(max(wall), 1), "processor_s": median(processor, 1)}
        records.append({"scenario": scenario, "run": run, **times, "kernels": kernels})
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
