"""The calibration of a camera in a file, ``camera.yaml``, for images from disk: read, or written from a guess."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import Field, ValidationError

from fogsim.core.files.atomic import write_text
from fogsim.core.files.output_targets import refuse_unwritable
from fogsim.errors import InputError
from fogsim.offline.calibration_deviations import EXACT, CalibrationDeviations
from fogsim.offline.guess import CameraGuess
from fogsim.scenario.document import read_document
from fogsim.scenario.mistakes import mistake_lines
from fogsim.scenario.section import Number, PixelPlace, Pixels, Section, Whole
from fogsim.values import Camera, Response

_MADE_TO_BE_LOOKED_AT = 8
"""Bit depth of images for viewing; sensor values with more bits are proportional to light."""

_HEIGHT_DEVIATION, _FOCAL_DEVIATION, _USUAL_PITCH_DEVIATION = 0.05, 0.03, math.radians(0.15)
"""Assumed standard deviations where a camera file states none: relative [-], and of the pitch of a moving vehicle
[rad]."""

Coefficient = Annotated[Number, Field(ge=-100, le=100)]


@dataclass(frozen=True, slots=True)
class Calibration:
    """Calibration of a real camera: a pinhole along the vehicle's axis, its lens distortion, and its yaw.

    `distortion` has Brown's coefficients k1, k2, p1, p2 as in OpenCV [-], empty for a pinhole; `yaw` is the angle of
    the optical axis to the left of the vehicle's axis [rad]; `remarks` are assumptions where the file says nothing;
    `deviations` say how uncertain the camera's values are.
    """

    EXPECTED: ClassVar[str] = "a Calibration, as load_calibration returns it"

    camera: Camera
    distortion: tuple[float, ...] = ()
    yaw: float = 0.0
    remarks: tuple[str, ...] = ()
    deviations: CalibrationDeviations = EXACT

    def __post_init__(self) -> None:
        """Raise InputError if the yaw turns the vehicle's axis out of the image."""
        u0, focal = self.camera.principal_point[0], self.camera.focal_length
        least, most = math.atan(-u0 / focal), math.atan((self.camera.width - 1 - u0) / focal)
        if self.yaw != 0.0 and not least <= self.yaw <= most:
            raise InputError(
                f"yaw_deg must lie within {math.degrees(least):.1f} … {math.degrees(most):.1f} for this width, focal "
                f"length and principal point, or the way ahead is not in the image; got {math.degrees(self.yaw):g}"
            )

    @property
    def is_straight(self) -> bool:
        """Whether images are already those of a pinhole along the vehicle's axis."""
        return self.yaw == 0.0 and not any(self.distortion)


class CameraFile(Section):
    """Keys of a camera file: pixels, metres and degrees, the units of its readers."""

    width: Annotated[Whole, Field(ge=1, le=16_384)]
    """Columns of the image."""

    height: Annotated[Whole, Field(ge=1, le=16_384)]
    """Rows of the image."""

    focal_length_px: Pixels
    """Focal length."""

    principal_point_px: tuple[PixelPlace, PixelPlace]
    """Principal point [u0, v0]; pixel centres are whole numbers."""

    mount_height_m: Annotated[Number, Field(ge=0.05, le=1000)]
    """Height of the camera above the road."""

    pitch_deg: Annotated[Number, Field(gt=-90, lt=90)]
    """Pitch; positive looks down."""

    roll_deg: Annotated[Number, Field(ge=-180, le=180)] = 0.0
    """Roll; positive turns the image's right side down."""

    yaw_deg: Annotated[Number, Field(gt=-60, lt=60)] = 0.0
    """Yaw; positive looks to the left of where the vehicle drives."""

    distortion: tuple[Coefficient, Coefficient, Coefficient, Coefficient] | None = None
    """Distortion of the lens [k1, k2, p1, p2] as OpenCV has it."""

    focal_length_sd_px: Annotated[Number, Field(ge=0)] | None = None
    """Standard deviation of the focal length; left out, 3 %."""

    mount_height_sd_m: Annotated[Number, Field(ge=0)] | None = None
    """Standard deviation of the height; left out, 5 %."""

    pitch_sd_deg: Annotated[Number, Field(ge=0.001, le=11)] | None = None
    """Standard deviation of the pitch of single images; left out, 0.15."""

    response: Response | None = None
    """Curve from light to pixel values: `linear`, `gamma` (2.2) or `srgb`; left out, `srgb` for 8 bits and `linear` for
    more."""

    bits: Literal[8, 10, 12] = 8
    """Bit depth of the pixel values; images of 16 bits without it use the whole range."""

    black_level_percent: Number = Field(default=0.0, ge=0, le=25)
    """Share of full scale, before the response, at which the sensor reads no light."""


def load_camera(path: Path) -> Camera:
    """Read the file of a camera whose images need no rectification; InputError if it has a yaw or a distortion."""
    return straight_camera(load_calibration(path), path)


def straight_camera(calibration: Calibration, path: Path) -> Camera:
    """Camera of a calibration; InputError if it has a yaw or a distortion."""
    if not calibration.is_straight:
        raise InputError(
            f"{path}: distortion and yaw_deg are undone by `fogsim estimate` alone (in Python load_calibration); "
            "here images must be straight: straighten them, and leave both keys out"
        )
    return calibration.camera


def load_calibration(path: str | Path) -> Calibration:
    """Read a camera file.

    Parameters
    ----------
    path : str or Path
        A YAML file with the keys of `CameraFile`.

    Returns
    -------
    Calibration
        In SI units and radians.

    Raises
    ------
    InputError
        If the file cannot be read or a key does not fit; one line for each mistake.
    """
    document = read_document(Path(path))
    try:
        keys = CameraFile.model_validate(document.data)
    except ValidationError as error:
        raise InputError(mistake_lines(document, CameraFile, error)) from error
    assumed = Response.SRGB if keys.bits == _MADE_TO_BE_LOOKED_AT else Response.LINEAR
    remark = f"{path}: response is not given: {assumed.value} is assumed, as images of {keys.bits} bits mostly have"
    camera = Camera(
        width=keys.width,
        height=keys.height,
        focal_length=keys.focal_length_px,
        principal_point=keys.principal_point_px,
        mount_height=keys.mount_height_m,
        pitch=math.radians(keys.pitch_deg),
        roll=math.radians(keys.roll_deg),
        response=keys.response or assumed,
        bits=keys.bits,
        black_level=keys.black_level_percent / 100.0,
    )
    try:
        remarks = () if keys.response else (remark,)
        yaw, deviations = math.radians(keys.yaw_deg), _deviations(keys)
        return Calibration(camera, keys.distortion or (), yaw, remarks, deviations)
    except InputError as error:
        raise InputError(f"{document.where(('yaw_deg',))}: {error}") from error


def _deviations(keys: CameraFile) -> CalibrationDeviations:
    """The stated standard deviations, or the usual ones."""
    focal, height, pitch = _FOCAL_DEVIATION, _HEIGHT_DEVIATION, _USUAL_PITCH_DEVIATION
    if keys.focal_length_sd_px is not None:
        focal = keys.focal_length_sd_px / keys.focal_length_px
    if keys.mount_height_sd_m is not None:
        height = keys.mount_height_sd_m / keys.mount_height_m
    if keys.pitch_sd_deg is not None:
        pitch = math.radians(keys.pitch_sd_deg)
    return CalibrationDeviations(focal, height, pitch)


def camera_text(guess: CameraGuess) -> str:
    """Text of a camera file, with comments on the source of each value.

    Parameters
    ----------
    guess : CameraGuess
        The calibration and its reasons.
    """
    camera = guess.camera
    values = {
        "width": f"{camera.width}",
        "height": f"{camera.height}",
        "focal_length_px": f"{camera.focal_length:.1f}",
        "principal_point_px": f"[{camera.principal_point[0]:g}, {camera.principal_point[1]:g}]",
        "mount_height_m": f"{camera.mount_height:g}",
        "pitch_deg": f"{math.degrees(camera.pitch):.3f}",
        "focal_length_sd_px": f"{camera.focal_length * guess.deviations.focal_length:.1f}",
        "mount_height_sd_m": f"{camera.mount_height * guess.deviations.mount_height:.2g}",
        "pitch_sd_deg": f"{math.degrees(guess.deviations.pitch):.2g}",
        "response": camera.response.value,
    }
    lines = ["# Guessed by fogsim estimate --guess-camera; correct what you know better.\n"]
    lines += [f"# Uncertain: {warning}\n" for warning in guess.warnings]
    lines += [f"{key}: {value}  # {guess.reasons.get(key, 'standard deviation')}\n" for key, value in values.items()]
    return "".join(lines)


def write_camera(path: str | Path, guess: CameraGuess, *, overwrite: bool = False) -> None:
    """Write a guessed calibration as a camera file, whole or not at all.

    Parameters
    ----------
    path : str or Path
        The camera file.
    guess : CameraGuess
        The calibration and its reasons.
    overwrite : bool
        True to replace an existing file.

    Raises
    ------
    InputError
        If it exists and must not be replaced, or cannot be written.
    """
    file = Path(path)
    refuse_unwritable(file, "--camera", overwrite=overwrite)
    write_text(file, camera_text(guess))
