"""A calibration of an unknown camera from its images, and how uncertain it is."""

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import cv2
import numpy as np
from PIL import Image

from fogsim.core.parameters import NUMBER_OR_NAN, checked_parameters
from fogsim.errors import InputError
from fogsim.offline.calibration_deviations import CalibrationDeviations
from fogsim.offline.drive.road_scale import RoadMotion
from fogsim.offline.image_files import IMAGE_FAULTS, Pixels
from fogsim.offline.source import Picture, Source
from fogsim.values import Camera, Response
from fogsim.vision.lines.segments import RoadSegments, road_segments
from fogsim.vision.lines.vanishing_point import VanishingPoint

_ASSUMED_FIELD_OF_VIEW, _FIELDS_OF_VIEW = math.radians(73.0), "31° to 127°"
"""Field of view of an unknown camera, along the longer side of its images [rad], and what 90 % of cameras have."""

_ASSUMED_MOUNT_HEIGHT = 1.3
"""Default height of a dash camera in a passenger car [m]."""

_STATED_DEVIATION, _METADATA_DEVIATION, _FIELD_DEVIATION, _HEIGHT_DEVIATION = 0.03, 0.05, 0.6, 0.12
"""Relative standard deviations of stated values, of a focal length in metadata, of one by the assumed field of view
(31° to 127° within 90 %: tele lenses, telephones, dash and action cameras), and of the assumed height [-]. Images do
not show the focal length: lengths across the road and heights go with the depth over it."""

_LANE_WIDTH, _LANE_DEVIATION = 3.5, 0.08
"""Usual width of lanes [m] and its relative standard deviation, including the lines' own errors [-]."""

_FARTHEST_LINE, _SHORTEST_LINE = 3.0, 0.2
"""Lateral offset over the camera's height up to which the own lane's lines are searched, and their least length over
the longest on that side [-]."""

_AGREEING = 2.0
"""Standard deviations up to which the height by the lane agrees with the assumed one."""

_MISSED_LINES, _MISSED_DEVIATION = 1.5, 0.45
"""Height over that by the lane, and its relative standard deviation, where that is above a car's [-]: faint lines are
missed from there, so that two lanes count as one; by photographs of pool 0 of `benchmarks/photograph_pictures.py` taken
from 2.4, 6 and 9 m."""

_LINES_DEVIATION = math.radians(0.25)
"""Standard deviation of the pitch by the lines of real roads, which bend and undulate and whose shadows pass for lines
[rad]."""

_MOST_IMAGES, _MOST_COLUMNS = 40, 960
"""Maximum number of images that are used, spread over the source, and of their columns: larger ones are reduced."""

_SURE_PITCH = math.radians(0.1)
"""Standard deviation of the pitch above which a guess is called uncertain [rad]: 10 % of V at 100 m."""

_SURE_COUNT = 5
"""Images with a vanishing point below which a guess is called uncertain."""

_SYSTEMATIC = 0.5
"""Standard deviation of a vanishing point that more images of the same road do not reduce [px]."""

_ASIDE = math.radians(3.0)
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
    deviations : CalibrationDeviations
        How uncertain it is.
    reasons : dict from str to str
        Source of the value for each key of a camera file.
    warnings : tuple of str
        What is uncertain about it.
    """

    camera: Camera
    deviations: CalibrationDeviations
    reasons: dict[str, str]
    warnings: tuple[str, ...]


@checked_parameters
def guess_camera(
    source: Source,
    *,
    mount_height: Annotated[float, NUMBER_OR_NAN] | None = None,
    field_of_view: Annotated[float, NUMBER_OR_NAN] | None = None,
    horizon_row: Annotated[float, NUMBER_OR_NAN] | None = None,
    way: Callable[[float], float | None] | None = None,
    progress: Callable[[int, int], None] = lambda _done, _total: None,
) -> CameraGuess:
    """Guess the calibration of the camera that made images.

    The image's middle is assumed as the principal point, and the pitch follows from the row in which the lines of the
    road meet, θ = arctan((v0 − v_h) / α). A height that is not stated is that of a passenger car's camera, weighed with
    the one at which the lines of the own lane are 3.5 m apart. Other values are arguments or assumptions, and reported.

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
    way : callable or None
        Length of the way that the camera has made [m] at a time from the first image [s]; how the road's texture moves
        in the images then gives the product of focal length and height.
    progress : callable
        Called with the number of images that were read and that of the source.

    Returns
    -------
    CameraGuess
        With standard deviations, reasons and warnings.

    Raises
    ------
    InputError
        If a value is impossible, images differ in size or none can be read, or no vanishing point is found and no
        horizon is given.
    """
    _check_values(mount_height, field_of_view)
    pictures, path, odd = _spread(source, progress)
    first = pictures[0]
    rows, cols = first.shape[:2]
    if horizon_row is not None and not 0.0 <= horizon_row <= rows - 1:
        raise InputError(f"--horizon-row must be a row of the images, 0 … {rows - 1}, got {horizon_row!r}")
    eight = first.dtype == np.uint8
    response = Response.SRGB if eight else Response.LINEAR
    focal = _focal_length(path, cols, rows, field_of_view)
    lines = [found for image in pictures if (found := _road_lines(image, response)) is not None]
    horizon = _horizon(lines, len(pictures), focal.value, cols, horizon_row)
    height = _mount_height(lines, mount_height)
    if way is not None:
        focal, height = _scaled(source, way, focal, height, horizon.value, (cols, rows), response)
    middle = (0.5 * (cols - 1), 0.5 * (rows - 1))
    pitch = math.atan((middle[1] - horizon.value) / focal.value)
    reasons = {
        "width": "of the images",
        "height": "of the images",
        "focal_length_px": focal.reason,
        "principal_point_px": "assumed: the middle of the image",
        "mount_height_m": height.reason,
        "pitch_deg": horizon.reason,
        "response": "assumed: images of 8 bits are made to be looked at" if eight else "assumed of 16 bits",
    }
    return CameraGuess(
        Camera(cols, rows, focal.value, middle, height.value, pitch, response=response),
        CalibrationDeviations(
            focal.deviation, height.deviation, math.hypot(_LINES_DEVIATION, horizon.deviation / focal.value)
        ),
        reasons,
        (*odd, *focal.warnings, *horizon.warnings, *height.warnings),
    )


def guess_text(guess: CameraGuess) -> str:
    """What was guessed, in a line."""
    camera, deviations = guess.camera, guess.deviations
    row_deviation = camera.focal_length * deviations.pitch
    return (
        f"focal length {camera.focal_length:.0f} ± {camera.focal_length * deviations.focal_length:.0f} px, "
        f"height {camera.mount_height:.2f} ± {camera.mount_height * deviations.mount_height:.2f} m, "
        f"horizon on row {camera.horizon_row:.1f} ± {row_deviation:.1f}, response {camera.response.value}"
    )


@dataclass(frozen=True, slots=True)
class _Guessed:
    """A value, its standard deviation (relative, or [px] of a row), its source, and what is uncertain about it."""

    value: float
    deviation: float
    reason: str
    warnings: tuple[str, ...] = ()


def _check_values(mount_height: float | None, field_of_view: float | None) -> None:
    if mount_height is not None and not 0.1 <= mount_height <= 20.0:
        raise InputError(f"--mount-height must lie within 0.1 … 20 m above the road, got {mount_height!r}")
    if field_of_view is not None and not math.radians(1.0) <= field_of_view <= math.radians(170.0):
        degrees = math.degrees(field_of_view)
        raise InputError(
            f"--field-of-view must lie within 1 … 170 degrees, from the left to the right edge, got {degrees:g}"
        )


def _spread(source: Source, progress: Callable[[int, int], None]) -> tuple[list[Pixels], Path, list[str]]:
    """Images of the usual size, spread over the source, the path of the first, and which are of another size.

    Every other one is dropped whenever there are too many.
    """
    kept, every = list[Pixels](), max(1, math.ceil(source.count / _MOST_IMAGES))
    sizes, first, reason = Counter[tuple[int, ...]](), dict[tuple[int, ...], Picture](), ""
    for index, picture in enumerate(source.pictures()):
        reason = reason or picture.error
        progress(index + 1, source.count)
        if index % every or picture.image is None:
            continue
        size = picture.image.shape[:2]
        sizes[size] += 1
        first.setdefault(size, replace(picture, image=None))
        kept.append(picture.image)
        if len(kept) > 2 * _MOST_IMAGES:  # a video may not state its length
            kept, every = kept[::2], 2 * every
    if not sizes:
        raise InputError(f"none of the images can be read: {reason}")
    usual, number = sizes.most_common(1)[0]
    if 2 * number <= sizes.total():
        one, other = (f"{first[size].name} has {size[1]} × {size[0]}" for size in list(sizes)[1::-1])
        raise InputError(f"{one} pixels and {other}: images of one camera have one size")
    others = sizes.total() - number
    odd = next((f" ({one.name})" for size, one in first.items() if size != usual), "")
    warning = f"{others} of {sizes.total()} images have another size than the others{odd} and are left out"
    name = first[usual].name
    path = Path(name) if isinstance(name, str) else source.paths[0]
    return [image for image in kept if image.shape[:2] == usual], path, [warning] * (others > 0)


def _focal_length(path: Path, cols: int, rows: int, field_of_view: float | None) -> _Guessed:
    """Focal length [px]."""
    if field_of_view is not None:
        reason = f"a field of view of {math.degrees(field_of_view):g}° as stated"
        return _Guessed(0.5 * cols / math.tan(0.5 * field_of_view), _STATED_DEVIATION, reason)
    stated = _stated_focal_length(path)
    if stated is not None:
        focal = stated * math.hypot(cols, rows) / _FULL_FRAME_DIAGONAL_MM
        return _Guessed(focal, _METADATA_DEVIATION, f"{stated:g} mm on 35 mm film by the image's metadata")
    degrees = math.degrees(_ASSUMED_FIELD_OF_VIEW)
    warning = (
        f"the lens is not known: its field of view is assumed to be {degrees:g}° along the longer side, and intervals "
        f"have room for {_FIELDS_OF_VIEW}, since every visibility goes with the focal length: look up its angle from "
        "left to right and give it as --field-of-view"
    )
    # A camera that is held upright keeps its focal length.
    focal = 0.5 * max(cols, rows) / math.tan(0.5 * _ASSUMED_FIELD_OF_VIEW)
    reason = f"ASSUMED: a field of view of {degrees:g}° along the longer side"
    return _Guessed(focal, _FIELD_DEVIATION, reason, (warning,))


def _stated_focal_length(path: Path) -> float | None:
    """Focal length on 35 mm film in an image's metadata [mm]."""
    try:
        with Image.open(path) as image:
            value = image.getexif().get_ifd(_EXIF_IFD).get(_EXIF_FOCAL_LENGTH_35MM)
    except IMAGE_FAULTS:
        # No image for Pillow, such as a video, and so without metadata.
        return None
    return float(value) if isinstance(value, int | float) and value > 0 else None


def _road_lines(image: Pixels, response: Response) -> RoadSegments | None:
    """Segments along the road in an image, in its own pixels though sought in a reduced one."""
    shrink = max(1.0, image.shape[1] / _MOST_COLUMNS)
    reduced: Any = image
    if shrink > 1.0:
        reduced = cv2.resize(image, None, fx=1.0 / shrink, fy=1.0 / shrink, interpolation=cv2.INTER_AREA)
    found = road_segments(reduced, response, 8 if image.dtype == np.uint8 else 16)
    if found is None or shrink == 1.0:
        return found
    point, middle = found.point, 0.5 * (shrink - 1.0)
    point = replace(
        point,
        column=point.column * shrink + middle,
        row=point.row * shrink + middle,
        row_deviation=point.row_deviation * shrink,
    )
    return replace(found, point=point, length=found.length * shrink)


def _horizon(lines: Sequence[RoadSegments], images: int, focal: float, cols: int, stated: float | None) -> _Guessed:
    """Row of the horizon [px]."""
    if stated is not None:
        return _Guessed(stated, 1.0, f"the horizon on row {stated:g} as stated")
    if not lines:
        raise InputError(
            f"no lane lines that meet were found in {images} image{'s' * (images > 1)}: give the row of the horizon, "
            "counted from the top, as --horizon-row, or take images of a straight road with marks"
        )
    points = [one.point for one in lines]
    row, deviation = _median_row(points)
    reason = f"lines of the road meet on row {row:.1f} ± {deviation:.1f} in {len(points)} of {images} images"
    return _Guessed(row, deviation, reason, tuple(_warnings_of(points, row, deviation, focal, cols)))


def _mount_height(lines: Sequence[RoadSegments], stated: float | None) -> _Guessed:
    """Height of the camera [m]."""
    if stated is not None:
        return _Guessed(stated, _STATED_DEVIATION, "as stated")
    warning = f"the mount height is assumed to be {_ASSUMED_MOUNT_HEIGHT} m: measure it and correct it"
    assumed = _Guessed(_ASSUMED_MOUNT_HEIGHT, _HEIGHT_DEVIATION, "ASSUMED: a passenger car", (warning,))
    widths = [width for one in lines if (width := _lane_over_height(one)) is not None]
    if len(widths) < _SURE_COUNT:
        return assumed
    by_lane = _LANE_WIDTH / float(np.median(widths))
    apart = math.log(by_lane / _ASSUMED_MOUNT_HEIGHT)
    agreeing = _AGREEING * math.hypot(_HEIGHT_DEVIATION, _LANE_DEVIATION)
    if apart < -agreeing:
        return assumed
    if apart > agreeing:
        height = round(_MISSED_LINES * by_lane, 1)
        reason = f"ASSUMED: above a passenger car, since lanes of {_LANE_WIDTH} m give {by_lane:.1f} m or more"
        warning = f"the camera is higher than a passenger car's: its mount height may be {height} m: measure it"
        return _Guessed(height, _MISSED_DEVIATION, reason, (warning,))
    share = _HEIGHT_DEVIATION**2 / (_HEIGHT_DEVIATION**2 + _LANE_DEVIATION**2)
    height = round(_ASSUMED_MOUNT_HEIGHT * math.exp(share * apart), 2)
    reason = f"ASSUMED: a passenger car, and lanes of {_LANE_WIDTH} m, which alone give {by_lane:.2f} m"
    warning = f"the mount height is assumed to be {height} m, also by the width of the lane: measure it and correct it"
    return _Guessed(height, _LANE_DEVIATION * math.sqrt(share), reason, (warning,))


def _scaled(
    source: Source,
    way: Callable[[float], float | None],
    focal: _Guessed,
    height: _Guessed,
    horizon_row: float,
    size: tuple[int, int],
    response: Response,
) -> tuple[_Guessed, _Guessed]:
    """Focal length and height; the less certain one follows from the camera's way, if the road's texture shows."""
    cols, rows = size
    middle = (0.5 * (cols - 1), 0.5 * (rows - 1))
    pitch = math.atan((middle[1] - horizon_row) / focal.value)
    motion = RoadMotion(Camera(cols, rows, focal.value, middle, height.value, pitch, response=response))
    for picture in source.pictures():
        at = way(picture.time)
        if picture.image is not None and picture.image.shape[:2] == (rows, cols) and at is not None:
            motion.add(picture.image, at)
        if motion.pairs >= _MOST_IMAGES:
            break
    scale = motion.scale()
    if scale is None:
        why = "the road's texture does not show it" if motion.pairs else "no two images are 1.5 to 5 m apart on it"
        unused = f"the track does not give the scale: {why} (--track-offset is its time at the first image)"
        return focal, replace(height, warnings=(*height.warnings, unused))
    reason = f"the road moves {1.0 / scale.factor:.2f} times as far as the track does with an assumed {{}}"
    if focal.deviation >= height.deviation:
        focal = _Guessed(focal.value * scale.factor, scale.deviation, reason.format("focal length"))
    else:
        height = _Guessed(round(height.value * scale.factor, 3), scale.deviation, reason.format("height"))
    # The track gives the product of the two, whose deviation is stated as the focal length's alone.
    return replace(focal, deviation=scale.deviation), replace(height, deviation=0.0)


def _lane_over_height(lines: RoadSegments) -> float | None:
    """Distance between the own lane's lines over the camera's height [-]."""
    sides = []
    for side in (-1.0, 1.0):
        offset = side * lines.slopes
        near = (offset > 0.0) & (offset < _FARTHEST_LINE)
        if not near.any():
            return None
        sure = near & (lines.length >= _SHORTEST_LINE * lines.length[near].max())
        sides.append(float(offset[sure].min()))
    return sum(sides)


_NARROWEST_LANE, _WIDEST_GAP = 2.3, 8.0
"""Least width of a lane, and most distance of the lines that are found next to a camera, some missed between them [m]:
2.35 to 7.6 on photographs of pool 0 of `benchmarks/photograph_pictures.py`, but 1.85 where one has a bright repair."""


class LaneCheck:
    """Whether the lines next to a camera are as far apart as those of lanes, from a few images of a clip."""

    def __init__(self, camera: Camera) -> None:
        self._camera, self._seen = camera, 0
        self._widths = list[float]()

    def add(self, image: Pixels) -> None:
        """Look at an image: at the first, the second, the fourth and so on."""
        self._seen += 1
        if self._seen & (self._seen - 1):
            return
        lines = _road_lines(image, self._camera.response)
        width = None if lines is None else _lane_over_height(lines)
        if width is not None:
            self._widths.append(width * self._camera.mount_height)

    def remarks(self) -> Iterator[str]:
        """What contradicts the camera's height."""
        if not self._widths or _NARROWEST_LANE <= (width := float(np.median(self._widths))) <= _WIDEST_GAP:
            return
        side, height = "low" if width < _NARROWEST_LANE else "high", self._camera.mount_height
        yield (
            f"the lines next to the camera are {width:.1f} m apart if it is {height:.3g} m above the road: if "
            f"they bound a lane, mount_height_m is too {side}, and visibilities are, too, by the same factor"
        )


def _median_row(points: list[VanishingPoint]) -> tuple[float, float]:
    """Median row of points and its standard deviation [px]."""
    rows = np.array([point.row for point in points])
    row = float(np.median(rows))
    scatter = 1.4826 * float(np.median(np.abs(rows - row)))
    single = float(np.median([point.row_deviation for point in points]))
    # A median is a quarter less certain than a mean.
    return row, math.hypot(1.25 * max(scatter, single) / math.sqrt(len(points)), _SYSTEMATIC)


def _warnings_of(points: list[VanishingPoint], row: float, deviation: float, focal: float, cols: int) -> list[str]:
    """Uncertainty of a horizon from vanishing points, in words."""
    found = []
    if len(points) < _SURE_COUNT:
        found.append(f"the pitch comes from {len(points)} image{'s' if len(points) > 1 else ''} alone: give more")
    sure = focal * _SURE_PITCH
    if deviation > sure:
        found.append(
            f"the vanishing point is uncertain: row {row:.1f} ± {deviation:.1f}, where ± {sure:.1f} would be 0.1°; "
            "give images of a straight road with marks, or the row of the horizon as --horizon-row"
        )
    aside = math.atan((float(np.median([point.column for point in points])) - 0.5 * (cols - 1)) / focal)
    if abs(aside) > _ASIDE:
        side = "left" if aside > 0 else "right"
        found.append(
            f"the road leads {abs(math.degrees(aside)):.0f}° past the image's middle: either the road bends, or the "
            f"camera is turned to the {side}: then add `yaw_deg: {math.degrees(aside):.1f}` to the camera file"
        )
    return found
