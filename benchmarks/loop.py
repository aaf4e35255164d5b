"""Speed of the closed loop: environment steps and camera frames a second, and each stage's share of the time.

The environment runs the motorway scenario in its fog bank, with a camera frame rendered, fogged, exposed and read by
the estimator every camera period (0.1 s) and a decision every 0.5 s. Shares come from a profile of a second run.
With --peer, highway-env's highway-fast-v0 (which draws no camera) is measured alternately in the same process.
With --against, another checkout of FogSim (with its own .venv) and this one take each step in turn, in two processes,
so that what else the machine does slows both: their ratio holds where speeds do not. Against itself it shows the noise.

    python benchmarks/loop.py [--json] [--peer | --against DIRECTORY] [--size 160x120 --size 640x480]
                              [--steps 60] [--repeat 3]
"""

import argparse
import cProfile
import pstats
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from harness import Row, parse_options, publish

import fogsim_envs  # noqa: F401 - registers the environments

ENV_ID = "fogsim/FogAdvisory-v0"
PEER_ID = "highway-fast-v0"

STAGES = {
    "traffic": (("sumo_traffic.py", "advance"), ("sumo_traffic.py", "observe")),
    "scene": (("vehicles.py", "vehicle_batches"),),
    "render": (("renderer.py", "render"),),
    "atmosphere": (("air.py", "radiance"), ("equipment.py", "fog_truth")),
    "camera": (("sensor.py", "take"),),
    "sensors": (("lead.py", "measure_lead"), ("signs.py", "signs_ahead")),
    "estimators": (("negru2013.py", "update"),),
    "fusion": (("grid_filter.py", "update"),),
}
"""Functions of each stage: their cumulative time in the profile is the stage's share."""


def make_env(size: str) -> gymnasium.Env[Any, Any]:
    """The environment with a camera of a given size, started in thick traffic and fog."""
    width, height = map(int, size.split("x"))
    return gymnasium.make(ENV_ID, image_size=(width, height), overrides=["fog.visibility_m=100"])


def steps_per_second(env: gymnasium.Env[Any, Any], steps: int, action: Callable[[], Any]) -> float:
    """Steps a second over a run of fixed length, resets not counted."""
    env.reset(seed=1)
    spent = 0.0
    for _ in range(steps):
        started = time.perf_counter()
        *_, terminated, truncated, _ = env.step(action())
        spent += time.perf_counter() - started
        if terminated or truncated:
            env.reset()
    return steps / spent


def stage_shares(env: gymnasium.Env[Any, Any], steps: int, action: Callable[[], Any]) -> dict[str, float]:
    """Share of the wall time in each stage, from a profile."""
    env.reset(seed=1)
    profile = cProfile.Profile()
    profile.enable()
    for _ in range(steps):
        env.step(action())
    profile.disable()
    stats: dict[Any, Any] = pstats.Stats(profile).stats  # type: ignore[attr-defined]  # typeshed lacks it
    total = sum(entry[2] for entry in stats.values())
    shares = {}
    for stage, functions in STAGES.items():
        spent = [
            entry[3]
            for (path, _, name), entry in stats.items()
            if any(path.endswith("/" + file) and name == function for file, function in functions)
        ]
        shares[stage] = round(sum(spent) / total, 3)
    shares["other"] = round(1.0 - sum(shares.values()), 3)
    return shares


def measure(size: str, steps: int, repeat: int, peer: gymnasium.Env[Any, Any] | None) -> Row:
    """One record for one camera size."""
    env = make_env(size)
    cruise = np.array([7, 1])
    own, other = [], []
    for _ in range(repeat):
        own.append(steps_per_second(env, steps, lambda: cruise))
        if peer is not None:
            other.append(steps_per_second(peer, steps, peer.action_space.sample))
    frames = env.unwrapped._frames  # type: ignore[attr-defined]
    record = {
        "env": ENV_ID,
        "camera": size,
        "vehicles": len(env.unwrapped._step.traffic.ids),  # type: ignore[attr-defined]
        "steps_per_s": round(statistics.median(own), 2),
        "steps_per_s_min": round(min(own), 2),
        "steps_per_s_max": round(max(own), 2),
        "frames_per_s": round(statistics.median(own) * frames, 1),
    } | {f"share_{stage}": share for stage, share in stage_shares(env, steps, lambda: cruise).items()}
    if other:
        record |= {
            "peer": PEER_ID,
            "peer_steps_per_s": round(statistics.median(other), 2),
            "ratio": round(statistics.median(a / b for a, b in zip(own, other, strict=True)), 3),
        }
    env.close()
    return record


def answer(size: str) -> None:
    """Take a step, or begin again, for each line that comes in, and print how long it took [s]."""
    env, cruise = make_env(size), np.array([7, 1])
    env.reset(seed=1)
    env.step(cruise)
    for line in sys.stdin:
        started = time.perf_counter()
        if line.startswith("step"):
            env.step(cruise)
        else:
            env.reset(seed=1)
        print(time.perf_counter() - started, flush=True)


def duration(process: "subprocess.Popen[str]", task: str) -> float:
    """Time that another process takes for a task [s]."""
    if process.stdin is None or process.stdout is None:
        raise ValueError("the process must have been started with pipes")
    process.stdin.write(task + "\n")
    process.stdin.flush()
    return float(process.stdout.readline())


def compare(size: str, steps: int, repeat: int, other: Path) -> Row:
    """One record of this checkout's time for a step over another's."""
    here = Path(__file__).resolve()
    processes = [
        subprocess.Popen(
            [checkout / ".venv/bin/python", here, "--answer", size],
            cwd=checkout,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        for checkout in (here.parents[1], other)
    ]
    times = np.zeros((repeat, steps, 2))
    for repetition in times:
        for process in processes:
            duration(process, "begin")
        for index, step in enumerate(repetition):
            for who in (0, 1) if index % 2 else (1, 0):
                step[who] = duration(processes[who], "step")
    for process in processes:
        process.communicate()
    ratio, fastest = times[..., 0] / times[..., 1], times.min(axis=0).sum(axis=0)
    return {
        "env": ENV_ID,
        "camera": size,
        "against": str(other),
        "time_ratio": round(float(np.median(ratio)), 3),
        "time_ratio_25": round(float(np.quantile(ratio, 0.25)), 3),
        "time_ratio_75": round(float(np.quantile(ratio, 0.75)), 3),
        "time_ratio_fastest": round(float(fastest[0] / fastest[1]), 3),
    }


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        peer=(False, f"also measure {PEER_ID}, alternately"),
        size=(["160x120", "640x480"], "cameras, WIDTHxHEIGHT"),
        steps=(60, "environment steps a repetition"),
        repeat=(3, "repetitions"),
        against=(Path, "checkout to compare with, step by step"),
        answer=(str, argparse.SUPPRESS),
    )
    if given.answer:
        answer(given.answer)
        return
    if given.against:
        if not (given.against / ".venv/bin/python").exists():
            given.error(f"--against must be a checkout that is installed in its .venv, got {given.against}")
        records = [compare(size, given.steps, given.repeat, given.against.resolve()) for size in given.size]
    else:
        if given.peer:
            import highway_env  # noqa: F401, PLC0415 - registers the peer
        peer = gymnasium.make(PEER_ID) if given.peer else None
        records = [measure(size, given.steps, given.repeat, peer) for size in given.size]
    publish(given, records)


if __name__ == "__main__":
    main()
