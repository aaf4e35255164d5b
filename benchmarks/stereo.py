"""Fog by two cameras: error, intervals, and cost.

Drives on straight and graded motorways and in a city, in traffic, in fog from 50 to 600 m. Of the rig: a baseline of
0.5 m (pool 1: 0.4 m) whose calibration is 1 % wrong, and whose relative yaw and pitch are wrong by 0.005 and
0.02 degrees. For each visibility:

``valid`` share of pictures with an extinction; of the others, how often its bound holds
``error``      |V_told − V_true| / V_true, median and 95th percentile, and how often the 90 % interval held the truth
``published``  the same of the farthest thing of 5 % contrast, as published
``joint``      the same of `joint_road`, by the first of the two cameras

``ms`` is the time of one estimate, ``ms_rig`` how much longer a step takes with a second camera than without. Constants
were chosen on pool 0 (other seeds, rigs and visibilities); pool 1 is what is reported.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial

from harness import Row, lines_of, mean, median, parse_options, progress, publish, quantile, timed

import fogsim
from fogsim.estimators import make
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import Estimate, Step

VISIBILITIES = ((60.0, 100.0, 180.0, 240.0, 500.0), (50.0, 80.0, 120.0, 150.0, 200.0, 300.0, 600.0))
SCENARIOS = ("motorway_fog_bank", "graded_motorway", "city_fog")
CAMERAS = (
    ("camera.width=640", "camera.height=480", "camera.stereo.baseline_m=0.5"),
    ("camera.width=800", "camera.height=600", "camera.field_of_view_deg=50", "camera.stereo.baseline_m=0.4"),
)
ERRORS = (
    "camera.stereo.baseline_error_percent=1",
    "camera.stereo.yaw_error_deg=0.005",
    "camera.stereo.pitch_error_deg=0.02",
)
CLOCKS = ("clocks.camera_period_s=1", "clocks.decision_period_s=1", "duration_s=15", "traffic.events=[]", "expect={}")
METHODS = ("hautiere2006_stereo", "as published", "joint_road")


@dataclass(slots=True)
class Found:
    """What a method made of the pictures of one visibility."""

    errors: list[float] = field(default_factory=list)
    held: list[bool] = field(default_factory=list)
    bounds: list[bool] = field(default_factory=list)
    silent: int = 0
    spent: list[float] = field(default_factory=list)

    def judge(self, told: Estimate, true: float) -> None:
        """Hold an estimate against the true extinction [1/m]."""
        if not told.valid:
            self.silent += 1
            if told.bounds is not None:
                soft = math.exp(1.6449 * told.bounds.softness)
                self.bounds.append(told.bounds.least / soft <= true <= told.bounds.most * soft)
            return
        low, high = told.visibility_interval
        self.errors.append(100.0 * abs(true / max(told.extinction, 1e-6) - 1.0))
        self.held.append(low <= OPTICAL_DEPTH_AT_VISIBILITY / true <= high)

    @property
    def pictures(self) -> int:
        """How many."""
        return self.silent + len(self.errors)


def steps_of(scenario: str, visibility: float, pool: int, *, rig: bool) -> Iterator[Step]:
    """A drive, with the rig or without its second camera."""
    camera = [one for one in (*CAMERAS[pool], *ERRORS) if rig or "stereo" not in one]
    settings = [*CLOCKS, *camera, f"fog={{visibility_m: {visibility}}}", "estimators=[negru2013]"]
    yield from fogsim.run(fogsim.load_scenario(scenario, settings), int(visibility) + 1000 * pool)


def follow(steps: Sequence[Step], found: dict[str, Found]) -> None:
    """Let the methods read a drive."""
    camera = steps[0].observation.frame.camera
    told = {
        "hautiere2006_stereo": make("hautiere2006_stereo", camera),
        "as published": make("hautiere2006_stereo", camera, as_published=True),
        "joint_road": make("joint_road", camera),
    }
    for step in steps:
        for name, method in told.items():
            estimate, spent = timed(partial(method.update, step.observation))
            found[name].spent.append(spent)
            found[name].judge(estimate, step.truth.extinction_ahead)


def second_camera_ms(pool: int) -> float:
    """How much longer a step takes with a second camera [ms]: least times of drives, which have the same traffic."""
    least = []
    for rig in (False, True):
        drives = (timed(lambda rig=rig: len(list(steps_of(SCENARIOS[0], 150.0, pool, rig=rig)))) for _ in range(3))
        least.append(min(spent / count for count, spent in drives))
    return least[1] - least[0]


def record(visibility: float, name: str, one: Found, pool: int) -> Row:
    """A record of one method in fog of one visibility."""
    row: Row = {"pool": pool, "visibility_m": visibility, "method": name, "pictures": one.pictures}
    row |= {"valid": len(one.errors) / one.pictures, "ms": median(one.spent)}
    if one.bounds:
        row["bounds_held"] = mean(one.bounds)
    if one.errors:
        row |= {"median_pct": median(one.errors), "p95_pct": quantile(one.errors, 0.95), "coverage": mean(one.held)}
    return row


def cell(row: Row) -> str:
    """What a method makes of one visibility, in a cell of the table."""
    if "median_pct" not in row:
        return "no estimate"
    silent = f", valid {row['valid']:.2f}" if row["valid"] < 1.0 else ""
    return f"{row['median_pct']:.0f} / {row['p95_pct']:.0f} ({row['coverage']:.2f}){silent}"


def table(rows: Sequence[Row]) -> list[str]:
    """Lines of the table, and what an estimate and a second camera cost."""
    seen = sorted({row["visibility_m"] for row in rows})
    body = [(f"{one:.0f} m", *(cell(row) for row in rows if row["visibility_m"] == one)) for one in seen]
    cost = f"One estimate takes {rows[0]['ms']:.0f} ms, the second picture {rows[0]['ms_rig']:.0f} ms a step."
    return [*lines_of(("V_met", *METHODS), body), "", cost]


def main() -> None:
    """Measure and print."""
    given = parse_options(__doc__, docs=("benchmarks/estimators.md", "stereo"), pool=1)
    rows: list[Row] = []
    for visibility in progress(VISIBILITIES[given.pool], "visibilities"):
        found = {name: Found() for name in METHODS}
        for scenario in SCENARIOS:
            follow(list(steps_of(scenario, visibility, given.pool, rig=True)), found)
        rows += [record(visibility, name, one, given.pool) for name, one in found.items()]
    cost = second_camera_ms(given.pool)
    rows = [row | {"ms_rig": cost} for row in rows]
    publish(given, rows, table)


if __name__ == "__main__":
    main()
