"""Throughput of `fogsim study` with one and with two processes, and a soak: processes killed, the table still the same.

Throughput: runs a minute of the motorway's fog bank (30 s at 2 Hz and 160×120, with a camera) by turns with one
process and with two, in one sitting; the processes are started before. The soak kills (SIGKILL) the study, or one of
the processes that it has started, at moments drawn evenly, starts the same command again until all is done, and
compares the table with that of a study which no one disturbed.

    python benchmarks/studies.py [--json] [--seeds 8] [--repeat 3] [--duration 30]
    python benchmarks/studies.py --kills 20 [--json]
"""

import argparse
import json
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from fogsim.study import load_study
from fogsim.study.pool import ProcessPool

STUDY = """
scenario: motorway_fog_bank
settings: [duration_s={duration}, camera.width=160, camera.height=120, clocks.camera_period_s=0.5]
factors:
  policy:
    none: [advice=none]
    sight: [advice=stopping_sight_distance]
seeds: {seeds}
frames: always
"""


def throughput(folder: Path, seeds: int, duration: float, repeat: int) -> list[dict[str, Any]]:
    """Records of each number of processes: runs a minute, the median of several turns, over that of one process."""
    path = folder / "study.yaml"
    path.write_text(STUDY.format(seeds=seeds, duration=duration), encoding="utf-8")
    runs = load_study(path).runs
    rates: dict[int, list[float]] = {1: [], 2: []}
    # The server from which processes are forked imports what they need, once.
    ProcessPool(1).run(runs[:1], folder, lambda _run, _message: None)
    for _ in range(repeat):
        for processes, found in rates.items():
            started = time.perf_counter()
            ProcessPool(processes).run(runs, folder, lambda _run, _message: None)
            found.append(60.0 * len(runs) / (time.perf_counter() - started))
    single = statistics.median(rates[1])
    return [
        {
            "processes": processes,
            "runs": len(runs),
            "runs_per_minute": round(statistics.median(found), 2),
            "ratio": round(statistics.median(found) / single, 3),
        }
        for processes, found in rates.items()
    ]


def descendants(process: int) -> list[int]:
    """Numbers of all processes that one has started, and they."""
    parents = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text(encoding="ascii", errors="replace").rpartition(")")[2].split()
        except OSError:
            continue
        parents[int(stat.parent.name)] = int(fields[1])
    found = [process]
    for one in found:
        found += [child for child, parent in parents.items() if parent == one]
    return found[1:]


def soak(folder: Path, seeds: int, duration: float, kills: int, seed: int) -> dict[str, Any]:
    """One record: how often what was killed, and whether the table came out the same."""
    path = folder / "study.yaml"
    path.write_text(STUDY.format(seeds=seeds, duration=duration), encoding="utf-8")
    rng = np.random.default_rng(seed)
    subprocess.run(command(path, folder / "quiet"), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
    killed = {"study": 0, "process of it": 0}
    starts = 0
    while True:
        starts += 1
        with subprocess.Popen(
            command(path, folder / "killed"), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        ) as study:
            while study.poll() is None and sum(killed.values()) < kills:
                time.sleep(rng.uniform(0.5, 12.0))
                workers = descendants(study.pid)
                whole = rng.random() < 0.4 or not workers
                victim = study.pid if whole else int(rng.choice(workers))
                if study.poll() is None:
                    try:
                        os.kill(victim, signal.SIGKILL)
                    except ProcessLookupError:
                        continue
                    killed["study" if whole else "process of it"] += 1
            code = study.wait()
        if code not in (0, -signal.SIGKILL):
            raise SystemExit(f"the study ended with code {code}")
        if code == 0:
            break
    # A run whose process was killed twice has failed; the same command tries it again.
    subprocess.run(command(path, folder / "killed"), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
    same = (folder / "quiet" / "study.parquet").read_bytes() == (folder / "killed" / "study.parquet").read_bytes()
    return {"runs": 2 * seeds, "starts": starts, **killed, "same_table": same}


def command(study: Path, out: Path) -> list[str]:
    """Command line of a study with two processes."""
    return [sys.executable, "-m", "fogsim", "study", str(study), "--out", str(out), "-j", "2"]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a list of flat records")
    parser.add_argument("--seeds", type=int, default=8, help="seeds of each of the two policies")
    parser.add_argument("--duration", type=float, default=30.0, help="duration of a run [s]")
    parser.add_argument("--repeat", type=int, default=3, help="turns, of which the median counts")
    parser.add_argument("--kills", type=int, default=0, help="soak: how many processes are killed")
    parser.add_argument("--seed", type=int, default=1, help="of the moments of killing")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder, seeds, duration = Path(name), arguments.seeds, arguments.duration
        if arguments.kills:
            records = [soak(folder, seeds, duration, arguments.kills, arguments.seed)]
        else:
            records = throughput(folder, seeds, duration, arguments.repeat)
    if arguments.json:
        print(json.dumps(records, indent=2))
        return
    for record in records:
        print("  ".join(f"{key} {value}" for key, value in record.items()))


if __name__ == "__main__":
    main()
