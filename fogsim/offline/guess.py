"""A first calibration of a camera from its images and its known dimensions."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, UnidentifiedImageError

from fogsim.errors import InputError
from fogsim.offline.image_files import Pixels
from fogsim.offline.source import Picture, Source
from fogsim.values import Camera, Response
from fogsim.vision.lines.segments import segment_vanishing_point
from fogsim.vision.lines.vanishing_point import VanishingPoint

ASSUMED_FIELD_OF_VIEW = math.radians(60.0)
"""Default horizontal field of view of an unknown camera [rad]."""

ASSUMED_MOUNT_HEIGHT = 1.3
"""Default height of a dash camera in a passenger car [m]."""

MOST_IMAGES = 100
"""Maximum number of images that are used, spread over the source."""

SURE_PITCH = math.radians(0.1)
"""Standard deviation of the pitch above which a guess is called uncertain [rad]: 10 % of V at 100 m."""

SURE_COUNT = 5
"""Images with a vanishing point below which a guess is called uncertain."""

SYSTEMATIC = 0.5
"""Standard deviation of a vanishing point that more images of the same road do not reduce [px]."""

ASIDE = math.radians(3.0)
"""Angle to the side above which the camera is reported not to look along the road [rad]."""

_FULL_FRAME_DIAGONAL_MM = 43.27
_EXIF_IFD, _EXIF_FOCAL_LENGTH_35MM = 0x8769, 0xA405


@dataclass(frozen=True, slots=True)
class CameraGuess:
    """A calibration and the sources of its values.

    Attributes
    ----------
    camera : Camera
        The calibration.
    reasons : dict from str to str
        Source of the value for each key of a camera file.
    warnings : tuple of str
        What is uncertain about it.
    """

    camera: Camera
    reasons: dict[str, str]
    warnings: tuple[str, ...]


def guess_camera(
    source: Source,
    *,
    mount_height: float | None = None,
    field_of_view: float | None = None,
    horizon_row: float | None = None,
) -> CameraGuess:
    """Guess the calibration of the camera that made images.

    The image's middle is assumed as the principal point, and the pitch follows from the row in which the lines of the
    road meet, θ = arctan((v0 − v_h) / α). Other values are arguments or assumptions, and reported.

    Parameters
    ----------
    source : Source
        Its images, of a straight flat road with marks.
    mount_height : float or None
        Height of the camera above the road [m].
    field_of_view : float or None
        Horizontal field of view [rad]; None for the focal length in the first image's metadata, if present.
    horizon_row : float or None
        Row of the horizon [px], instead of the vanishing point.

    Returns
    -------
    CameraGuess
        With reasons and warnings.

    Raises
    ------
    InputError
        If neither height nor field of view is given, a value is impossible, images differ in size or none can be
        read, or no vanishing point is found and no horizon is given.
    """
    _check_values(mount_height, field_of_view)
    pictures = list(_spread(source))
    first = pictures[0]
    rows, cols = first.shape[:2]
    if horizon_row is not None and not 0.0 <= horizon_row <= rows - 1:
        raise InputError(f"--horizon-row must be a row of the images, 0 … {rows - 1}, got {horizon_row!r}")
    eight = first.dtype == np.uint8
    response = Response.SRGB if eight else Response.LINEAR
    focal, focal_reason, warnings = _focal_length(source, cols, rows, field_of_view)
    reasons = {
        "width": "of the images",
        "height": "of the images",
        "focal_length_px": focal_reason,
        "principal_point_px": "assumed: the middle of the image",
        "response": "assumed: images of 8 bits are made to be looked at" if eight else "assumed of 16 bits",
    }
    row, reasons["pitch_deg"], more = _horizon(pictures, response, focal, horizon_row)
    warnings += more
    if mount_height is None:
        reasons["mount_height_m"] = "ASSUMED: a passenger car"
        warnings.append(f"the mount height is assumed to be {ASSUMED_MOUNT_HEIGHT} m: measure it and correct it")
    else:
        reasons["mount_height_m"] = "as stated"
    middle = (0.5 * (cols - 1), 0.5 * (rows - 1))
    pitch = math.atan((middle[1] - row) / focal)
    camera = Camera(cols, rows, focal, middle, mount_height or ASSUMED_MOUNT_HEIGHT, pitch, response=response)
    return CameraGuess(camera, reasons, tuple(warnings))


def _check_values(mount_height: float | None, field_of_view: float | None) -> None:
    if mount_height is None and field_of_view is None:
        raise InputError("--guess-camera needs --mount-height (metres above the road) or --field-of-view, better both")
    if mount_height is not None and not 0.1 <= mount_height <= 20.0:
        raise InputError(f"--mount-height must lie within 0.1 … 20 m above the road, got {mount_height!r}")
    if field_of_view is not None and not math.radians(1.0) <= field_of_view <= math.radians(170.0):
        degrees = math.degrees(field_of_view)
        raise InputError(
            f"--field-of-view must lie within 1 … 170 degrees, from the left to the right edge, got {degrees:g}"
        )


def _spread(source: Source) -> Iterator[Pixels]:
    """Images of one size, spread over the source."""
    every = max(1, math.ceil(source.count / MOST_IMAGES))
    size, name, reason = None, None, ""
    for index, picture in enumerate(source.pictures()):
        reason = reason or picture.error
        if index % every or picture.image is None:
            continue
        if size is None:
            size, name = picture.image.shape[:2], picture.name
        _refuse_other_size(picture, picture.image, size, name)
        yield picture.image
    if size is None:
        raise InputError(f"none of the images can be read: {reason}")


def _refuse_other_size(picture: Picture, image: Pixels, size: tuple[int, ...], name: str | int | None) -> None:
    if image.shape[:2] != size:
        raise InputError(
            f"{picture.name} has {image.shape[1]} × {image.shape[0]} pixels and {name} has {size[1]} × {size[0]}: "
            "images of one camera have one size"
        )


def _focal_length(source: Source, cols: int, rows: int, field_of_view: float | None) -> tuple[float, str, list[str]]:
    """Focal length [px], its source, and warnings."""
    if field_of_view is not None:
        reason = f"a field of view of {math.degrees(field_of_view):g}° as stated"
        return 0.5 * cols / math.tan(0.5 * field_of_view), reason, []
    stated = _stated_focal_length(source.paths[0])
    if stated is not None:
        focal = stated * math.hypot(cols, rows) / _FULL_FRAME_DIAGONAL_MM
        return focal, f"{stated:g} mm on 35 mm film by the image's metadata", []
    degrees = math.degrees(ASSUMED_FIELD_OF_VIEW)
    warning = (
        f"the field of view is assumed to be {degrees:g}°, and an error of the focal length goes into every visibility "
        "one to one: look it up and give it as --field-of-view"
    )
    return 0.5 * cols / math.tan(0.5 * ASSUMED_FIELD_OF_VIEW), f"ASSUMED: a field of view of {degrees:g}°", [warning]


def _stated_focal_length(path: Path) -> float | None:
    """Focal length on 35 mm film in an image's metadata [mm]."""
    try:
        with Image.open(path) as image:
            value = image.getexif().get_ifd(_EXIF_IFD).get(_EXIF_FOCAL_LENGTH_35MM)
    except (OSError, UnidentifiedImageError, ValueError, SyntaxError):
        # No image for Pillow, such as a video, and so without metadata.
        return None
    return float(value) if isinstance(value, int | float) and value > 0 else None


def _horizon(
    pictures: list[Pixels], response: Response, focal: float, stated: float | None
) -> tuple[float, str, list[str]]:
    """Row of the horizon [px], its source, and warnings."""
    if stated is not None:
        return stated, f"the horizon on row {stated:g} as stated", []
    seen = (segment_vanishing_point(image, response, _bits(image)) for image in pictures)
    points = [point for point in seen if point is not None]
    if not points:
        raise InputError(
            f"no lane lines that meet were found in {len(pictures)} images: give the row of the horizon, counted from "
            "the top, as --horizon-row, or take images of a straight road with marks"
        )
    row, deviation = _median_row(points)
    reason = f"lines of the road meet on row {row:.1f} ± {deviation:.1f} in {len(points)} of {len(pictures)} images"
    return row, reason, _warnings_of(points, row, deviation, focal, pictures[0].shape[1])


def _bits(image: Pixels) -> int:
    return 8 if image.dtype == np.uint8 else 16


def _median_row(points: list[VanishingPoint]) -> tuple[float, float]:
    """Median row of points and its standard deviation [px]."""
    rows = np.array([point.row for point in points])
    row = float(np.median(rows))
    scatter = 1.4826 * float(np.median(np.abs(rows - row)))
    single = float(np.median([point.row_deviation for point in points]))
    # A median is a quarter less certain than a mean.
    return row, math.hypot(1.25 * max(scatter, single) / math.sqrt(len(points)), SYSTEMATIC)


def _warnings_of(points: list[VanishingPoint], row: float, deviation: float, focal: float, cols: int) -> list[str]:
    """Uncertainty of a horizon from vanishing points, in words."""
    found = []
    if len(points) < SURE_COUNT:
        found.append(f"the pitch comes from {len(points)} image{'s' if len(points) > 1 else ''} alone: give more")
    sure = focal * SURE_PITCH
    if deviation > sure:
        found.append(
            f"the vanishing point is uncertain: row {row:.1f} ± {deviation:.1f}, where ± {sure:.1f} would be 0.1°; "
            "give images of a straight road with marks, or the row of the horizon as --horizon-row"
        )
    aside = math.atan((float(np.median([point.column for point in points])) - 0.5 * (cols - 1)) / focal)
    if abs(aside) > ASIDE:
        side = "left" if aside > 0 else "right"
        found.append(
            f"the road leads {abs(math.degrees(aside)):.0f}° past the image's middle: either the road bends, or the "
            f"camera is turned to the {side}: then add `yaw_deg: {math.degrees(aside):.1f}` to the camera file"
        )
    return found
