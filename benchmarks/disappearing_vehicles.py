"""Fog measured by `gabb2014` on vehicles that disappear in it, and that come out of it.

On a straight road a vehicle drives away from 12 m to 199.5 m, or comes near from there: a picture every 2.5 m, half a
second apart, with a sway of 0.07°, a stated pitch off by 0.1° (deviation over drives) and a range with 0.25 m of noise.
Each range is drawn once for a camera and a vehicle and fogged with each visibility; the airlight has 120, 200 or 255
levels. For each visibility:

``bounds``       share of updates in which there is no estimate but bounds, and of those how many hold the truth to
                 their softness (central 90 %)
``at least``     what such bounds say at least, over V (median)
``estimates``    share of updates with an estimate; their error |V_est − V| / V (median, 95th percentile), and how many
                 of their 90 % intervals hold the truth
``drives``       share of drives with an estimate at some time, and the error of the first one
``ms``           median time of an update

Constants were chosen on pool 0 (other cameras and vehicles); pool 1 is what is reported.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from harness import Row, lines_of, mean, median, parse_options, progress, publish, quantile, timed
from lead_accuracy import CAMERAS, OTHERS, SETBACK, VEHICLES

from fogsim.calibration.staged_road import StagedVehicle, road_renderer
from fogsim.estimators import make
from fogsim.estimators.protocol import Estimator
from fogsim.render import Renderer
from fogsim.reproduce.huang2015_chase import FASTER, OWN_SPEED, drawn, fogged
from fogsim.values import Camera, Estimate, Frame, LeadMeasurement, Observation

VISIBILITIES = (60.0, 100.0, 150.0, 250.0)
POOLS = ((tuple(CAMERAS)[1:3], VEHICLES), (tuple(CAMERAS)[::3], OTHERS))
RANGES = np.arange(12.0, 200.1, 2.5)
LEVELS = (120.0, 200.0, 255.0)
SWAY, MISALIGNED, RANGE_NOISE, SPEED_NOISE = math.radians(0.07), math.radians(0.1), 0.25, 0.1


@dataclass(slots=True)
class Found:
    """What came of the drives in one visibility."""

    updates: int = 0
    held: list[bool] = field(default_factory=list)
    least: list[float] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)
    covered: list[bool] = field(default_factory=list)
    first: list[float | None] = field(default_factory=list)
    spent: list[float] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Drive:
    """A drive behind a vehicle: the way its range goes, and the chance in it."""

    camera: Camera
    vehicle: StagedVehicle
    number: int
    away: bool


def drives(pool: int) -> Iterator[Drive]:
    """All drives of a pool."""
    names, vehicles = POOLS[pool]
    for i, name in enumerate(names):
        for j, vehicle in enumerate(vehicles.values()):
            for away in (True, False):
                yield Drive(CAMERAS[name], vehicle, 1000 * pool + 100 * i + 10 * j + away, away)


def follow(renderer: Renderer, drive: Drive, found: dict[float, Found]) -> None:
    """Let the vehicle drive away, or come near, in every visibility."""
    rng = np.random.default_rng(drive.number)
    pitch, left = drive.camera.pitch + MISALIGNED * rng.normal(), 0.3 * rng.normal()
    estimators = {visibility: make("gabb2014", drive.camera, setback=SETBACK) for visibility in found}
    first: dict[float, float | None] = dict.fromkeys(found)
    speed, begin = (FASTER if drive.away else -FASTER), rng.uniform(0.0, 100.0)
    for number, ahead in enumerate(RANGES if drive.away else RANGES[::-1]):
        now = number * float(RANGES[1] - RANGES[0]) / FASTER
        camera = replace(drive.camera, pitch=pitch + SWAY * rng.normal())
        vehicle = replace(drive.vehicle, left=left + 0.05 * rng.normal())
        scene = drawn(renderer, camera, vehicle, float(ahead), begin + now * OWN_SPEED)
        gap = float(ahead) - SETBACK + RANGE_NOISE * float(rng.normal())
        lead = LeadMeasurement(gap, speed + SPEED_NOISE * float(rng.normal()))
        for i, visibility in enumerate(found):
            image = fogged(scene, visibility, LEVELS[(drive.number // 10 + i) % len(LEVELS)], rng)
            seen = Observation(Frame(now, image, drive.camera), OWN_SPEED, lead)
            estimate = judged(estimators[visibility], seen, visibility, found[visibility])
            if estimate.valid and first[visibility] is None:
                first[visibility] = 100.0 * abs(estimate.visibility / visibility - 1.0)
    for visibility, one in found.items():
        one.first.append(first[visibility])


def judged(estimator: Estimator, seen: Observation, visibility: float, found: Found) -> Estimate:
    """One update, held against the truth."""
    estimate, spent = timed(lambda: estimator.update(seen))
    found.spent.append(spent)
    found.updates += 1
    low, high = estimate.visibility_interval
    if estimate.valid:
        found.errors.append(100.0 * abs(estimate.visibility / visibility - 1.0))
        found.covered.append(low <= visibility <= high)
    elif estimate.bounds is not None:
        found.held.append(low <= visibility <= high)
        if low > 0.0:
            found.least.append(low / visibility)
    return estimate


def together(found: dict[float, Found]) -> Found:
    """All visibilities as one."""
    every = Found(sum(one.updates for one in found.values()))
    for name in ("held", "least", "errors", "covered", "first", "spent"):
        getattr(every, name).extend(value for one in found.values() for value in getattr(one, name))
    return every


def record(visibility: str, found: Found, pool: int) -> Row:
    """Flat record of one visibility."""
    first = [error for error in found.first if error is not None]
    return {
        "pool": pool,
        "visibility": visibility,
        "updates": found.updates,
        "bounds_share": len(found.held) / found.updates,
        "bounds_hold": mean(found.held),
        "at_least_over_v": median(found.least),
        "valid_share": len(found.errors) / found.updates,
        "median_pct": median(found.errors),
        "p95_pct": quantile(found.errors, 0.95),
        "coverage": mean(found.covered),
        "drives": len(found.first),
        "drives_share": len(first) / len(found.first),
        "first_median_pct": median(first),
        "ms": median(found.spent),
    }


HEADS = ("V_met, m", "updates", "bounds", "held", "at least")
HEADS += ("estimates", "median/p95, %", "held", "drives", "first", "ms")


def cells(row: Row) -> tuple[str, ...]:
    """A record in cells of the table."""
    bounds, valid, drives = (f"{100.0 * row[key]:.0f} %" for key in ("bounds_share", "valid_share", "drives_share"))
    keys = ("bounds_hold", "at_least_over_v", "coverage")
    hold, least, covered = ("–" if row[key] is None else f"{row[key]:.2f}" for key in keys)
    error = "–" if row["median_pct"] is None else f"{row['median_pct']:.0f}/{row['p95_pct']:.0f}"
    first = "–" if row["first_median_pct"] is None else f"{row['first_median_pct']:.0f} %"
    head = (row["visibility"], str(row["updates"]), bounds, hold, least)
    return (*head, valid, error, covered, drives, first, f"{row['ms']:.1f}")


def main() -> None:
    """Measure and print."""
    given = parse_options(__doc__, docs=("benchmarks/estimators.md", "disappearing vehicles"), pool=1)
    found = {visibility: Found() for visibility in VISIBILITIES}
    with road_renderer() as renderer:
        for drive in progress(list(drives(given.pool)), "drives"):
            follow(renderer, drive, found)
    rows = [record(f"{visibility:g}", one, given.pool) for visibility, one in found.items()]
    rows.append(record("all", together(found), given.pool))
    publish(given, rows, lambda rows: lines_of(HEADS, map(cells, rows)))


if __name__ == "__main__":
    main()
