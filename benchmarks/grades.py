"""Error of estimates on grades, in sags and over crests: a drive through ``graded_motorway``.

A frame counts to a grade if the road keeps it for the next 150 m, else to a sag or a crest. For each visibility, kind
of road and method: frames, share of valid ones, median of the error of V_met [%] with its sign, median and 95th
percentile of its amount, and how often the 90 % interval held the truth. ``belief`` is what the grid filter makes of
all of them.

    python benchmarks/grades.py [--json] [--visibility 100 --visibility 500 …] [--seed 1] [--duration 180]
"""

import argparse
import json
import math
from collections.abc import Iterable, Iterator

import numpy as np

import fogsim
from fogsim.scenario import build
from fogsim.traffic.road.network import read_net, road_network
from fogsim.values import Step

SCENARIO = "graded_motorway"
METHODS = ("joint_road", "negru2013", "zhu2015", "huang2015")
AHEAD = 150.0
"""How far the road must keep its grade [m]."""
CURVED = 0.002
"""Change of the grade on the way from which the road is a sag or a crest [-]."""

Found = tuple[float, float, float]
"""A visibility and its 90 % interval [m]."""


class Profile:
    """Grades of the scenario's road by the distance along it."""

    def __init__(self) -> None:
        route = road_network(read_net(build.traffic_setup(fogsim.load_scenario(SCENARIO)).net), ("road",)).route
        steps = np.diff(route, axis=0)
        self._station = np.cumsum(np.linalg.norm(steps, axis=1))
        self._grade = steps[:, 2] / np.hypot(steps[:, 0], steps[:, 1])

    def kind(self, station: float) -> str:
        """What the road ahead of a place is."""
        here, there = np.searchsorted(self._station, (station, station + AHEAD)).clip(max=len(self._grade) - 1)
        change = float(self._grade[there] - self._grade[here])
        if abs(change) > CURVED:
            return "sag" if change > 0 else "crest"
        return f"{round(100 * self._grade[here]):+d} %"


def found_in(step: Step) -> Iterator[tuple[str, Found | None]]:
    """What each method and the belief say in a frame."""
    for one in step.estimates:
        yield one.method, (one.visibility, *one.visibility_interval) if one.valid else None
    belief = step.belief
    yield "belief", (belief.visibility, belief.visibility_quantile(0.05), belief.visibility_quantile(0.95))


def drive(visibility: float, seed: int, duration: float) -> dict[tuple[str, str], list[Found | None]]:
    """What is found on the way, by kind of road and method."""
    methods = ", ".join(f"{{method: {name}}}" for name in METHODS)
    clocks = ("clocks.camera_period_s=0.5", "clocks.decision_period_s=0.5")
    settings = (f"fog.visibility_m={visibility}", f"estimators=[{methods}]", f"duration_s={duration}", *clocks)
    profile, found = Profile(), {}
    for step in fogsim.run(fogsim.load_scenario(SCENARIO, settings), seed):
        for name, one in found_in(step):
            found.setdefault((profile.kind(step.route_position), name), []).append(one)
    return found


def record(visibility: float, kind: str, method: str, found: Iterable[Found | None]) -> dict[str, object]:
    """One row of the table."""
    asked = list(found)
    told = np.array([one for one in asked if one is not None and math.isfinite(one[0])]).reshape(-1, 3)
    error = 100.0 * (told[:, 0] / visibility - 1.0)
    held = (told[:, 1] <= visibility) & (visibility <= told[:, 2])
    return {
        "V_met": visibility,
        "road": kind,
        "method": method,
        "frames": len(asked),
        "valid": round(len(told) / len(asked), 2),
        "bias": round(float(np.median(error)), 1) if len(told) else None,
        "median": round(float(np.median(np.abs(error))), 1) if len(told) else None,
        "p95": round(float(np.quantile(np.abs(error), 0.95)), 1) if len(told) else None,
        "held": round(float(held.mean()), 2) if len(told) else None,
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a list of flat records")
    parser.add_argument("--visibility", action="append", type=float, help="V_met [m] (default 100, 200 and 500)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the drive")
    parser.add_argument("--duration", type=float, default=180.0, help="longest simulated time [s]")
    arguments = parser.parse_args()
    records = [
        record(visibility, kind, method, found)
        for visibility in arguments.visibility or [100.0, 200.0, 500.0]
        for (kind, method), found in sorted(drive(visibility, arguments.seed, arguments.duration).items())
    ]
    if arguments.json:
        print(json.dumps(records, indent=2))
        return
    print("  ".join(f"{key:>10}" for key in records[0]))
    for row in records:
        print("  ".join(f"{value!s:>10}" for value in row.values()))


if __name__ == "__main__":
    main()
