"""What a vehicle knows: the only thing that estimators and agents are given."""

import math
import zlib
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from fogsim.core.parameters import NUMBER_OR_NAN, checked_parameters
from fogsim.errors import InputError
from fogsim.values.camera import Camera
from fogsim.values.image import Frame, read_only
from fogsim.values.light import Lamp

_SIGN_MAP_REACH, _SIGN_MAP_SIZE = 255.0, 2.0
"""Distance at which a sign's distance is 1 in the picture of the map, and size at which its size is 255 [m]."""

Measured = Annotated[float, NUMBER_OR_NAN]
"""A value from a sensor or a map; each method decides whether it can use infinity or NaN."""

FROM_ABOVE = (64, 64)
"""Rows and columns of the map from above: 4 m and 1 m each, the vehicle below the middle of the last row."""


@checked_parameters
@dataclass(frozen=True, slots=True)
class LeadMeasurement:
    """A radar-like measurement of the vehicle ahead.

    Attributes
    ----------
    distance : float
        Gap from the own front bumper to the lead's rear bumper, with sensor noise [m].
    relative_speed : float
        Lead's speed minus own speed, with sensor noise [m/s].
    """

    distance: Measured
    relative_speed: Measured


@checked_parameters
@dataclass(frozen=True, slots=True)
class SignSighting:
    """A traffic sign that the map says lies ahead.

    Attributes
    ----------
    sign_id : str
        Its id in the sign map.
    kind : str
        Sign code ("speed_limit", …).
    value : float
        What it says, for a speed limit the speed [m/s]; NaN where the map has no value.
    distance : float
        Distance ahead along the vehicle's heading [m].
    lateral : float
        Offset to the left of the vehicle's axis [m].
    diameter : float
        Size of its face [m].
    height : float
        Middle of its face above the plane of the road at the front bumper [m].
    facing : float
        How far its face is turned from square to the vehicle's axis, counterclockwise seen from above [rad].
    """

    sign_id: str
    kind: str
    value: Measured
    distance: Measured
    lateral: Measured
    diameter: Measured
    height: Measured = 2.2
    facing: Measured = 0.0


@checked_parameters
@dataclass(frozen=True, slots=True)
class LightMeasurement:
    """Readings of the light sensor behind the windscreen: how bright the sky is, and whether others' lamps are ahead.

    Attributes
    ----------
    illuminance : float
        Horizontal illuminance of the sky [lx].
    oncoming : bool
        Whether head lamps shine this way.
    preceding : bool
        Whether tail lamps are ahead.
    """

    illuminance: Measured
    oncoming: bool = False
    preceding: bool = False


@checked_parameters
@dataclass(frozen=True, slots=True)
class FogReport:
    """One measurement of the fog by another vehicle or by a sensor next to the road.

    Attributes
    ----------
    source : str
        Who has measured.
    number : int
        Which of the source's reports it is: a report that comes twice counts once.
    place : float
        Where, as a distance along the receiver's route [m].
    time : float
        When [s].
    extinction : float
        Extinction coefficient [1/m].
    relative_deviation : float
        Standard deviation of that relative to it, as stated by the source [-].
    """

    source: str
    number: int
    place: Measured
    time: Measured
    extinction: Measured
    relative_deviation: Measured


@checked_parameters
@dataclass(frozen=True, slots=True)
class SecondView:
    """The picture of a second camera to the right of the first, as its calibration has it: alike and parallel.

    Attributes
    ----------
    image : (rows, cols, 3) or (rows, cols) uint8, or uint16 of a camera of 10 or 12 bits
        Its pixels, of the same instant and camera model as the first one's; rows of both show the same things.
    baseline : float
        Stated distance between the optical centres [m].
    """

    image: NDArray[np.uint8] | NDArray[np.uint16]
    baseline: Measured

    def __post_init__(self) -> None:
        """Keep a read-only view of the image."""
        object.__setattr__(self, "image", read_only(self.image))


@checked_parameters
@dataclass(frozen=True, slots=True)
class Observation:
    """What one vehicle has at one instant.

    Attributes
    ----------
    frame : Frame or (rows, cols[, 3]) uint8, or uint16 of a camera of 10 or 12 bits
        The camera's image; a bare array serves where the time does not matter.
    speed : float
        Own speed by the odometer [m/s].
    lead : LeadMeasurement or None
        The tracked vehicle ahead, if the sensor has one.
    signs : tuple of SignSighting
        Signs ahead by the map, nearest first.
    camera_setback : float
        Distance of the camera behind the front bumper, from which distances count [m].
    lamps : Lamp or None
        Own lamps that are switched on, whether each of them burns or not; None where the vehicle does not report them.
    light : LightMeasurement or None
        Reading of the light sensor; None without one.
    reports : tuple of FogReport
        Reports of others on the fog since the previous instant.
    right : SecondView or None
        What the second camera of a stereo rig shows; None without one.
    scattering : float or None
        Extinction coefficient that a forward-scatter sensor on board measures at its place [1/m]; None without one.
    camera_trouble : str
        Why the frame does not show the road of now, as far as the vehicle itself can detect; empty if it seems to.
    """

    frame: Frame | NDArray[np.uint8] | NDArray[np.uint16]
    speed: Measured = 0.0
    lead: LeadMeasurement | None = None
    signs: tuple[SignSighting, ...] = ()
    camera_setback: Measured = 0.0
    lamps: Lamp | None = None
    light: LightMeasurement | None = None
    reports: tuple[FogReport, ...] = ()
    right: SecondView | None = None
    scattering: Measured | None = None
    camera_trouble: str = ""

    def __post_init__(self) -> None:
        """Keep a read-only view of a bare array."""
        object.__setattr__(self, "frame", read_only(self.frame))

    @property
    def image(self) -> NDArray[np.uint8] | NDArray[np.uint16]:
        """(rows, cols[, 3]) uint8, or uint16 of a camera of 10 or 12 bits: the pixels."""
        return self.frame.image if isinstance(self.frame, Frame) else self.frame

    @property
    def time(self) -> float:
        """Instant of the exposure [s]; 0 for a bare array."""
        return self.frame.time if isinstance(self.frame, Frame) else 0.0

    @property
    def sign_map(self) -> NDArray[np.uint8]:
        """(rows, cols, 3) uint8: the signs of the map where the assumed camera and the believed pose put them.

        Channels: kind (`sign_kind_code`); distance, 255 at the bumper and 1 at 254 m or more; size, 255 for a face of
        2 m or more; all 0 where there is no sign. What hides a sign in the world is unknown to it. It is drawn whenever
        it is asked for.

        Raises
        ------
        InputError
            If the frame is a bare array, whose camera is unknown.
        """
        if not isinstance(self.frame, Frame):
            raise InputError("sign_map: expected a fogsim.Frame, whose camera says where signs are; got a bare array")
        camera = self.frame.camera
        picture = np.zeros((camera.height, camera.width, 3), np.uint8)
        # Nearer signs hide farther ones.
        for sign in sorted(self.signs, key=lambda one: -one.distance):
            _paint_sign(picture, sign, camera, self.camera_setback)
        return picture

    @property
    def sign_map_from_above(self) -> NDArray[np.uint8]:
        """`FROM_ABOVE` uint8: kinds of the signs ahead by the map (`sign_kind_code`), 0 where there is none."""
        rows, columns = FROM_ABOVE
        picture = np.zeros(FROM_ABOVE, np.uint8)
        for sign in sorted(self.signs, key=lambda one: -one.distance):
            row, column = rows - 1 - math.floor(sign.distance / 4.0), columns // 2 - math.floor(sign.lateral) - 1
            if 0 <= row < rows and 0 <= column < columns:
                picture[row, column] = sign_kind_code(sign.kind)
        return picture


def sign_kind_code(kind: str) -> int:
    """Number of a kind of sign in pictures of the map, 1 … 255: the same for the same kind, always."""
    return 1 + zlib.crc32(f"sign kind {kind}".encode()) % 255


def sign_map_values(kind: str, distance: float, diameter: float) -> tuple[int, int, int]:
    """Channels of a sign's pixels in pictures of the map (see `Observation.sign_map`), by its measures [m]."""
    nearness = min(max(round(_SIGN_MAP_REACH - distance), 1), 255)
    return sign_kind_code(kind), nearness, min(round(255.0 * diameter / _SIGN_MAP_SIZE), 255)


def sign_coordinates(sign: SignSighting, camera: Camera, setback: float) -> tuple[float, float, float]:
    """Where a sign's face is for the camera, before its roll: to the right, down, and in depth [m]."""
    ahead, up = sign.distance + setback, sign.height - camera.mount_height
    cosine, sine = math.cos(camera.pitch), math.sin(camera.pitch)
    return -sign.lateral, -(ahead * sine + up * cosine), ahead * cosine - up * sine


def sign_place(sign: SignSighting, camera: Camera, setback: float) -> tuple[float, float, float, float] | None:
    """Ellipse of a sign's face: column and row of its middle, half width and height [px]; None if behind."""
    right, down, depth = sign_coordinates(sign, camera, setback)
    if depth <= 0.0:
        return None
    scale = camera.focal_length / depth
    x, y = scale * right, scale * down
    cosine, sine = math.cos(camera.roll), math.sin(camera.roll)
    u, v = camera.principal_point[0] + x * cosine - y * sine, camera.principal_point[1] + x * sine + y * cosine
    tall = 0.5 * scale * sign.diameter
    return u, v, tall * abs(math.cos(sign.facing)), tall


def _paint_sign(picture: NDArray[np.uint8], sign: SignSighting, camera: Camera, setback: float) -> None:
    """Paint the face of a sign into the map's picture, as an ellipse; nothing if it is behind the camera."""
    place = sign_place(sign, camera, setback)
    if place is None:
        return
    u, v, wide, tall = place
    wide, tall = max(wide, 0.5), max(tall, 0.5)
    left, right = max(math.ceil(u - wide), 0), min(math.floor(u + wide) + 1, camera.width)
    top, bottom = max(math.ceil(v - tall), 0), min(math.floor(v + tall) + 1, camera.height)
    if left >= right or top >= bottom:
        return
    inside = ((np.arange(left, right) - u) / wide) ** 2 + ((np.arange(top, bottom)[:, None] - v) / tall) ** 2 <= 1.0
    picture[top:bottom, left:right][inside] = sign_map_values(sign.kind, sign.distance, sign.diameter)
