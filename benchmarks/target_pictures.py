"""Pictures for `estimator_targets.py`, none of them FogSim's own, and what the daytime estimators make of each.

A unit is one drawing (kind and number); fog, exposure and noise are laid on it many times over. Its rows say to which
target and cell an estimate belongs, by what cells are distinguished further, and how far it is off.
"""

import math
import sys
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "pictures"))

import stripes
import windscreen
from flat_road import Road, photograph, scan
from harness import Row

from fogsim.estimators import make
from fogsim.estimators.zhu2015 import zhu_category
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import Camera, LeadMeasurement, Observation, Response
from fogsim.values.estimate import NORMAL_90_PERCENT
from fogsim.vision.light.luminance import linear_pixels
from fogsim.vision.lines.horizon import Horizon, calibrated_horizon, levelled
from fogsim.vision.lines.road_lines import road_vanishing_point

CAMERAS = (
    Camera(688, 515, 700.0, (343.5, 257.0), 1.3, math.radians(2.0)),
    Camera(640, 480, 577.0, (319.5, 239.5), 1.38, math.radians(2.0), response=Response.SRGB),
    Camera(320, 240, 288.0, (159.5, 119.5), 1.38, math.radians(2.0), response=Response.GAMMA),
    Camera(800, 400, 1400.0, (399.5, 150.0), 2.1, math.radians(1.0), response=Response.SRGB),
)
AIRLIGHT_LEVELS = (120.0, 200.0, 255.0)
VISIBILITIES = (30.0, 60.0, 100.0, 170.0, 300.0, 400.0, 600.0, 1000.0)
THIN, THINNEST_WITH_LEAD = 300.0, 400.0
"""Visibility up to which the road fit's first target holds, and up to which that with a vehicle ahead does [m]."""

CLASSES = ((30.0, 95.0), (105.0, 285.0), (315.0, 950.0), (1050.0, 10_000.0))
"""Visibilities of zhu2015's classes, as far as they are 5 % off an edge [m]."""

PITCH_DEVIATION = 0.1  # of the true pitch about the told one [deg]
LEAD, SAMPLES = 25.0, 2
SCENES: dict[str, dict[str, Any]] = {
    "lane marks": {},
    "albedo drift": {"drift": 0.15},
    "vehicle at 25 m": {"lead_distance": LEAD},
    "verge": {"verge": True},
}
WINDSCREEN, STRIPES = "windscreen", "stripes"
KINDS = (*SCENES, WINDSCREEN, STRIPES)
AT_RANDOM, IN_THE_WAY = 4, 2  # pictures of a unit behind a windscreen

Image = NDArray[np.uint8]


def measure_unit(kind: str, number: int, seed: int) -> list[Row]:
    """All rows of one drawing."""
    if kind == WINDSCREEN:
        return behind_windscreen(number, seed)
    if kind == STRIPES:
        return [of_stripes(number, seed)]
    return on_flat_road(kind, number, np.random.default_rng([seed, KINDS.index(kind), number]))


def on_flat_road(kind: str, number: int, rng: np.random.Generator) -> list[Row]:
    """A road under every fog: the joint fit, the lines' vanishing point and, where nothing else is seen, the class."""
    told = CAMERAS[number % len(CAMERAS)]
    gain = AIRLIGHT_LEVELS[number // len(CAMERAS) % len(AIRLIGHT_LEVELS)] / 200.0
    true = replace(told, pitch=told.pitch + math.radians(rng.normal(0.0, PITCH_DEVIATION)))
    road = Road(camera=true, **SCENES[kind])
    paint = float(rng.choice([30.0, 170.0]))
    lights = ("airlight", "asphalt", "mark", "terrain")
    road = road.but(**{name: gain * getattr(road, name) for name in lights}, lead_paint=gain * paint)
    drawing, rows = scan(road, int(rng.integers(2**31)), SAMPLES), []
    within = {"camera": f"{told.width}×{told.height}", "airlight": f"{255 * gain * 200 / 255:.0f}"}
    if kind == "vehicle at 25 m":
        within["paint"] = "dark" if paint < 100 else "bright"
    for visibility in VISIBILITIES:
        image = photograph(road.but(visibility=visibility), drawing, int(rng.integers(2**31)))
        fog = within | {"V": f"{visibility:.0f} m"}
        rows.append(horizon_row(image, told, true, f"{kind}, V {visibility:.0f} m", within))
        rows += [fitted | {"within": fog} for fitted in road_fits(kind, image, told, visibility)]
    if kind == "lane marks":
        for low, high in CLASSES:
            visibility = float(np.exp(rng.uniform(math.log(low), math.log(high))))
            image = photograph(road.but(visibility=visibility), drawing, int(rng.integers(2**31)))
            rows.append(class_row(image, told, visibility, within))
    return rows


def road_fits(kind: str, image: Image, told: Camera, visibility: float) -> list[Row]:
    """What the joint fit makes of a picture, by target and cell."""
    cell = "V 30–300 m" if visibility <= THIN else "V 300–1000 m"
    if kind == "lane marks":
        return [fit_row("road to 300" if visibility <= THIN else "road to 1000", cell, image, told, 3.0 / visibility)]
    if kind == "albedo drift":
        return [fit_row("drift", cell, image, told, 3.0 / visibility)]
    if kind == "vehicle at 25 m" and visibility <= THINNEST_WITH_LEAD:
        cells = {"V 30–400 m, range told": LeadMeasurement(LEAD, 0.0), "V 30–400 m, range untold": None}
        return [fit_row("lead", name, image, told, 3.0 / visibility, lead) for name, lead in cells.items()]
    return []


def fit_row(
    target: str, cell: str, image: Image, told: Camera, truth: float, lead: LeadMeasurement | None = None
) -> Row:
    """One joint fit; an error is that of V_met, in per cent."""
    found = make("joint_road", told).update(Observation(image, lead=lead))
    # Clear air seen where there is fog is an error without end: it must not be left out of a percentile.
    error = 100.0 * abs(truth / found.extinction - 1.0) if found.extinction > 0 else math.inf
    covered = abs(found.extinction - truth) <= NORMAL_90_PERCENT * found.standard_deviation
    return row(target, cell, found.valid, error, bool(covered))


def horizon_row(image: Image, told: Camera, true: Camera, cell: str, within: dict[str, str]) -> Row:
    """Where the road's lines meet; an error is that of the horizon's row, in pixels."""
    pixels = linear_pixels(levelled(image, told), told)
    return met_row(road_vanishing_point(pixels, told, calibrated_horizon(told)), true.horizon_row, cell, within)


def met_row(point: Any, truth: float, cell: str, within: dict[str, str]) -> Row:
    """Row of a vanishing point or of none."""
    if point is None:
        return row("horizon", cell, False, 0.0, False) | {"within": within}
    error = abs(point.row - truth)
    return row("horizon", cell, True, error, error <= NORMAL_90_PERCENT * point.row_deviation) | {"within": within}


def class_row(image: Image, told: Camera, visibility: float, within: dict[str, str]) -> Row:
    """zhu2015's class of one frame; an error is 1 if it is wrong."""
    found, right = make("zhu2015", told).update(Observation(image)), zhu_category(visibility)
    wrong = float(found.diagnostics.get("class") != right)
    return row("classes", right.value, found.valid, wrong, False) | {"within": within, "covered": None}


def row(target: str, cell: str, valid: bool, error: float, covered: bool) -> Row:
    """One estimate; of one that is not valid nothing further is said."""
    # JSON knows no infinity.
    told = (min(error, 1e9), covered) if valid else (None, None)
    return {"target": target, "cell": cell, "within": {}, "valid": valid, "error": told[0], "covered": told[1]}


def behind_windscreen(number: int, seed: int) -> list[Row]:
    """Scenes at random, and the plain scene with one thing in the way."""
    rows, first = [], 5000 + 100_000 * seed + 1000 * number
    for drawn, scene, told in islice(windscreen.small_scenes(first), AT_RANDOM):
        if not VISIBILITIES[0] <= scene.visibility <= VISIBILITIES[-1]:
            continue
        thin = scene.visibility > THIN
        image, fog = windscreen.draw(scene, drawn), "V 300–1000 m" if thin else "V 30–300 m"
        within = {"camera": f"{told.width}×{told.height}", "lane marks": "yes" if scene.mark_width else "no"}
        truth = math.log(20.0) / scene.visibility
        target, cell = "road to 1000" if thin else "road to 300", f"behind a windscreen, at random, {fog}"
        rows.append(fit_row(target, cell, image, told, truth) | {"within": within})
        rows.append(horizon_row(image, told, scene.camera, f"behind a windscreen, {fog}", within))
    for i in range(IN_THE_WAY):
        turn = IN_THE_WAY * number + i
        changes = windscreen.IN_THE_WAY[turn % len(windscreen.IN_THE_WAY)]
        scene = replace(windscreen.PLAIN, **changes)
        image, truth = windscreen.draw(scene, first + i), OPTICAL_DEPTH_AT_VISIBILITY / scene.visibility
        thin, cell = scene.visibility > THIN, "behind a windscreen, one thing in the way, V 60–300 m"
        if not thin:
            fitted = fit_row("road to 300", cell, image, windscreen.PLAIN.camera, truth)
            rows.append(fitted | {"within": {"change": ", ".join(f"{k}={v}" for k, v in changes.items())}})
    return rows


def of_stripes(number: int, seed: int) -> Row:
    """Painted stripes without fog, and a guess of the horizon that is off."""
    rng = np.random.default_rng([seed, KINDS.index(STRIPES), number])
    guess, deviation = stripes.ROW + rng.normal(0.0, 1.5), 1.5
    told = Camera(640, 300, 600.0, (325.0, guess), 1.4)
    pixels = np.clip(np.rint(stripes.road_lines(seed=int(rng.integers(2**31)))), 0, 255).astype(np.uint8)
    point = road_vanishing_point(linear_pixels(pixels, told), told, Horizon(guess, deviation))
    return met_row(point, stripes.ROW, "painted stripes, no fog", {})
