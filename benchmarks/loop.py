"""Speed of the closed loop: environment steps and camera frames a second, and where the time goes.

The environment runs the motorway scenario in its fog bank, with a camera frame rendered, fogged, exposed and read by
the estimators every camera period (0.1 s) and a decision every 0.5 s. Shares come from a profile of a second run.
With --peer, highway-env's highway-fast-v0 (which draws no camera) is measured alternately in the same process.
With --against, another version (a commit, whose files are extracted to build/against, or a directory) and this one
take each step in turn, in two processes of one thread. Their ratio of processor time holds on a busy machine too.
Ratios below 1 mean that this version is faster; against itself it shows the noise. Stages are timed by a profiler,
which slows Python down but not kernels: compare a stage with itself in the other version, not stages with each other.
"""

import argparse
import cProfile
import io
import json
import os
import pstats
import shutil
import statistics
import subprocess
import sys
import tarfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from harness import Row, parse_options, publish

import fogsim_envs  # noqa: F401 - registers the environments

ENV_ID = "fogsim/FogAdvisory-v0"
ROOT = Path(__file__).resolve().parents[1]
PEER_ID = "highway-fast-v0"
SHIPPED = "shipped"
"""The estimators that the scenario names."""
CRUISE = np.array([7, 1])

STAGES = {
    "traffic": ("sumo_traffic.py:advance", "sumo_traffic.py:observe"),
    "scene": ("vehicles.py:vehicle_batches",),
    "render": ("renderer.py:render",),
    "atmosphere": ("air.py:radiance", "fog_truth.py:fog_truth", "equipment.py:fog_truth", "onboard.py:fog_truth"),
    "camera": ("sensor.py:take", "photographer.py:take"),
    "sensors": ("lead.py:measure_lead", "signs.py:signs_ahead"),
    "estimators": ("negru2013.py:update", "joint_road.py:update", "lead_contrast.py:update"),
    "fusion": ("field_filter.py:update_at", "grid_filter.py:update"),
}
"""Functions of each stage, under the names of all versions that --against may name: their cumulative time counts."""


def make_env(size: str, method: str) -> gymnasium.Env[Any, Any]:
    """The environment with a camera of a given size and estimators, started in thick traffic and fog."""
    width, height = map(int, size.split("x"))
    estimators = [] if method == SHIPPED else [f"estimators=[{method}]"]
    return gymnasium.make(ENV_ID, image_size=(width, height), overrides=["fog.visibility_m=100", *estimators])


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


def profile(env: gymnasium.Env[Any, Any], steps: int, action: Callable[[], Any]) -> dict[str, float]:
    """Processor time of each stage and of all [s], and all function calls, from a profile."""
    env.reset(seed=1)
    profiler = cProfile.Profile(time.process_time)
    profiler.enable()
    for _ in range(steps):
        env.step(action())
    profiler.disable()
    stats: Any = pstats.Stats(profiler)
    names = {f"{path.rpartition('/')[2]}:{name}": entry[3] for (path, _, name), entry in stats.stats.items()}
    times = {stage: sum(names.get(name, 0.0) for name in functions) for stage, functions in STAGES.items()}
    times["other"] = stats.total_tt - sum(times.values())
    return times | {"all": stats.total_tt, "calls": stats.total_calls}


def measure(size: str, method: str, steps: int, repeat: int, peer: gymnasium.Env[Any, Any] | None) -> Row:
    """One record for one camera size."""
    env = make_env(size, method)
    own, other = [], []
    for _ in range(repeat):
        own.append(steps_per_second(env, steps, lambda: CRUISE))
        if peer is not None:
            other.append(steps_per_second(peer, steps, peer.action_space.sample))
    frames = env.unwrapped._frames  # type: ignore[attr-defined]
    spent = profile(env, steps, lambda: CRUISE)
    record = {
        "env": ENV_ID,
        "camera": size,
        "method": method,
        "vehicles": len(env.unwrapped._step.traffic.ids),  # type: ignore[attr-defined]
        "steps_per_s": round(statistics.median(own), 2),
        "steps_per_s_min": round(min(own), 2),
        "steps_per_s_max": round(max(own), 2),
        "frames_per_s": round(statistics.median(own) * frames, 1),
        "calls_a_frame": round(spent.pop("calls") / (steps * frames)),
    }
    record |= {f"share_{stage}": round(spent[stage] / spent["all"], 3) for stage in (*STAGES, "other")}
    if other:
        record |= {
            "peer": PEER_ID,
            "peer_steps_per_s": round(statistics.median(other), 2),
            "ratio": round(statistics.median(a / b for a, b in zip(own, other, strict=True)), 3),
        }
    env.close()
    return record


def answer(size: str, method: str) -> None:
    """For each line that comes in, take a step, begin again or profile, and print processor time [s] or the profile."""
    env = make_env(size, method)
    env.reset(seed=1)
    env.step(CRUISE)
    for line in sys.stdin:
        task, *steps = line.split()
        started = time.process_time()
        if task == "profile":
            print(json.dumps(profile(env, int(steps[0]), lambda: CRUISE)), flush=True)
            continue
        if task == "step":
            env.step(CRUISE)
        else:
            env.reset(seed=1)
        print(time.process_time() - started, flush=True)


def result(process: "subprocess.Popen[str]", task: str) -> Any:
    """What another process prints for a task."""
    if process.stdin is None or process.stdout is None:
        raise ValueError("the process must have been started with pipes")
    process.stdin.write(task + "\n")
    process.stdin.flush()
    return json.loads(process.stdout.readline())


def start(checkout: Path, size: str, method: str) -> "subprocess.Popen[str]":
    """A process that runs a version of FogSim, with its own environment if it has one, in one thread."""
    own = checkout / ".venv/bin/python"
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
    return subprocess.Popen(
        [own if own.exists() else sys.executable, Path(__file__).resolve(), "--answer", size, method],
        cwd=checkout,
        env=os.environ | threads | {"PYTHONPATH": f"{checkout}{os.pathsep}{checkout / 'envs'}"},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )


def git(*arguments: str) -> bytes:
    """What git prints."""
    program = shutil.which("git") or sys.exit("--against COMMIT needs git")
    return subprocess.run([program, *arguments], cwd=ROOT, capture_output=True, check=False).stdout


def version_at(against: str) -> Path:
    """The directory, or the files of a commit, extracted once."""
    if Path(against).is_dir():
        return Path(against).resolve()
    commit = git("rev-parse", "--verify", "--quiet", f"{against}^{{commit}}").decode().strip()
    if not commit:
        sys.exit(f"--against must be a directory or a commit of this repository, got {against}")
    target = ROOT / "build" / "against" / commit
    if not target.exists():
        with tarfile.open(fileobj=io.BytesIO(git("archive", commit))) as archive:
            archive.extractall(target, filter="data")
    return target


def compare(size: str, method: str, steps: int, repeat: int, against: str) -> list[Row]:
    """Records of processor time a frame in this version and in another: all of it, then stage by stage."""
    processes = [start(version, size, method) for version in (ROOT, version_at(against))]
    times = np.zeros((repeat, steps, 2))
    for repetition in times:
        for process in processes:
            result(process, "begin")
        for index, step in enumerate(repetition):
            for who in (0, 1) if index % 2 else (1, 0):
                step[who] = result(processes[who], "step")
    profiles = [result(process, f"profile {steps}") for process in processes]
    for process in processes:
        process.communicate()
    ratio = np.quantile(times[..., 0] / times[..., 1], (0.5, 0.25, 0.75)).round(3).tolist()
    typical = [statistics.median(column) for column in times.reshape(-1, 2).T]
    base = {"camera": size, "method": method}
    rows: list[Row] = [base | {"stage": "all", "ratio": ratio[0], "ratio_25": ratio[1], "ratio_75": ratio[2]}]
    rows[0] |= {"ms_a_step": round(1e3 * typical[0], 2), "against_ms": round(1e3 * typical[1], 2)}
    rows[0] |= {"p99_over_median": round(float(np.quantile(times[..., 0], 0.99)) / typical[0], 2)}
    rows.append(base | {"stage": "calls", "ratio": round(profiles[0]["calls"] / profiles[1]["calls"], 3)})
    for stage in (*STAGES, "other"):
        here, there = (1e3 * one[stage] / steps for one in profiles)
        ratios = {"ratio": round(here / there, 3)} if there > 0.0 else {}
        rows.append(base | {"stage": stage} | ratios | {"ms_a_step": round(here, 2), "against_ms": round(there, 2)})
    return rows


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        peer=(False, f"also measure {PEER_ID}, alternately"),
        size=(["160x120", "640x480"], "cameras, WIDTHxHEIGHT"),
        method=([SHIPPED], "estimators: shipped, or names with commas between them"),
        steps=(60, "environment steps a repetition"),
        repeat=(3, "repetitions"),
        against=(str, "commit, or directory of a checkout, to compare with step by step"),
        answer=([""], argparse.SUPPRESS),
    )
    if given.answer != [""]:
        answer(*given.answer)
        return
    cases = [(size, method) for size in given.size for method in given.method]
    if given.against:
        publish(given, [row for case in cases for row in compare(*case, given.steps, given.repeat, given.against)])
        return
    if given.peer:
        import highway_env  # noqa: F401, PLC0415 - registers the peer
    peer = gymnasium.make(PEER_ID) if given.peer else None
    publish(given, [measure(*case, given.steps, given.repeat, peer) for case in cases])


if __name__ == "__main__":
    main()
