"""Accuracy of the estimators that look at signs, over drives past signs in fog.

Each drive passes three signs, 120 m apart, of six kinds, at 20 m/s, a frame every 3 m (f = 1400 px; airlight at 120,
200 or 255 levels). The map errs by 0.5 m along and across a sign (one standard deviation each, the same all the way),
the fix by 0.2 m and the heading by 0.2° from frame to frame, the pitch by 0.1° over the drive; with `--wrong` that
share of signs is missing, moved by 15 m along the road, turned by 40° or of another kind. Errors are |V_est − V| / V
of every valid estimate, `final` of the last one of a drive; `coverage` is the share of 90 % intervals of k that hold
the truth, `bounds` the share of bounds that do. Constants were chosen on `--pool 0`; what is reported is of `--pool
1`.
"""

import itertools
import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from harness import Row, lines_of, mean, parse_options, publish

from fogsim.calibration.sign_calibration import PoseNoise, SignDrive, measure_operating_range, observed
from fogsim.estimators.protocol import Estimator
from fogsim.estimators.signs.belaroussi2015 import Belaroussi2015
from fogsim.estimators.signs.sign_contrast import SignContrast
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, Estimate, Observation, Response, Sign
from fogsim.values.estimate import NORMAL_90_PERCENT

CAMERA = Camera(560, 260, 1400.0, (90.0, 190.0), 1.38, math.radians(0.5), response=Response.SRGB)
"""The right part of a picture of 1400 × 600 pixels about the horizon."""

NOISE = PoseNoise(fix=0.2)
KINDS = ("speed_limit", "stop", "warning", "no_entry", "no_overtaking", "priority_road")
FIRST, APART, REACH = 160.0, 120.0, 150.0  # [m]
WRONG = ("missing", "moved", "turned", "another kind")


class Post(NamedTuple):
    """A sign as it stands (None if it is missing), and as the map has it."""

    true: Sign | None
    known: Sign


@dataclass(frozen=True, slots=True)
class Drive:
    """What is driven."""

    signs: int = 3  # how many signs are driven past
    step: float = 3.0  # way between two frames [m]
    wrong_share: float = 0.0  # share of signs that are not what the map says [-]
    kinds: tuple[str, ...] = KINDS  # their kinds


def posts(drive: Drive, rng: np.random.Generator) -> list[Post]:
    """Signs along the road; the map errs by 0.5 m along and across."""
    found = []
    for i in range(drive.signs):
        kind = str(rng.choice(drive.kinds))
        place = (FIRST + APART * i + rng.uniform(-10, 10), rng.uniform(-6.5, -4.5), rng.uniform(2.0, 2.6))
        standing = Sign(f"s{i}", kind, float(rng.choice([50, 80, 100])) / 3.6, place, 0.0, 0.9)
        x, y, z = place
        known = replace(standing, position=(x + rng.normal(0, 0.5), y + rng.normal(0, 0.5), z + rng.normal(0, 0.1)))
        # Drawn always, so that drives with and without wrong signs are the same otherwise.
        is_wrong, how, by = rng.uniform() < drive.wrong_share, str(rng.choice(WRONG)), float(rng.choice([-1.0, 1.0]))
        found.append(Post(wronged(standing, how, by) if is_wrong else standing, known))
    return found


def wronged(sign: Sign, how: str, by: float) -> Sign | None:
    """A sign that is not what the map says."""
    x, y, z = sign.position
    if how == "missing":
        return None
    if how == "moved":
        return replace(sign, position=(x + 15.0 * by, y, z))
    if how == "turned":
        return replace(sign, heading=math.radians(40.0) * by)
    return replace(sign, kind=KINDS[(KINDS.index(sign.kind) + (2 if by > 0 else 3)) % len(KINDS)])


def drives(drive: Drive, visibilities: tuple[float, ...], seed: tuple[int, ...]) -> Iterator[dict[float, Observation]]:
    """Observations of one drive, frame by frame, in every fog."""
    rng = np.random.default_rng(seed)
    along = posts(drive, rng)
    standing, known = tuple(p.true for p in along if p.true is not None), tuple(p.known for p in along)
    places = tuple(float(x) for x in np.arange(0.0, known[-1].position[0] - 5.0, drive.step))
    grey = float(rng.choice((120.0, 200.0, 255.0)))
    return observed(SignDrive(CAMERA, standing, places, NOISE, grey, REACH, known), visibilities, rng)


METHODS = ("sign_contrast", "belaroussi2015", "belaroussi2015, published")
VISIBILITIES = (60.0, 100.0, 150.0, 200.0, 300.0, 400.0)

Estimates = dict[tuple[str, float], list[list[Estimate]]]


def driven(pool: int, count: int, wrong: float, visibilities: Sequence[float]) -> Estimates:
    """Estimates by method and visibility, drive by drive."""
    estimates: Estimates = defaultdict(list)
    measured = measure_operating_range(CAMERA, 0.9, seed=0)
    make = {
        "sign_contrast": lambda: SignContrast(CAMERA),
        "belaroussi2015": lambda: Belaroussi2015(CAMERA).calibrated(measured),
        "belaroussi2015, published": lambda: Belaroussi2015(CAMERA, as_published=True).calibrated(measured),
    }
    for number in range(count):
        made: dict[tuple[str, float], Estimator] = {(n, v): make[n]() for n in METHODS for v in visibilities}
        for key in made:
            estimates[key].append([])
        for seen in drives(Drive(wrong_share=wrong), tuple(visibilities), (pool, number)):
            for key, estimator in made.items():
                estimates[key][-1].append(estimator.update(seen[key[1]]))
    return estimates


def records(estimates: Estimates, wrong: float) -> Iterator[Row]:
    """One record a method and visibility."""
    for (name, visibility), found in estimates.items():
        k = extinction_from_visibility(visibility)
        valid = [[one for one in drive if one.valid] for drive in found]
        every = [one for drive in valid for one in drive]
        errors = [abs(one.visibility / visibility - 1.0) for one in every]
        last = [abs(drive[-1].visibility / visibility - 1.0) for drive in valid if drive]
        held = [abs(one.extinction - k) <= NORMAL_90_PERCENT * one.standard_deviation for one in every]
        bounds = [one.bounds for drive in found for one in drive if one.bounds is not None]
        yield {
            "method": name,
            "wrong_share": wrong,
            "visibility": visibility,
            "drives": len(found),
            "valid_drives": len(last),
            "median_pct": _percent(errors, 50),
            "p95_pct": _percent(errors, 95),
            "final_median_pct": _percent(last, 50),
            "final_p95_pct": _percent(last, 95),
            "bias_pct": _percent([one.visibility / visibility - 1.0 for one in every], 50),
            "coverage": mean(held, 3),
            "bounds": mean([0.9 * b.least <= k <= 1.1 * b.most for b in bounds], 3),
        }


def _percent(values: list[float], percentile: float) -> float | None:
    return round(100.0 * float(np.percentile(values, percentile)), 2) if values else None


def docs_table(found: list[Row]) -> list[str]:
    """Lines of the table of docs/benchmarks/estimators.md: `sign_contrast` with right signs, and with wrong ones."""
    by_cell = {(one["visibility"], one["wrong_share"]): one for one in found if one["method"] == "sign_contrast"}
    shares = list(dict.fromkeys(share for _, share in by_cell))
    heads = ["V_met, m", "median/p95, %", "90 % intervals hold"]
    for share in shares[1:]:
        heads += [f"with {100 * share:.0f} % of signs wrong", "intervals hold"]
    rows = []
    for visibility in dict.fromkeys(visibility for visibility, _ in by_cell):
        cells = [by_cell[visibility, share] for share in shares]
        parts = ((f"{one['median_pct']:.1f}/{one['p95_pct']:.1f}", f"{one['coverage']:.2f}") for one in cells)
        rows.append((f"{visibility:.0f}", *itertools.chain(*parts)))
    return lines_of(heads, rows)


def main() -> None:
    """Measure and print."""
    given = parse_options(
        __doc__,
        docs=("benchmarks/estimators.md", "sign estimators"),
        pool=(1, "which drives"),
        drives=(8, "how many of them"),
        wrong=([0.0, 0.2], "shares of signs that are wrong"),
        visibilities=(list(VISIBILITIES), "V_met [m]"),
    )
    found = [
        record
        for wrong in given.wrong
        for record in records(driven(given.pool, given.drives, wrong, given.visibilities), wrong)
    ]
    publish(given, found, docs=docs_table)


if __name__ == "__main__":
    main()
