"""Distances to the flat road below the horizon, in place of a depth map of an open road."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.offline.camera_file import Calibration
from fogsim.offline.image_files import read_image
from fogsim.offline.input_paths import is_video
from fogsim.offline.video_source import VideoFile
from fogsim.values import Camera, CameraPose, Response
from fogsim.values.pinhole import camera_axes

Floats = NDArray[np.float64]

_MOST_UNBENT = 1e-3
"""Largest error of a ray after the lens model [px]; above it the pixel has no ray."""

_MOST_STEPS = 30
"""Steps of Newton's method; about five are enough for lenses of vehicle cameras."""


@dataclass(frozen=True, slots=True)
class RoadPlane:
    """An infinite flat road under a camera, with only sky above the horizon; the yaw changes no distance."""

    calibration: Calibration

    def distance(self) -> Floats:
        """Distance along each pixel's ray to the road (rows, cols) [m]; ``inf`` at and above the horizon.

        A ray d of unit length that points down meets the road at H / −d_z. InputError if the horizon is outside the
        image, or the lens has no ray for a pixel.
        """
        camera, sine = self.calibration.camera, self.sines()
        road = sine < 0.0
        if road.all() or not road.any():
            raise InputError(
                f"the horizon, on row {camera.horizon_row:.1f} at the principal point, is not within the image of rows "
                f"0 … {camera.height - 1}: --road-plane needs both road and sky; check pitch or horizon row, and focal "
                "length"
            )
        return np.where(road, camera.mount_height / np.where(road, -sine, 1.0), math.inf)

    def sines(self) -> Floats:
        """Sines of the elevations of the pixels' rays, (rows, cols); InputError if the lens has no ray for a pixel."""
        camera = self.calibration.camera
        right, down = _unbent_rays(self.calibration)
        across, lower, ahead = camera_axes(camera, CameraPose((0.0, 0.0, camera.mount_height), 0.0))[:, 2].tolist()
        return np.asarray((across * right + lower * down + ahead) / np.sqrt(1.0 + right**2 + down**2))


def _unbent_rays(calibration: Calibration) -> tuple[Floats, Floats]:
    """Each pixel's ray in the camera's axes, right and down per 1 along the axis, without the lens's bending."""
    camera = calibration.camera
    u0, v0 = camera.principal_point
    rows, columns = np.indices((camera.height, camera.width), dtype=np.float64)
    right, down = (columns - u0) / camera.focal_length, (rows - v0) / camera.focal_length
    if not any(calibration.distortion):
        return right, down
    seen = (right, down)
    # Newton's method; Brown's model has no inverse in closed form.
    for _ in range(_MOST_STEPS):
        bent, (same, mixed, other) = _bent(right, down, calibration.distortion)
        off = (bent[0] - seen[0], bent[1] - seen[1])
        determinant = same * other - mixed * mixed
        with np.errstate(all="ignore"):  # where the lens folds the image, which is reported below
            right = right - (other * off[0] - mixed * off[1]) / determinant
            down = down - (same * off[1] - mixed * off[0]) / determinant
    with np.errstate(all="ignore"):
        bent, (same, mixed, other) = _bent(right, down, calibration.distortion)
        close = camera.focal_length * np.hypot(bent[0] - seen[0], bent[1] - seen[1]) < _MOST_UNBENT
        lost = np.count_nonzero(~(close & (same * other > mixed * mixed) & (same > 0.0)))
    if lost:
        raise InputError(
            f"distortion: with {list(calibration.distortion)} the lens shows {lost} of the image's pixels by no ray: "
            f"are they OpenCV's [k1, k2, p1, p2] for this focal length ({camera.focal_length:g} px)?"
        )
    return right, down


def _bent(
    right: Floats, down: Floats, distortion: tuple[float, ...]
) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats, Floats]]:
    """Rays behind the lens by Brown's model, as in `Straightener`, and their derivatives (a symmetric matrix)."""
    k1, k2, p1, p2 = distortion
    square = right**2 + down**2
    radial, growth = 1.0 + square * (k1 + k2 * square), 2.0 * (k1 + 2.0 * k2 * square)
    bent = (
        right * radial + 2.0 * p1 * right * down + p2 * (square + 2.0 * right**2),
        down * radial + p1 * (square + 2.0 * down**2) + 2.0 * p2 * right * down,
    )
    slopes = (
        radial + growth * right**2 + 2.0 * p1 * down + 6.0 * p2 * right,
        growth * right * down + 2.0 * (p1 * right + p2 * down),
        radial + growth * down**2 + 6.0 * p1 * down + 2.0 * p2 * right,
    )
    return bent, slopes


def calibration_from_options(image: Path, horizon_row: float, focal_length: float, mount_height: float) -> Calibration:
    """Minimal calibration for a flat road: a pinhole without roll, its principal point in the image's middle.

    The image or video gives the size; horizon row and focal length are in px, mount height above the road in m.
    """
    for option, value, unit in (("--focal-length", focal_length, "pixels"), ("--mount-height", mount_height, "metres")):
        if not (value > 0.0 and math.isfinite(value)):
            raise InputError(f"{option} must be a positive number of {unit}, got {value!r}")
    columns, rows, eight = _size(image)
    if not 0.0 <= horizon_row <= rows - 1:
        raise InputError(f"--horizon-row must be a row of the image, 0 … {rows - 1}, got {horizon_row!r}")
    response = Response.SRGB if eight else Response.LINEAR
    middle = (0.5 * (columns - 1), 0.5 * (rows - 1))
    pitch = math.atan((middle[1] - horizon_row) / focal_length)
    camera = Camera(columns, rows, focal_length, middle, mount_height, pitch, response=response)
    return Calibration(
        camera, remarks=(f"{image}: a level pinhole whose axis is the middle, response {response.value}",)
    )


def _size(image: Path) -> tuple[int, int, bool]:
    """Columns, rows, and whether pixel values have 8 bits."""
    if is_video(image):
        return *VideoFile.open(image).size, True
    pixels = read_image(image)
    return pixels.shape[1], pixels.shape[0], pixels.dtype == np.uint8
