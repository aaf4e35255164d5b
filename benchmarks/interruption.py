"""Time from a signal to the end of ``fogsim run``: at moments drawn evenly from its start to well into its run.

Each run of the motorway scenario (160×120, with table, video and report) is sent one of SIGINT, SIGTERM and SIGHUP and
must end with that signal's exit code, as a shell sees it. `where` is the state found in its directory:
"before the run" (the program starts, or the traffic fills up) or "run". Kernels are compiled already.

    python benchmarks/interruption.py [--json] [--runs 12] [--latest 12] [--seed 1]
"""

import argparse
import json
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

SIGNALS = {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGHUP: 129}
"""Exit codes, which are 128 and the signal's number."""


def interrupted(number: signal.Signals, moment: float) -> dict[str, Any]:
    """One record of a run that is sent a signal some time after its start [s]."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "out")
        small = ("--set", "camera.width=160", "--set", "camera.height=120")
        process = subprocess.Popen(
            [sys.executable, "-m", "fogsim", "run", "motorway_fog_bank", "--out", out, *small],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        time.sleep(moment)
        where = "run" if (out / "unfinished" / "steps.arrows").exists() else "before the run"
        started = time.perf_counter()
        process.send_signal(number)
        code = process.wait(timeout=120)
        return {
            "signal": number.name,
            "moment_s": round(moment, 2),
            "where": where,
            "end_s": round(time.perf_counter() - started, 2),
            "exit_code": code,
            # Before Python itself has begun, the signal ends the process: shells show that as the same code.
            "as_promised": code in (SIGNALS[number], -number),
        }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a list of flat records")
    parser.add_argument("--runs", type=int, default=12, help="runs that are ended")
    parser.add_argument("--latest", type=float, default=12.0, help="latest moment of a signal [s]")
    parser.add_argument("--seed", type=int, default=1, help="of the moments")
    arguments = parser.parse_args()
    moments = np.random.default_rng(arguments.seed).uniform(0.0, arguments.latest, arguments.runs)
    kinds = list(SIGNALS)
    records = [interrupted(kinds[index % len(kinds)], float(moment)) for index, moment in enumerate(moments)]
    if arguments.json:
        print(json.dumps(records, indent=2))
        return
    for record in records:
        print("  ".join(f"{key} {value}" for key, value in record.items()))
    times = sorted(record["end_s"] for record in records)
    print(f"\nseconds to the end: median {times[len(times) // 2]}, longest {times[-1]}")


if __name__ == "__main__":
    main()
