"""Rectification: images as a pinhole along the vehicle's axis would see them, without distortion and yaw."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import matrix_product
from fogsim.core.parameters import checked_parameters
from fogsim.errors import InputError
from fogsim.offline.camera_file import Calibration
from fogsim.offline.image_files import Pixels, read_image
from fogsim.offline.input_paths import is_video
from fogsim.offline.source import Picture, Source
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


Maps = tuple[NDArray[np.int16], NDArray[np.uint16]]
"""Source of each pixel of a rectified image, in OpenCV's fixed-point form."""


class Straightener:
    """Removes lens distortion and yaw from the images of one camera.

    A pixel of the rectified image is a ray of a pinhole of the same focal length, pitch and roll without yaw. The
    ray is rotated into the axes of the real camera, bent by Brown's model of the lens,
    x″ = x′ (1 + k1 r² + k2 r⁴) + 2 p1 x′y′ + p2 (r² + 2 x′²) and y″ alike (OpenCV's `initUndistortRectifyMap`), and the
    image is interpolated there by cubics, which keep detail better than straight lines do. The principal point moves
    sideways by α tan(yaw), so that the image keeps showing what it showed. What it did not show repeats its border.

    Parameters
    ----------
    calibration : Calibration
        The real camera.

    Attributes
    ----------
    calibration : Calibration
        The real camera.
    camera : Camera
        The pinhole of the rectified images.

    Raises
    ------
    InputError
        If the lens folds the image: the model then does not hold.
    """

    def __init__(self, calibration: Calibration) -> None:
        self.calibration, given = calibration, calibration.camera
        u0, v0 = given.principal_point
        self.camera: Camera = replace(given, principal_point=(u0 + given.focal_length * math.tan(calibration.yaw), v0))
        self._size = (given.height, given.width)
        self._maps: Maps | None = None
        if not calibration.is_straight:
            self._maps = _maps(calibration, self.camera)

    def __call__(self, image: Pixels) -> Pixels:
        """Rectify an image; one of another size than the camera's is returned unchanged."""
        if self._maps is None or image.shape[:2] != self._size:
            return image
        places, fractions = self._maps
        # OpenCV keeps the type of the pixels, contrary to its annotations.
        straight: Any = cv2.remap(image, places, fractions, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        if image.dtype == np.uint16 and self.camera.bits > 8:
            # Cubics overshoot next to highlights; a value that is too large already is refused later.
            straight = np.minimum(straight, max(int(image.max()), 2**self.camera.bits - 1))
        return cast("Pixels", straight)


@dataclass(frozen=True, slots=True)
class StraightenedSource:
    """The images of a source, rectified."""

    source: Source
    straightener: Straightener

    @property
    def period(self) -> float:
        """Time from one image to the next [s]."""
        return self.source.period

    @property
    def temporal(self) -> bool:
        """Whether each image shows the same drive a moment after the one before."""
        return self.source.temporal

    @property
    def count(self) -> int:
        """How many images there are."""
        return self.source.count

    @property
    def description(self) -> str:
        """What this is, in a few words."""
        return f"{self.source.description}, straightened"

    @property
    def paths(self) -> tuple[Path, ...]:
        """The files that are read."""
        return self.source.paths

    def pictures(self) -> Iterator[Picture]:
        """Read and rectify the images."""
        for picture in self.source.pictures():
            image, opacity = (
                None if one is None else self.straightener(one) for one in (picture.image, picture.opacity)
            )
            yield replace(picture, image=image, opacity=opacity)


@checked_parameters
def straightened(source: Source, calibration: Calibration) -> tuple[Source, Camera]:
    """Images as a pinhole along the vehicle's axis sees them, and that pinhole.

    Parameters
    ----------
    source : Source
        Images of the camera.
    calibration : Calibration
        The real camera; without yaw and distortion the source is unchanged.

    Raises
    ------
    InputError
        If the lens folds the image.
    """
    if calibration.is_straight:
        return source, calibration.camera
    straightener = Straightener(calibration)
    return StraightenedSource(source, straightener), straightener.camera


def _maps(calibration: Calibration, straight: Camera) -> Maps:
    given = calibration.camera
    fold = _fold(calibration.distortion)
    _refuse_folded(calibration, fold)
    aside, along = (camera_axes(given, CameraPose((0.0, 0.0, 0.0), heading)) for heading in (calibration.yaw, 0.0))
    turned = matrix_product(along, aside.T)
    lens = np.array(calibration.distortion) if calibration.distortion else np.zeros(4)
    size = (given.width, given.height)
    columns, rows = cv2.initUndistortRectifyMap(_matrix(given), lens, turned, _matrix(straight), size, cv2.CV_32FC1)
    beyond = _radius(straight, turned) >= fold
    columns[beyond], rows[beyond] = -1.0, -1.0
    places, fractions = cv2.convertMaps(columns, rows, cv2.CV_16SC2)
    return places.astype(np.int16, copy=False), fractions.astype(np.uint16, copy=False)


def _matrix(camera: Camera) -> Floats:
    """Intrinsic matrix."""
    u0, v0 = camera.principal_point
    return np.array([[camera.focal_length, 0.0, u0], [0.0, camera.focal_length, v0], [0.0, 0.0, 1.0]])


def _radius(straight: Camera, turned: Floats) -> Floats:
    """Tangent of the angle between each rectified pixel's ray and the optical axis; infinite behind it."""
    rows, columns = np.indices((straight.height, straight.width), dtype=np.float64)
    u0, v0 = straight.principal_point
    right, under = (columns - u0) / straight.focal_length, (rows - v0) / straight.focal_length
    across, down, ahead = (x * right + y * under + z for x, y, z in turned.T.tolist())
    forward = ahead > 1e-6
    return np.where(forward, np.hypot(across, down) / np.where(forward, ahead, 1.0), np.inf)


def _fold(distortion: tuple[float, ...]) -> float:
    """Radius at which r (1 + k1 r² + k2 r⁴) stops growing; infinite if it never does [-]."""
    if not distortion:
        return math.inf
    k1, k2 = distortion[:2]
    # Its derivative is 1 + 3 k1 r² + 5 k2 r⁴; the greatest root 1 / r² is the nearest fold.
    square = 9.0 * k1**2 - 20.0 * k2
    greatest = 0.5 * (math.sqrt(square) - 3.0 * k1) if square >= 0.0 else 0.0
    return math.sqrt(1.0 / greatest) if greatest > 0.0 else math.inf


def _refuse_folded(calibration: Calibration, fold: float) -> None:
    """Refuse a lens that cannot show the middle of the nearest side of the image."""
    if math.isinf(fold):
        return
    camera, (k1, k2) = calibration.camera, calibration.distortion[:2]
    u0, v0 = camera.principal_point
    nearest = min(u0, camera.width - 1 - u0, v0, camera.height - 1 - v0)
    reached = camera.focal_length * fold * (1.0 + k1 * fold**2 + k2 * fold**4)
    if reached < nearest:
        raise InputError(
            f"distortion: with k1 = {k1:g} and k2 = {k2:g} the lens folds the image over {reached:.0f} px from the "
            f"principal point, and the image goes on to {nearest:.0f} px and more: are they OpenCV's [k1, k2, p1, p2] "
            f"for this focal length ({camera.focal_length:g} px)?"
        )
