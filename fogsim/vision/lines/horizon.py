"""Where the horizon is in the image, and how surely."""

import math
from dataclasses import dataclass, replace
from typing import Annotated, Any

import cv2
import numpy as np
from numpy.typing import NDArray

from fogsim.core.parameters import Range
from fogsim.values.camera import Camera

_MIN_COLS, MIN_ROWS = 32, 16
"""A road narrower than this, or lower below its horizon, shows no curve [px]."""

PITCH_DEVIATION = math.radians(0.1)
"""Standard deviation of a vehicle's pitch about its calibration [rad]: load, suspension, uneven road."""

PitchDeviation = Annotated[float, Range(1e-6, 0.2, "rad")]
"""Standard deviation of the pitch that methods assume [rad]."""

SCALE_DEVIATION = 0.054
"""Usual relative deviation of distances on the road: 5 % by the height and 2 % by the focal length of a camera [-]."""

ScaleDeviation = Annotated[float, Range(0.0, 1.0)]
"""Relative standard deviation of focal length × mount height, with which distances on the road go [-]."""


class CannotTellError(Exception):
    """No mistake of anyone's: the honest answer to some images, which an estimator turns into an invalid estimate."""


@dataclass(frozen=True, slots=True)
class Horizon:
    """The horizon as a straight line in the image."""

    row: float  # Its row at the principal column [px]; not necessarily inside the image
    standard_deviation: float  # Standard deviation of that row [px]


def calibrated_horizon(camera: Camera, pitch_deviation: float = PITCH_DEVIATION) -> Horizon:
    """Horizon from the calibrated pitch: v_h = v0 − α tan θ (negru2013 eq. 6).

    Returns row and its standard deviation, α / cos² θ times that of the pitch. Takes `pitch_deviation` [rad].
    """
    deviation = camera.focal_length / math.cos(camera.pitch) ** 2 * pitch_deviation
    return Horizon(row=camera.horizon_row, standard_deviation=deviation)


def weighted_mean(first: Horizon, second: Horizon) -> Horizon:
    """Mean of two independent measurements of the horizon, weighted by one over their variances."""
    apart = math.hypot(first.standard_deviation, second.standard_deviation)
    share = (first.standard_deviation / apart) ** 2
    deviation = first.standard_deviation * second.standard_deviation / apart
    return Horizon(first.row + share * (second.row - first.row), deviation)


def levelled(image: NDArray[np.uint8] | NDArray[np.uint16], camera: Camera) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """Turn an image about the principal point such that its horizon is level.

    Returns the image itself if the camera has no roll; else corners that it does not cover repeat its border (rows,
    cols). Takes `image` (rows, cols).
    """
    if camera.roll == 0.0:
        return image
    if camera.roll < 0.0:
        # OpenCV rounds coordinates downward: so a mirrored image is the mirror image of what an image becomes.
        u0, v0 = camera.principal_point
        other = replace(camera, roll=-camera.roll, principal_point=(camera.width - 1 - u0, v0))
        turned: NDArray[Any] = np.ascontiguousarray(image[:, ::-1])
        upright: NDArray[Any] = np.ascontiguousarray(levelled(turned, other)[:, ::-1])
        return upright
    # Positive roll turns the right side down, and OpenCV counts angles counterclockwise: the same angle undoes it.
    turn = cv2.getRotationMatrix2D(camera.principal_point, math.degrees(camera.roll), 1.0)
    size = (camera.width, camera.height)
    level: NDArray[Any] = cv2.warpAffine(image, turn, size, borderMode=cv2.BORDER_REPLICATE)
    return level


def why_no_road(camera: Camera) -> str:
    """Say why a camera can never show a foggy road before a sky; empty if it can."""
    if abs(camera.roll) > math.pi / 4:
        return "the camera lies on its side or is upside-down"
    if not 4.0 <= camera.horizon_row <= camera.height - 1:
        return f"the horizon (row {camera.horizon_row:.1f}) is outside the image"
    if camera.height - 1 - camera.horizon_row < MIN_ROWS or camera.width < _MIN_COLS:
        return "the image is too small to show a curve"
    return ""
