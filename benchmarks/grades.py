"""Error of estimates on grades, in sags and over crests, and in bends.

Grades are those of a drive through ``graded_motorway``: a frame counts to a grade if the road keeps it for the next
150 m, else to a sag or a crest; where it ends within V_met (at least 250 m), grass lies behind it, and the frame counts
with the end. Bends of 400 and 800 m to either side are drawn by a renderer that is not FogSim's
(`tests/pictures/flat_road.py`), level and in a sag, for four cameras whose pitch is off by 0.1°. For each visibility,
kind of road and method: frames, share of valid ones, median of the error of V_met [%] with its sign, median and 95th
percentile of its amount, and how often the 90 % interval held the truth. ``belief`` is what the grid filter makes of
all of them on the drive.
"""

import math
import sys
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "pictures"))

from flat_road import Road, photograph, scan
from harness import Row, lines_of, mean, median, parse_options, publish, quantile
from target_pictures import CAMERAS, PITCH_DEVIATION

import fogsim
from fogsim.estimators import make
from fogsim.scenario import build
from fogsim.traffic.road.network import read_net, road_network
from fogsim.values import Observation, Step

SCENARIO = "graded_motorway"
METHODS = ("joint_road", "negru2013", "zhu2015", "huang2015")
AHEAD = 150.0
"""How far the road must keep its grade [m]."""
END = 250.0
"""Least way before the road's end on which its end shows [m]."""

CURVED = 0.002
"""Change of the grade on the way from which the road is a sag or a crest [-]."""

BENDS = {
    "bend 400 m": {"bend": 1.0 / 400.0},
    "bend 800 m": {"bend": 1.0 / 800.0},
    "bend 400 m, sag": {"bend": 1.0 / 400.0, "sag": 1.0 / 8800.0},
}
"""Drawn roads, their curvatures [1/m]; every other one bends to the right."""


Found = tuple[float, float, float]
"""A visibility and its 90 % interval [m]."""


class Profile:
    """Grades of the scenario's road by the distance along it."""

    def __init__(self) -> None:
        route = road_network(read_net(build.traffic_setup(fogsim.load_scenario(SCENARIO)).net), ("road",)).route
        steps = np.diff(route, axis=0)
        self._station = np.cumsum(np.linalg.norm(steps, axis=1))
        self._grade = steps[:, 2] / np.hypot(steps[:, 0], steps[:, 1])

    def kind(self, station: float, visibility: float) -> str:
        """What the road ahead of a place is, as far as one sees [m]."""
        if station + max(visibility, END) > self._station[-1]:
            return "end"
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
    profile = Profile()
    found: dict[tuple[str, str], list[Found | None]] = {}
    for step in fogsim.run(fogsim.load_scenario(SCENARIO, settings), seed):
        for name, one in found_in(step):
            found.setdefault((profile.kind(step.route_position, visibility), name), []).append(one)
    return found


def draw_bends(visibilities: list[float], seed: int, drawings: int) -> dict[tuple[float, str, str], list[Found | None]]:
    """What is found in bends, by visibility, kind of road and method."""
    found: dict[tuple[float, str, str], list[Found | None]] = {}
    for kind, (name, course) in enumerate(BENDS.items()):
        for number in range(drawings * len(CAMERAS)):
            told, rng = CAMERAS[number % len(CAMERAS)], np.random.default_rng([seed, kind, number])
            side = 1.0 if number // len(CAMERAS) % 2 else -1.0
            true = replace(told, pitch=told.pitch + math.radians(rng.normal(0.0, PITCH_DEVIATION)))
            road = Road(camera=true, **course).but(bend=side * course["bend"])
            drawing = scan(road, int(rng.integers(2**31)), 3)
            for visibility in visibilities:
                image = photograph(road.but(visibility=visibility), drawing, int(rng.integers(2**31)))
                for method in METHODS:
                    one = make(method, told).update(Observation(image))
                    told_by = (one.visibility, *one.visibility_interval) if one.valid else None
                    found.setdefault((visibility, name, method), []).append(told_by)
    return found


def record(visibility: float, kind: str, method: str, found: Iterable[Found | None]) -> Row:
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
        "bias": median(error, 1),
        "median": median(np.abs(error), 1),
        "p95": quantile(np.abs(error), 0.95, 1),
        "held": mean(held, 2),
    }


def table(records: list[Row]) -> list[str]:
    """Lines of the docs' table: median/p95 and share held, by road and visibility."""
    methods, visibilities = (*METHODS, "belief"), sorted({row["V_met"] for row in records}, key=str)
    rows = []
    for road in dict.fromkeys(str(row["road"]) for row in sorted(records, key=lambda row: "bend" in str(row["road"]))):
        for visibility in visibilities:
            told = {row["method"]: row for row in records if (row["road"], row["V_met"]) == (road, visibility)}
            cells = (
                f"{row['median']}/{row['p95']} ({row['held']})" if (row := told.get(method)) and row["held"] else ""
                for method in methods
            )
            rows.append((road, f"{visibility:.0f} m", *cells))
    return lines_of(("road", "V_met", *methods), rows)


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        docs=("benchmarks/estimators.md", "grades"),
        visibility=([100.0, 200.0, 300.0, 500.0], "V_met [m]"),
        seed=(1, "seed of the drive"),
        duration=(180.0, "longest simulated time [s]"),
        drawings=(4, "drawings of each bend and camera"),
    )
    records = [
        record(visibility, kind, method, found)
        for visibility in given.visibility
        for (kind, method), found in sorted(drive(visibility, given.seed, given.duration).items())
    ]
    bends = draw_bends(given.visibility, given.seed, given.drawings)
    records += [record(*key, found) for key, found in bends.items()]
    publish(given, records, docs=table)


if __name__ == "__main__":
    main()
