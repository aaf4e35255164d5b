"""What Gymnasium's users expect of the environments, tried: checkers, vector environments, lost processes, actions.

Checks, each for each environment: ``gymnasium`` and ``sb3`` are the checkers of Gymnasium and of Stable-Baselines3 (if
it is installed; version 0 has the one recommendation that its matrix of signs should be flat); ``sync`` and ``async
fork``, ``async spawn``, ``async forkserver`` are ``gymnasium.make_vec`` with a wrapper, where an environment has drawn
pictures in this process before; ``killed worker`` is `fogsim_envs.vector.make_vector`, one of whose workers is killed;
``killed parent`` looks for processes that outlive one that runs such workers; ``actions`` are some that are no members
of the space.

    python benchmarks/environment_contract.py [--json] [--env fogsim/FogHighway-v0 …] [--check sb3 …]

Ends with 1 if a check failed.
"""

import argparse
import functools
import importlib
import importlib.util
import json
import math
import os
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import RecordEpisodeStatistics

import fogsim_envs  # noqa: F401 - registers the environments
from fogsim.errors import InputError, SimulationError
from fogsim_envs.vector import make_vector

SIZE = (64, 48)
ENVIRONMENTS: dict[str, dict[str, Any]] = {
    "fogsim/FogAdvisory-v0": {"image_size": SIZE},
    "fogsim/FogHighway-v0": {"image_size": SIZE},
    "fogsim/FogAdvisory-v1": {"image_size": SIZE},
    "fogsim/FogDrive-v1": {"image_size": SIZE},
    "fogsim/FogHighway-v1": {"image_size": SIZE},
    "fogsim/FogAdvisoryFast-v1": {},
}
NOT_ACTIONS: tuple[Any, ...] = (-1, [-1, 0], [99, 0], [math.nan, 0.0], [0, 0, 0], "fast", None)
PARENT = """
import sys, time, json
from fogsim_envs.vector import make_vector
if __name__ == "__main__":
    envs = make_vector(sys.argv[1], num_envs=2, **json.loads(sys.argv[2]))
    envs.reset(seed=1)
    print(*[process.pid for process in envs.processes], flush=True)
    time.sleep(60.0)
"""

OF_VERSION_0 = "Your observation signs has an unconventional shape"
"""What Stable-Baselines3 recommends to flatten; the spaces of version 0 stay as they are."""

Check = Callable[[str, dict[str, Any]], str]
"""Tries something of an environment; gives what there is to say of it, and raises if it fails."""


class ContractError(Exception):
    """Something is not as users expect it."""


def must(holds: bool, otherwise: str) -> None:
    """Raise if something does not hold."""
    if not holds:
        raise ContractError(otherwise)


def warned(checker: Callable[[Any], object], env: gymnasium.Env[Any, Any], expected: str = "") -> str:
    """What a checker warns of, but for what begins as expected."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        checker(env)
    env.close()
    messages = {str(one.message) for one in caught}
    known = {message for message in messages if expected and message.startswith(expected)}
    must(messages == known, "; ".join(messages - known))
    return f"but for: {expected}" if known else "no warning"


def with_gymnasium(name: str, settings: dict[str, Any]) -> str:
    """Gymnasium's checker."""
    return warned(check_env, gymnasium.make(name, **settings).unwrapped)


def with_sb3(name: str, settings: dict[str, Any]) -> str:
    """Stable-Baselines3's checker."""
    if importlib.util.find_spec("stable_baselines3") is None:
        return "not tried: pip install stable-baselines3"
    checker = importlib.import_module("stable_baselines3.common.env_checker").check_env
    return warned(checker, gymnasium.make(name, **settings), OF_VERSION_0 if name.endswith("-v0") else "")


def in_vector(name: str, settings: dict[str, Any], mode: str, **vector: Any) -> str:
    """A vector environment of Gymnasium's."""
    first = gymnasium.make(name, **settings)
    first.reset(seed=1)
    envs = gymnasium.make_vec(
        name,
        num_envs=2,
        vectorization_mode=mode,
        vector_kwargs=vector,
        wrappers=[RecordEpisodeStatistics],
        **settings,
    )
    observations, _ = envs.reset(seed=[3, 3])
    for entry in observations.values() if isinstance(observations, dict) else [observations]:
        must(np.array_equal(entry[0], entry[1]), "the same seed gives two observations")
    envs.step(envs.action_space.sample())
    envs.close()
    first.close()
    return "ran"


def with_a_killed_worker(name: str, settings: dict[str, Any]) -> str:
    """Our vector environment, with one worker killed."""
    envs: Any = make_vector(name, 2, **settings)
    envs.reset(seed=1)
    workers = envs.processes
    os.kill(workers[0].pid, signal.SIGKILL)
    try:
        envs.step(envs.action_space.sample())
    except SimulationError as error:
        must(not any(worker.is_alive() for worker in workers), "a worker is left")
        return str(error)
    raise ContractError("nothing was told")


def with_a_killed_parent(name: str, settings: dict[str, Any]) -> str:
    """Processes that outlive the one that started them."""
    command = [sys.executable, "-W", "ignore", "-c", PARENT, name, json.dumps(settings)]
    # What the workers say of their parent's death is no news.
    parent = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    with parent.stdout or sys.stdin as told:
        workers = [int(pid) for pid in told.readline().split()]
    parent.kill()
    parent.wait()
    end = time.monotonic() + 10.0
    while (left := [pid for pid in workers if Path(f"/proc/{pid}").exists()]) and time.monotonic() < end:
        time.sleep(0.1)
    must(bool(workers) and not left, f"of {workers}, {left} are left after 10 s")
    return f"{len(workers)} workers have ended"


def with_what_is_no_action(name: str, settings: dict[str, Any]) -> str:
    """Actions outside the space."""
    refused = 0
    for continuous in (False, True):
        env = gymnasium.make(name, continuous=continuous, **settings)
        env.reset(seed=1)
        # In the continuous space [-1, 0] is one.
        for action in [one for one in NOT_ACTIONS if not (continuous and one == [-1, 0])]:
            message = told_of(env, action)
            must(message.startswith(f"action of {name}"), f"{action!r}: {message}")
            refused += 1
        env.close()
    return f"{refused} refused"


def told_of(env: gymnasium.Env[Any, Any], action: object) -> str:
    """What a step says of an action."""
    try:
        env.step(action)
    except InputError as error:
        return str(error)
    return "taken"


CHECKS: dict[str, Check] = {
    "gymnasium": with_gymnasium,
    "sb3": with_sb3,
    "sync": functools.partial(in_vector, mode="sync"),
    "async fork": functools.partial(in_vector, mode="async", context="fork"),
    "async spawn": functools.partial(in_vector, mode="async", context="spawn"),
    "async forkserver": functools.partial(in_vector, mode="async", context="forkserver"),
    "killed worker": with_a_killed_worker,
    "killed parent": with_a_killed_parent,
    "actions": with_what_is_no_action,
}


def tried(check: str, name: str) -> dict[str, Any]:
    """One record."""
    started = time.perf_counter()
    try:
        passed, told = True, CHECKS[check](name, ENVIRONMENTS[name])
    except Exception as error:  # noqa: BLE001 - whatever goes wrong is what is asked for
        passed, told = False, f"{type(error).__name__}: {error}"
    return {
        "env": name,
        "check": check,
        "passed": passed,
        "told": told,
        "s": round(time.perf_counter() - started, 1),
    }


def main() -> int:
    """Try and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a list of flat records")
    parser.add_argument("--env", action="append", choices=ENVIRONMENTS, help="which environment (default: all)")
    parser.add_argument("--check", action="append", choices=CHECKS, help="which check (default: all)")
    arguments = parser.parse_args()
    # Version 0 is out of date, and stays.
    warnings.filterwarnings("ignore", message=".*is out of date")
    records = []
    for name in arguments.env or ENVIRONMENTS:
        for check in arguments.check or CHECKS:
            records.append(tried(check, name))
            if not arguments.json:
                print(*records[-1].values(), sep="  ", flush=True)
    if arguments.json:
        print(json.dumps(records, indent=2))
    return 0 if all(record["passed"] for record in records) else 1


if __name__ == "__main__":
    sys.exit(main())
