"""What a method of the road makes of what its paper leaves open, camera, wear and noise, and of its own repairs."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.calibration.staged_road import AIRLIGHT, foggy_radiance, standing_cars
from fogsim.camera import Sensor, expose
from fogsim.estimators import make
from fogsim.estimators.repairs import Repair
from fogsim.render import Renderer
from fogsim.reproduce.result import Cell, Rows, Steps, TitledTable
from fogsim.scene import vehicle_batches
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, CameraPose, Estimate, LeadMeasurement, Observation, Response, View

Floats = NDArray[np.float64]

SPEED, _PERIOD = 20.0, 0.2
"""Speed of the drive [m/s] and time between frames [s]."""

SETBACK = 1.5
"""Distance of the camera behind the front bumper [m]."""

_SENSOR = Sensor(saturation_luminance=AIRLIGHT * 255.0 / 200.0)
"""A sensor with noise, exposed such that the airlight has 200 of 255 linear levels."""

_PITCH_ERROR, _PITCH_SWAY = math.radians(0.1), math.radians(0.05)
"""Standard deviations of the pitch about the assumed one: of a whole drive, and from frame to frame [rad]."""

_WEAR, WEAR_LENGTH = 0.03, 40.0
"""Change of the road's albedo along the way, uniform within ± this [-], and the way between two such values [m]."""

_NEAREST, FARTHEST = 20.0, 60.0
"""Gaps that a vehicle ahead begins with [m]; it then drifts by up to 1 m a frame."""

_RANGE_ERROR = 0.3
"""Standard deviation of a tracked range [m]."""

_START, _END = 0.0, 500.0
"""Where drives begin [m]: at least 900 m of road lie ahead."""


@dataclass(frozen=True, slots=True)
class Moment:
    """The true camera's view of one instant without air, its pose with the unknown grade, and the sensed leader."""

    view: View
    pose: CameraPose
    lead: LeadMeasurement | None


def drive(
    renderer: Renderer,
    camera: Camera,
    frames: int,
    *,
    lead: bool,
    rng: np.random.Generator,
    wear: float = _WEAR,
    period: float = _PERIOD,
) -> Iterator[Moment]:
    """Drive along a road with a given wear [-], a frame every `period` [s], with or without a tracked vehicle ahead."""
    front, error = rng.uniform(_START, _END), rng.normal(0.0, _PITCH_ERROR)
    gap, closing = rng.uniform(_NEAREST, FARTHEST), rng.uniform(-1.0, 1.0)
    knots = 1.0 + wear * rng.uniform(-1.0, 1.0, 128)
    for _ in range(frames):
        pose = CameraPose(
            (front - SETBACK, 0.0, camera.mount_height), heading=0.0, grade=error + rng.normal(0.0, _PITCH_SWAY)
        )
        cars = [(front + gap, 0.0)] if lead else []
        view = renderer.render(vehicle_batches(standing_cars(cars), None), camera, pose)
        measured = LeadMeasurement(gap + rng.normal(0.0, _RANGE_ERROR), closing / period) if lead else None
        yield Moment(worn(view, camera, pose, knots), pose, measured)
        front += SPEED * period
        gap = max(gap + closing, 0.5 * _NEAREST)


def worn(view: View, camera: Camera, pose: CameraPose, knots: Floats) -> View:
    """View of a level road along x whose albedo is multiplied by factors `WEAR_LENGTH` apart, straight in between."""
    # A row shows the mean over the piece of road between its borders, which far away is longer than the wear.
    borders = _ahead(np.arange(camera.height + 1, dtype=np.float64) - 0.5, camera, pose) + pose.position[0]
    factor = np.diff(_wear_integral(borders, knots)) / np.diff(borders)
    radiance = np.where(
        (view.instance == ROAD)[:, :, None], view.radiance * factor[:, None, None].astype(np.float32), view.radiance
    )
    return replace(view, radiance=radiance)


ROAD = 2
"""Instance id of road in a `View`."""

_FAR = 20_000.0
"""What lies above the horizon is taken to lie at most this far ahead [m]."""


def _ahead(rows: Floats, camera: Camera, pose: CameraPose) -> Floats:
    """How far ahead the level road is that rows show; strictly falling from the top down [m]."""
    pitch = camera.pitch - pose.grade
    angle = pitch + np.arctan((rows - camera.principal_point[1]) / camera.focal_length)
    ahead = camera.mount_height / np.maximum(np.tan(angle), camera.mount_height / _FAR)
    # Above the horizon all rows lie equally far: a trifle keeps them apart.
    return np.asarray(ahead + 1e-3 * (rows[-1] - rows), np.float64)


def _wear_integral(places: Floats, knots: Floats) -> Floats:
    """Integral of the factor from 0 to each of some places [m]."""
    count = math.ceil(float(places.max()) / WEAR_LENGTH) + 1
    ends = knots[np.arange(count + 1) % knots.size]
    pieces = np.concatenate([[0.0], np.cumsum(0.5 * WEAR_LENGTH * (ends[1:] + ends[:-1]))])
    grid = WEAR_LENGTH * np.arange(count + 1)
    index = np.clip((places / WEAR_LENGTH).astype(np.int64), 0, count - 1)
    along = places - grid[index]
    slope = (ends[index + 1] - ends[index]) / WEAR_LENGTH
    return np.asarray(pieces[index] + along * (ends[index] + 0.5 * slope * along), np.float64)


def observed(
    moment: Moment, camera: Camera, visibility: float, rng: np.random.Generator, sensor: Sensor = _SENSOR
) -> Observation:
    """What the vehicle observes at an instant in homogeneous fog of a visibility [m]; ``inf`` for clear air."""
    radiance = foggy_radiance(moment.view, moment.pose, camera, extinction_from_visibility(visibility))
    image = expose(radiance, sensor, camera.response, rng)
    return Observation(image, speed=SPEED, lead=moment.lead)


CAMERA = Camera(640, 480, 577.0, (319.5, 239.5), mount_height=1.38, pitch=0.035, response=Response.SRGB)
"""That of `zhu2015`'s evaluation, 58° wide: λ = 797 px·m."""

VISIBILITIES = (50.0, 100.0, 200.0, 400.0)
"""Of every drive [m]."""

DRIVES, _FRAMES = 6, 3
"""Drives of each setting, and their frames; the last one's estimate counts."""

GROWTHS = (0.5, 1.0, 2.0, 4.0, 6.0, 8.0, 12.0, 20.0, 40.0)
"""G_max of region growing as published [grey levels]."""

Form = Mapping[str, object]
"""Options of an estimator."""


@dataclass(frozen=True, slots=True)
class Setting:
    """Camera, change of the road's albedo along the way [-], sensor; the true pitch is 0.1° off and sways by 0.05°."""

    name: str
    camera: Camera = CAMERA
    wear: float = 0.03
    sensor: Sensor = _SENSOR


_NOISY = replace(_SENSOR, full_well=_SENSOR.full_well / 16.0, read_noise=4.0 * _SENSOR.read_noise)
"""Four times the noise."""

SETTINGS = (
    Setting("58°, 1.38 m, wear 3 %"),
    Setting("f = 288 px (96°)", replace(CAMERA, focal_length=288.0)),
    Setting("f = 1154 px (31°)", replace(CAMERA, focal_length=1154.0, pitch=0.02)),
    Setting("mounted 2.5 m high", replace(CAMERA, mount_height=2.5)),
    Setting("linear response", replace(CAMERA, response=Response.LINEAR)),
    Setting("no wear", wear=0.0),
    Setting("wear 10 %", wear=0.1),
    Setting("noise × 4", sensor=_NOISY),
)
"""What is varied, one thing at a time."""


@dataclass(frozen=True, slots=True)
class Driven:
    """Observations of one drive in one fog."""

    visibility: float
    observations: tuple[Observation, ...]


def _driven(
    renderer: Renderer, setting: Setting, visibilities: Sequence[float], drives: int, steps: Steps
) -> list[Driven]:
    """Observations of drives along the road alone, in every fog; visibilities in [m]."""
    found = []
    for number in range(drives):
        rng = np.random.default_rng([2013, number])
        moments = list(drive(renderer, setting.camera, _FRAMES, lead=False, rng=rng, wear=setting.wear))
        for visibility in visibilities:
            seen = tuple(observed(moment, setting.camera, visibility, rng, setting.sensor) for moment in moments)
            found.append(Driven(visibility, seen))
        steps.advance()
    return found


def _last_estimate(method: str, camera: Camera, form: Form, one: Driven) -> Estimate:
    """Estimate of a form of a method after the last frame of a drive."""
    estimator = make(method, camera, **form)
    found = [estimator.update(observation) for observation in one.observations]
    return found[-1]


def _without_each(kind: type[Repair]) -> dict[str, Form]:
    """Forms of a method with all repairs, and with all but each."""
    forms: dict[str, Form] = {"all repairs": {}}
    for left_out in kind:
        forms[f"without {left_out.value}"] = {"repairs": [one.value for one in kind if one is not left_out]}
    return forms


def steps_of(drives: int = DRIVES) -> int:
    """Steps that `swept` takes, by drives of each setting."""
    return len(SETTINGS) * drives


def over_growths(name: str, form: Form) -> dict[str, Form]:
    """A form of a method whose region grows with each of `GROWTHS`."""
    return {f"{name}, G_max {growth:g}": {**form, "growth": growth} for growth in GROWTHS}


def swept(
    method: str,
    kind: type[Repair],
    renderer: Renderer,
    steps: Steps,
    drives: int = DRIVES,
    left_open: Mapping[str, Form] | None = None,
) -> tuple[list[dict[str, Cell]], tuple[TitledTable, ...]]:
    """Errors of a method, as published and corrected, over settings, with each repair off, and over what is left open.

    `left_open` has forms with other values of what the paper leaves open, by name; they run in the first setting. A
    record for each setting, form and visibility has the share of drives where fog is found, median error and bias.
    """
    both: dict[str, Form] = {"published": {"as_published": True}, "corrected": {}}
    left_open = left_open or {}
    records: list[dict[str, Cell]] = []
    for setting in SETTINGS:
        seen = _driven(renderer, setting, VISIBILITIES, drives, steps)
        forms = both | ({**_without_each(kind), **left_open} if setting is SETTINGS[0] else {})
        for name, form in forms.items():
            for visibility in VISIBILITIES:
                here = [one for one in seen if one.visibility == visibility]
                estimates = [_last_estimate(method, setting.camera, form, one) for one in here]
                records.append(_record(method, setting, name, visibility, estimates))
    shown = {
        "Sweeps of {}": [(setting.name, name) for setting in SETTINGS for name in both],
        "Repairs of {}, each switched off": [(SETTINGS[0].name, name) for name in ("published", *_without_each(kind))],
        "What the paper of {} leaves open": [(SETTINGS[0].name, name) for name in left_open],
    }
    figures = "|error| of V_met, median [%], and share of drives where fog is found, by V_met"
    return records, tuple(
        TitledTable(f"{title.format(method)}: {figures}", _rows(records, wanted))
        for title, wanted in shown.items()
        if wanted
    )


def _record(
    method: str, setting: Setting, form: str, visibility: float, estimates: Sequence[Estimate]
) -> dict[str, Cell]:
    extinctions = [one.extinction for one in estimates if one.valid and one.extinction > 0.0]
    apart = extinction_from_visibility(visibility) / np.array(extinctions) - 1.0
    return {
        "paper": method,
        "table": "sweep",
        "setting": setting.name,
        "form": form,
        "visibility_m": visibility,
        "told_share": len(extinctions) / len(estimates),
        "median_error_pct": 100.0 * float(np.median(np.abs(apart))) if extinctions else None,
        "bias_pct": 100.0 * float(np.median(apart)) if extinctions else None,
    }


def _rows(records: Sequence[Mapping[str, Cell]], wanted: Sequence[tuple[str, str]]) -> Rows:
    rows = [("setting", "form", *(f"{visibility:.0f} m" for visibility in VISIBILITIES))]
    for setting, form in wanted:
        here = [one for one in records if (one["setting"], one["form"]) == (setting, form)]
        rows.append((setting, form, *(_cell(one) for one in here)))
    return tuple(rows)


def _cell(record: Mapping[str, Cell]) -> str:
    error, share = record["median_error_pct"], record["told_share"]
    return "—" if error is None else f"{error:.1f} ({100.0 * float(share or 0.0):.0f} %)"
