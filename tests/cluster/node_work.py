"""What nodes of the tests' cluster do with a run, in processes of theirs."""

import os
import signal
import threading
import time
from pathlib import Path
from typing import Any

import ray

from fogsim.scenario import Scenario
from fogsim.study.execution import run_outcome
from fogsim.study.profiles import RunProfiles


def marks() -> Path:
    """Folder in which processes leave word."""
    return Path(os.environ["FOGSIM_TEST_MARKS"])


def killed_once(scenario: Scenario, seed: int, outputs: Path) -> dict[str, Any]:
    """Run; the first process that has seed 1 is killed in its run."""
    mark = marks() / "killed"
    if seed == 1 and not mark.exists():
        mark.touch()
        threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGKILL)).start()
    return run_outcome(scenario, seed, outputs)


def killed_always(scenario: Scenario, seed: int, outputs: Path) -> dict[str, Any]:
    """Kill the process that has seed 1."""
    if seed == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return {"status": "complete", "metrics": {"seed": seed}, "profiles": RunProfiles().to_json()}


def held(scenario: Scenario, seed: int, outputs: Path) -> dict[str, Any]:
    """Run, once there is word to go on; says on which node."""
    (marks() / f"on {ray.get_runtime_context().get_node_id()}").touch()
    deadline = time.monotonic() + 60.0
    while not (marks() / "go on").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    return run_outcome(scenario, seed, outputs)
