"""Drives along a foggy road, frame after frame: texture that passes, a body that pitches, a vehicle ahead."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.calibration.staged_road import AIRLIGHT, foggy_radiance, standing_cars
from fogsim.camera import Sensor, expose
from fogsim.render import Renderer
from fogsim.scene import vehicle_batches
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, CameraPose, LeadMeasurement, Observation, View

Floats = NDArray[np.float64]

SPEED, _PERIOD = 20.0, 0.2
"""Speed of the drive [m/s] and time between frames [s]."""

SETBACK = 1.5
"""Distance of the camera behind the front bumper [m]."""

SENSOR = Sensor(saturation_luminance=AIRLIGHT * 255.0 / 200.0)
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
    """The true camera's view of one instant of a drive without air, its pose, and the sensed vehicle ahead, if any.

    The grade of the pose is the pitch that the vehicle does not know of.
    """

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
    moment: Moment, camera: Camera, visibility: float, rng: np.random.Generator, sensor: Sensor = SENSOR
) -> Observation:
    """What the vehicle observes at an instant in homogeneous fog of a visibility [m]; ``inf`` for clear air."""
    radiance = foggy_radiance(moment.view, moment.pose, camera, extinction_from_visibility(visibility))
    image = expose(radiance, sensor, camera.response, rng)
    return Observation(image, speed=SPEED, lead=moment.lead)
