"""The calibration of a camera in a file, ``camera.yaml``, for images that come from disk."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, ValidationError

from fogsim.errors import InputError
from fogsim.scenario.document import read_document
from fogsim.scenario.mistakes import tell_mistakes
from fogsim.scenario.section import Number, PixelPlace, Pixels, Section, Whole
from fogsim.values import Camera, Response

Coefficient = Annotated[Number, Field(ge=-100, le=100)]


@dataclass(frozen=True, slots=True)
class Calibration:
    """A camera as its owner knows it: what images from disk need before the methods can read them.

    Attributes
    ----------
    camera : Camera
        Size, focal length, principal point, mount height, pitch, roll, response and bits, as if the lens were a pinhole
        and looked along the vehicle's axis.
    distortion : tuple of float
        Brown's coefficients of the lens k1, k2, p1, p2 as OpenCV has them [-]; empty for a pinhole.
    yaw : float
        Angle of the optical axis to the left of the vehicle's axis [rad].
    """

    camera: Camera
    distortion: tuple[float, ...] = ()
    yaw: float = 0.0

    @property
    def is_straight(self) -> bool:
        """Whether images are as they must be: of a pinhole that looks along the vehicle's axis."""
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

    response: Response = Response.LINEAR
    """Curve from light to pixel values: `linear`, `gamma` (2.2) or `srgb`."""

    bits: Literal[8, 10, 12] = 8
    """Bit depth of the pixel values; images of 16 bits without it use the whole range."""


def load_camera(path: Path) -> Camera:
    """Read the file of a camera whose images need no straightening.

    Parameters
    ----------
    path : Path
        A YAML file with the keys of `CameraFile`.

    Returns
    -------
    Camera
        The calibration, in SI units and radians.

    Raises
    ------
    InputError
        If the file cannot be read, a key does not fit (one line for each mistake), or there is a yaw or a distortion,
        which a `Camera` cannot hold: see `load_calibration`.
    """
    calibration = load_calibration(path)
    if not calibration.is_straight:
        raise InputError(
            f"{path}: distortion and yaw_deg are undone by `fogsim estimate` alone (in Python load_calibration); "
            "here images must be straight: straighten them, and leave both keys out"
        )
    return calibration.camera


def load_calibration(path: Path) -> Calibration:
    """Read a camera file.

    Parameters
    ----------
    path : Path
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
    document = read_document(path)
    try:
        keys = CameraFile.model_validate(document.data)
    except ValidationError as error:
        raise InputError(tell_mistakes(document, CameraFile, error)) from error
    camera = Camera(
        width=keys.width,
        height=keys.height,
        focal_length=keys.focal_length_px,
        principal_point=keys.principal_point_px,
        mount_height=keys.mount_height_m,
        pitch=math.radians(keys.pitch_deg),
        roll=math.radians(keys.roll_deg),
        response=keys.response,
        bits=keys.bits,
    )
    return Calibration(camera, keys.distortion or (), math.radians(keys.yaw_deg))
