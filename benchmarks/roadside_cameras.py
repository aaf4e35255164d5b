"""Error of what roadside cameras report, and how long an image takes.

Cameras stand every 60 m along the routes of three shipped scenarios, and each takes one image per seed: with other
traffic, trees and noise. For each road and fog: images, share of them that are reported, median and 95th percentile of
the error of V_met [%], and how often its 90 % interval held the truth, which is the mean extinction of the stretch from
the camera on in whose middle a report is. Then come dusk, and the bank of highway_99_corridor itself: 60 m between
1500 and 2700 m, 1 km elsewhere. The time is that of drawing, taking and reading an image by day [ms].

Mount, view and position of the cameras were chosen on ``motorway_fog_bank``, which is not among the roads.
"""

import math
import sys
import time
from collections.abc import Iterator, Sequence

import numpy as np
from harness import parse_options, publish
from numpy.typing import NDArray

import fogsim
from fogsim.atmosphere import extinction, field_at
from fogsim.simulation.ego.equipment import EgoEquipment
from fogsim.simulation.loop import ClosedLoop
from fogsim.simulation.road_sections import stations
from fogsim.values import FogField, FogReport, Step, TrafficState
from fogsim.values.estimate import NORMAL_90_PERCENT

ROADS = ("highway_99_corridor", "a16_netherlands", "graded_motorway")
VISIBILITIES = (60.0, 100.0, 200.0, 400.0, 1000.0)
LIGHT, DUSK = 10_000.0, (10.0, 3.0, 1.0, 0.1)
"""Illuminance by day, and in dusk [lx]."""

SPACING, LEFT_OUT = 60.0, 300.0
"""Distance between cameras, and from the last one to the end of the road [m]."""

QUIET = ("expect={}", "timeline=[]", "advice=none", "lighting=low_beam", "duration_s=1")
SMALL = ("camera.width=80", "camera.height=60")
IN_BANK, OUT_OF_BANK = 61.0, 990.0
"""Visibilities up to which a stretch lies in the bank, and from which it lies outside [m]."""

Sent = tuple[tuple[str, FogReport], ...]

Found = tuple[float, FogReport]
"""True mean extinction of the stretch that a report is of [1/m], and the report."""


def reports(road: str, seed: int, *more: str) -> tuple[int, list[Found]]:
    """How many cameras there are, and what they report at the beginning of a run with more settings."""
    cameras = f"sensors.reports.roadside={{camera: {{}}, every_m: {SPACING}, period_s: 1000, delay_s: 0}}"
    settings = [*QUIET, *SMALL, cameras, f"scenery_seed={seed}", *more]
    with ClosedLoop(fogsim.load_scenario(road, settings)) as loop:
        step = loop.start(seed)
    route, fog_now = step.truth.route, step.truth.fog
    if route is None or fog_now is None:
        raise RuntimeError("a run has a route and a fog")
    length = float(stations(route)[-1])
    heard = [one for one in step.observation.reports if place_of(one) < length - LEFT_OUT]
    return math.ceil((length - LEFT_OUT) / SPACING), [(true_mean(one, route, fog_now), one) for one in heard]


def true_mean(report: FogReport, route: NDArray[np.float64], fog: FogField) -> float:
    """Mean extinction from a camera to as far beyond the place of its report as that is from it [1/m]."""
    at = np.linspace(place_of(report), 2.0 * report.place - place_of(report), 101)
    points = np.stack([np.interp(at, stations(route), axis) for axis in route.T], axis=1)
    return float(extinction(field_at(fog, 0.0), points + np.array([0.0, 0.0, 2.0])).mean())


def place_of(report: FogReport) -> float:
    """Where the camera stands that has sent a report [m]."""
    return SPACING * int(report.source.split()[1])


def row(road: str, fog: str, images: int, found: Sequence[Found]) -> list[str]:
    """One row of the table."""
    if not found:
        return [road, fog, str(images), "0", "–", "–", "–"]
    errors = np.array([100.0 * abs(true / one.extinction - 1.0) for true, one in found])
    held = [abs(math.log(one.extinction / true)) <= NORMAL_90_PERCENT * one.relative_deviation for true, one in found]
    reported = f"{100 * len(found) / images:.0f}" if images else "–"
    figures = f"{np.median(errors):.1f}", f"{np.quantile(errors, 0.95):.1f}", f"{100 * np.mean(held):.0f}"
    return [road, fog, str(images or len(found)), reported, *figures]


def rows(seeds: int) -> Iterator[list[str]]:
    """Rows of the table."""
    airs = [(road, f"{visibility:.0f} m", visibility, LIGHT) for road in ROADS for visibility in VISIBILITIES]
    airs += [(ROADS[0], f"100 m at {light:g} lx", 100.0, light) for light in DUSK]
    for road, told, visibility, light in airs:
        more = f"fog={{visibility_m: {visibility}}}", f"light.illuminance_lx={light}"
        asked = [reports(road, seed, *more) for seed in range(1, seeds + 1)]
        yield row(road, told, sum(images for images, _ in asked), [one for _, heard in asked for one in heard])
    bank = [one for seed in range(1, seeds + 1) for one in reports(ROADS[0], seed)[1]]
    inside = [one for one in bank if math.log(20.0) / one[0] <= IN_BANK]
    outside = [one for one in bank if math.log(20.0) / one[0] >= OUT_OF_BANK]
    yield row(ROADS[0], "in its bank", 0, inside)
    yield row(ROADS[0], "outside it", 0, outside)
    yield row(ROADS[0], "across its edges", 0, [one for one in bank if one not in inside and one not in outside])


def milliseconds() -> float:
    """Time for an image [ms], after those that compile and build."""
    spent: list[float] = []
    look = EgoEquipment.look_from_roadside

    def timed(self: EgoEquipment, at: float, state: TrafficState) -> Sent:
        begun = time.perf_counter()
        found = look(self, at, state)
        spent.append((time.perf_counter() - begun) / max(len(found), 1))
        return found

    EgoEquipment.look_from_roadside = timed
    cameras = f"sensors.reports.roadside={{camera: {{}}, every_m: {SPACING}, period_s: 0.2, delay_s: 0}}"
    scenario = fogsim.load_scenario(ROADS[0], [*QUIET, *SMALL, "fog={visibility_m: 100}", cameras])
    steps: list[Step] = list(fogsim.run(scenario, 1))
    EgoEquipment.look_from_roadside = look
    return 1e3 * float(np.median(spent[1 : len(steps)]))


def main() -> None:
    """Measure and print."""
    docs = ("reference/sensors.md", "roadside cameras")
    given = parse_options(__doc__, docs=docs, seeds=(3, "seeds from 1 on"))
    heads = ("road", "V_met", "images", "reported [%]", "median error [%]", "95th percentile [%]", "held [%]")
    publish(given, [dict(zip(heads, cells, strict=True)) for cells in rows(given.seeds)])
    print(f"{milliseconds():.0f} ms an image", file=sys.stderr)


if __name__ == "__main__":
    main()
