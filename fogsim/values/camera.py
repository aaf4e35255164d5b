"""The calibration of a camera and where it is."""

import math
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from numbers import Real

from fogsim.errors import InputError, shown, suggest

_BIT_DEPTHS = (8, 10, 12)
"""Bit depths that a camera can have."""


_MOST_BLACK = 0.25
"""Largest black level that a camera can have, as a share of full scale [-]."""


class Response(StrEnum):
    """How a camera turns exposure into pixel values: proportional, power 1/2.2, or IEC 61966-2-1."""

    LINEAR = "linear"
    GAMMA = "gamma"
    SRGB = "srgb"


def _finite(value: object) -> bool:
    """Whether a value is a number, and neither NaN nor infinite; True and False are none."""
    return not isinstance(value, bool) and isinstance(value, Real) and math.isfinite(value)


def _whole(value: object) -> bool:
    """Whether a value is a whole number, of whatever type."""
    return isinstance(value, Real) and _finite(value) and float(value).is_integer()


@dataclass(frozen=True)
class Camera:
    """A pinhole camera on a vehicle, looking along the vehicle's axis.

    Pixel (row v, column u) has its centre at integer coordinates; v grows downward.

    Attributes
    ----------
    width, height : int
        Size of the image [px].
    focal_length : float
        Focal length α = f / pixel pitch [px].
    principal_point : tuple of float
        (u0, v0) [px].
    mount_height : float
        Height of the optical centre above the road [m].
    pitch : float
        Angle of the optical axis below the horizontal [rad]; positive looks down.
    roll : float
        Rotation about the optical axis [rad]; positive turns the image's right side down.
    response : Response
        Curve from exposure to pixel value. The default takes values for light itself, as those of sensors and of this
        package's own arithmetic are; photographs and videos of 8 bits mostly have ``srgb``, which a camera file and a
        scenario therefore default to.
    bits : int
        Bit depth of the pixel values, which are 0 … 2^bits − 1: 8, 10 or 12.
    black_level : float
        Share of full scale, before the response, at which the sensor reads no light, so that noise about the dark is
        not cut off: 0 … 0.25.
    """

    width: int
    height: int
    focal_length: float
    principal_point: tuple[float, float]
    mount_height: float
    pitch: float = 0.0
    roll: float = 0.0
    response: Response = Response.LINEAR
    bits: int = 8
    black_level: float = 0.0

    def __post_init__(self) -> None:
        """Refuse a calibration that no camera can have."""
        self._check_kinds()
        for name in ("width", "height"):
            if not (_whole(getattr(self, name)) and getattr(self, name) >= 1):
                raise InputError(
                    f"camera {name} must be a whole number of pixels ≥ 1, got {shown(getattr(self, name))}"
                )
        for name in ("focal_length", "mount_height"):
            if not (_finite(getattr(self, name)) and getattr(self, name) > 0):
                raise InputError(f"camera {name} must be positive and finite, got {shown(getattr(self, name))}")
        if not (_finite(self.pitch) and abs(self.pitch) < math.pi / 2):
            raise InputError(f"camera pitch must lie within ±π/2 rad, got {shown(self.pitch)}")
        if not (_finite(self.roll) and abs(self.roll) <= math.pi):
            raise InputError(f"camera roll must lie within ±π rad, got {shown(self.roll)}")
        if not (_whole(self.bits) and self.bits in _BIT_DEPTHS):
            raise InputError(f"camera bits must be 8, 10 or 12, got {shown(self.bits)}")
        if not (_finite(self.black_level) and 0 <= self.black_level <= _MOST_BLACK):
            raise InputError(f"camera black_level must lie in 0 … {_MOST_BLACK:g}, got {shown(self.black_level)}")
        # For other numbers, such as NumPy's short ones, kernels would be compiled again, and count less exactly.
        self._take(int, "width", "height", "bits")
        self._take(float, "focal_length", "mount_height", "pitch", "roll", "black_level")

    def _take(self, kind: type[int | float], *names: str) -> None:
        for name in names:
            object.__setattr__(self, name, kind(getattr(self, name)))

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        """Of the numbers in which cameras mostly differ: what is remembered by camera is looked up for each frame."""
        return hash((self.width, self.focal_length, self.pitch))

    def _check_kinds(self) -> None:
        """Take a response by its name and any pair of numbers for the principal point."""
        try:
            object.__setattr__(self, "response", Response(self.response))
        except ValueError:
            raise InputError(
                f"camera response: {suggest(str(self.response), Response)}, got {shown(self.response)}"
            ) from None
        try:
            u0, v0 = self.principal_point
        except (TypeError, ValueError):
            u0 = v0 = math.nan
        if not (_finite(u0) and _finite(v0)):
            raise InputError(f"camera principal_point must be two finite numbers, got {shown(self.principal_point)}")
        object.__setattr__(self, "principal_point", (float(u0), float(v0)))

    @cached_property
    def horizon_row(self) -> float:
        """Row of the horizon at the principal column, v_h = v0 − α tan θ [px] (negru2013 eq. 6)."""
        return self.principal_point[1] - self.focal_length * math.tan(self.pitch)

    @cached_property
    def row_distance(self) -> float:
        """λ = α H / cos θ [px·m], so that a road point on row v lies λ / (v − v_h) ahead (negru2013 eq. 11)."""
        return self.focal_length * self.mount_height / math.cos(self.pitch)


@dataclass(frozen=True, slots=True)
class CameraPose:
    """Where a camera is in the world and where its vehicle heads.

    Attributes
    ----------
    position : tuple of float
        (x, y, z) of the optical centre [m]: east, north, up.
    heading : float
        Direction of travel, counterclockwise from east [rad].
    grade : float
        Upward inclination of the vehicle's body, that of the road under it and its own pitch on the road together
        [rad]; the camera's own pitch is measured from it.
    road_grade : float
        Inclination of the road alone, in the direction of travel [rad]; positive uphill.
    """

    position: tuple[float, float, float]
    heading: float
    grade: float = 0.0
    road_grade: float = 0.0
