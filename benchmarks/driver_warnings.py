"""How early the driver is warned of a fog bank, and how often of fog that is not there.

Leads are those of the demo's motorway by day with a camera of 320×240 and clear air (20 km) outside the bank, one drive
for each seed. False warnings are counted on a motorway of 22 km with a bend and traffic, in clear air, haze and even
fog, 10 min to a drive. There the camera takes one frame a second, so that five hours take about 4 min on one core;
denser fog is then announced by two successive frames in place of most of eleven. Leads and false warnings are those of
the metrics `fog_warning_lead_m` and `false_fog_warnings`. The constants of `fogsim.advice.warning` were chosen on other
seeds (101 to 106, and 301 to 308 of even fog).

`--keep FILE` writes what is measured to a file as it comes; a later call goes on from there.
"""

import argparse
import statistics
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from harness import Kept, Row, lines_of, parse_options, progress, publish

import fogsim
from fogsim.metrics import RunMetrics

BANK = ("camera.width=320", "camera.height=240", "fog.outside_visibility_m=20000", "end_when=ego.position > 1350 m")
FOGS = (20_000, 5000, 3000, 1500, 400, 300, 200, 150, 100, 60)
"""Visibilities of the drives without a bank [m]."""

ROAD = """
name: long_road
duration: 10 min
clocks: {traffic_step: 1 s, camera_period: 1 s, decision_period: 1 s}
road: {template: motorway, length: 22 km, limit: 130 km/h, curve_at: 1500 m, curve_radius: 1500 m, curve_turn: 30 deg}
demand: {same_way: 900 veh/h, oncoming: 900 veh/h, mix: {truck: 15 %, van: 10 %}}
actors:
  ego: {position: 200 m, speed: 110 km/h}
fog: {visibility: 20 km}
camera: {width: 320, height: 240, field_of_view: 58 deg, pitch: 2 deg}
estimators: [joint_road, lead_contrast]
fusion: field_filter
advice: {method: stopping_sight_distance, parameters: {reaction_time: 2.0, deceleration: 3.4}}
"""
"""Camera, estimators, fusion and advice are those of the demo."""


def drives(seeds: int, number: int) -> Iterator[tuple[str, int, int]]:
    """Every drive: what it is of, visibility outside the bank [m] and seed."""
    for seed in range(1, seeds + 1):
        yield "bank", 20_000, seed
    for seed in range(1, number + 1):
        for visibility in FOGS:
            yield "even", visibility, seed


def measure(about: str, visibility: int, seed: int, road: Path) -> Row:
    """Warnings of a drive."""
    if about == "bank":
        scenario = fogsim.load_scenario("motorway_fog_bank", BANK)
    else:
        scenario = fogsim.load_scenario(road, [f"fog.visibility_m={visibility}"])
    metrics = RunMetrics(names=("motion", "fog_warnings"))
    for step in fogsim.run(scenario, seed):
        metrics.update(step)
    values = metrics.summary().values
    kept = ("duration_s", "distance_m", "fog_warning_lead_m", "false_fog_warnings", "fog_ahead_time_share")
    return {"about": about, "visibility_m": visibility, "seed": seed} | {
        key: values[key] for key in (*kept, "cannot_see_time_share", "camera_degraded_time_share")
    }


def rows(given: argparse.Namespace) -> list[Row]:
    """What was kept, and what is measured now."""
    kept, plan = Kept(given.keep, "driver_warnings"), list(drives(given.seeds, given.drives))
    with tempfile.TemporaryDirectory() as folder:
        road = Path(folder) / "scenario.yaml"
        road.write_text(ROAD, encoding="utf-8")
        for drive in progress([one for one in plan if one not in kept.results], "drives"):
            kept.add(drive, measure(*drive, road))
    return [kept.results[drive] for drive in plan]


def records(measured: Sequence[Row]) -> Iterator[Row]:
    """Leads of all drives into the bank, then false warnings by visibility and of all."""
    leads = [row["fog_warning_lead_m"] for row in measured if row["about"] == "bank"]
    false = sum(row["false_fog_warnings"] for row in measured if row["about"] == "bank")
    if leads:
        yield {
            "about": "bank",
            "drives": len(leads),
            "median_m": statistics.median(leads),
            "least_m": min(leads),
            "most_m": max(leads),
            "missed": leads.count(0.0),
            "false": false,
        }
    even = [row for row in measured if row["about"] == "even"]
    for visibility in FOGS if even else ():
        yield summary(f"{visibility} m", [row for row in even if row["visibility_m"] == visibility])
    if even:
        yield summary("all", even)


def summary(about: str, of: Sequence[Row]) -> Row:
    """False warnings of some drives, and the share of their time under each warning."""
    hours = sum(row["duration_s"] for row in of) / 3600.0
    false = sum(row["false_fog_warnings"] for row in of)

    def share(key: str) -> float:
        return float(sum(row[key] * row["duration_s"] for row in of) / 3600.0 / hours)

    return {
        "about": about,
        "hours": hours,
        "km": sum(row["distance_m"] for row in of) / 1000.0,
        "false": false,
        "false_per_h": false / hours,
        "fog_ahead_share": share("fog_ahead_time_share"),
        "cannot_see_share": share("cannot_see_time_share"),
        "camera_degraded_share": share("camera_degraded_time_share"),
    }


def table(found: Sequence[Row]) -> list[str]:
    """Leads in a sentence, false warnings in a table."""
    lines = [
        f"Warned before half of the bank's density, over {one['drives']} seeds: median {one['median_m']:.0f} m, "
        f"{one['least_m']:.0f} to {one['most_m']:.0f} m; {one['missed']} missed, {one['false']} false.\n"
        for one in found
        if one["about"] == "bank"
    ]
    headings = ("visibility", "hours", "km", "false warnings", "per hour", "`fog_ahead`", "`cannot_see`")
    cells = [
        (
            *(one["about"], f"{one['hours']:.1f}", f"{one['km']:.0f}", str(one["false"]), f"{one['false_per_h']:.1f}"),
            *(f"{100.0 * one[key]:.1f} %" for key in ("fog_ahead_share", "cannot_see_share")),
        )
        for one in found
        if one["about"] != "bank"
    ]
    return [*lines, *lines_of(headings, cells)]


def main() -> None:
    """Print the records, or a table."""
    given = parse_options(
        __doc__,
        docs=("explanation/belief.md", "warnings"),
        seeds=(10, "drives into the bank"),
        drives=(3, "drives of 10 min in each even fog"),
        keep=(Path, "file in which to keep what is measured, and from which to go on"),
    )
    found = list(records(rows(given)))
    publish(given, found, table)


if __name__ == "__main__":
    main()
