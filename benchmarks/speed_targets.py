"""Speed against its targets: this version, the commit that ended the first batch (c4d9aa66) and highway-env in turn.

It runs loop.py, frames.py, traffic.py and cold_start.py, about 10 minutes on a quiet machine. Ratios are of processor
time, which other work disturbs little; only the first run is wall time.
"""

import json
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from harness import ROOT, Row, lines_of, parse_options, progress, publish
from loop import SHIPPED, version_at

LOOP = {
    ("160x120", "negru2013"): (1.4, 1200),
    ("160x120", SHIPPED): (0.8, 2000),
    ("640x480", "negru2013"): (1.5, None),
    ("640x480", SHIPPED): (1.2, None),
}
"""Cameras and estimators, with the frames a second asked for, relative to then, and the function calls a frame."""
FRAMES = {("day", 160): 0.6, ("day", 640): 0.6, ("night", 160): 0.7, ("night", 640): 0.7}
"""Light and width of a camera frame, with the time asked for, relative to then."""
TRAFFIC = {100: 2.0, 500: 1.8, 2000: 1.4}
"""Vehicles, with the time of traffic and perception asked for, relative to bare SUMO."""


def script(name: str, *options: object, version: Path = ROOT) -> list[Row]:
    """Records that a benchmark of a version prints."""
    command = [sys.executable, f"benchmarks/{name}.py", "--json", *map(str, options)]
    paths = f"{version}{os.pathsep}{version / 'envs'}"
    printed = subprocess.run(command, cwd=version, env=os.environ | {"PYTHONPATH": paths}, stdout=-1, check=True).stdout
    printed_records: list[Row] = json.loads(printed)
    return printed_records


def record(what: str, asked: str, found: float | int, *, met: bool) -> Row:
    """A target and how far it is met."""
    return {"what": what, "target": asked, "measured": found, "met": met}


def loop_targets(then: Path) -> Iterator[Row]:
    """Frames a second of processor time relative to then, the slowest frames, and function calls."""
    for (size, method), (speed, calls) in LOOP.items():
        case = ("--size", size, "--method", method, "--steps", 40)
        all_of_it = script("loop", *case, "--against", then)[0]
        name = f"loop {size.replace('x', '×')}, {'the demo' if method == SHIPPED else method}"
        found = round(1.0 / all_of_it["ratio"], 2)
        yield record(f"{name}: frames a second / then", f"≥ {speed}", found, met=found >= speed)
        slowest = all_of_it["p99_over_median"]
        yield record(f"{name}: 99th percentile of a step / median", "≤ 2.5", slowest, met=slowest <= 2.5)
        if calls:
            found = script("loop", *case, "--repeat", 1)[0]["calls_a_frame"]
            yield record(f"{name}: function calls a frame", f"≤ {calls}", found, met=found <= calls)


def frame_targets(then: Path, repeat: int) -> Iterator[Row]:
    """Time of a frame on the CPU relative to then, the fastest of many."""
    fastest: dict[tuple[str, int], list[float]] = {key: [9e9, 9e9] for key in FRAMES}
    for who, version in (*enumerate((ROOT, then)),) * repeat:
        for one in script("frames", "--renderer", "cpu", "--light", "day", "--light", "night", version=version):
            times = fastest[one["light"], one["width"]]
            times[who] = min(times[who], one["ms_min"])
    for (light, width), asked in FRAMES.items():
        now, before = fastest[light, width]
        found = round(now / before, 2)
        size = f"{width}×{width * 3 // 4}"
        yield record(f"frame {size} by {light}: time / then", f"≤ {asked}", found, met=found <= asked)


def other_targets(repeat: int) -> Iterator[Row]:
    """An environment step against highway-env's, traffic against bare SUMO, and a first run."""
    with_peer = script("loop", "--peer", "--size", "160x120", "--method", SHIPPED, "--steps", 40)[0]
    found = round(with_peer["frames_per_s"] / with_peer["peer_steps_per_s"], 2)
    yield record("camera frames a second / steps of highway-fast-v0", "≥ 6", found, met=found >= 6)
    vehicles = [option for many in TRAFFIC for option in ("--vehicles", many)]
    for one in script("traffic", "--network", "motorway", *vehicles):
        asked, name = TRAFFIC[one["vehicles"]], f"traffic and perception / bare SUMO, {one['vehicles']} vehicles"
        yield record(name, f"≤ {asked}", one["ratio"], met=one["ratio"] <= asked)
    runs = script("cold_start", "--repeat", repeat, "--scenario", "motorway_fog_bank")
    for run, asked in zip(runs, (20, 4), strict=True):
        found = run["wall_s"]
        yield record(f"{run['run']} run from a checkout [s]", f"≤ {asked}", found, met=found <= asked)


def table(records: Sequence[Row]) -> list[str]:
    """Lines of the table of docs/benchmarks/performance.md."""
    rows = [(one["what"], one["target"], one["measured"], "yes" if one["met"] else "no") for one in records]
    return lines_of(("", "target", "measured", "met"), [tuple(map(str, row)) for row in rows])


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        docs=("benchmarks/performance.md", "speed targets"),
        then=("c4d9aa66", "commit to compare with"),
        repeat=(2, "repetitions of frames and first runs"),
    )
    then = version_at(given.then)
    parts = (loop_targets(then), frame_targets(then, given.repeat), other_targets(given.repeat))
    publish(given, [one for part in progress(parts, "parts") for one in part], table)


if __name__ == "__main__":
    main()
