"""One picture of the vehicle ahead, cut from a frame."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera
from fogsim.vision.light.clipped_sky import Clipping, clipping
from fogsim.vision.light.luminance import linear_luminance
from fogsim.vision.lines.horizon import PITCH_DEVIATION, levelled
from fogsim.vision.region.road_image import MIN_AIRLIGHT, CannotTellError
from fogsim.vision.vehicle.airlight import RoadFall, airlight_beside, check_road, hidden_beside, road_before, road_fall
from fogsim.vision.vehicle.patch import Patch
from fogsim.vision.vehicle.rear_localisation import WIDTHS, RearBox, search_window
from fogsim.vision.vehicle.vehicle_crop import noise_gain

HALF_WIDTH, MIDDLE, HALF_HEIGHT = 0.42, 0.42, 0.32
"""The part of a rear that is compared, in widths of the vehicle: half its width, its middle above the foot, and half
its height [-]. It ends below the roof of the flattest car and above the shadow under it."""

MARGIN, MARGIN_PIXELS = 0.12, 8
"""What a stored picture holds around that part: widths of the vehicle [-] and pixels."""

MOST_NOISE = 0.1
"""Noise of a sky relative to its luminance beyond which it is none [-]."""

FULL = 254.7
"""Mean luminance of a sky that is saturated; a little less, and its noise still shows where it is [linear levels]."""

TOP = 2.2
"""Height up to which the light of a rear is compared [m]: dark windows tell the most, sky above a car nothing."""

LEAST_WIDTH = 8.0
"""Narrowest vehicle whose picture is compared [px]."""


@dataclass(frozen=True, slots=True)
class Sighting:
    """One picture of the vehicle ahead.

    Attributes
    ----------
    distance : float
        From the camera to its rear [m].
    patch : Patch
        The picture, about the middle of its body.
    sky, noise : float
        Luminance of the sky, and deviation of single pixels of the vehicle [linear grey levels].
    width : float
        Of the vehicle [px].
    pitch_deviation : float
        Rows by which pitch moves the picture between frames [px].
    metre : float
        Pixels in a metre at the vehicle [px/m].
    lost : Clipping or None
        What clipping takes of the sky; None if the sky is saturated, and its luminance unknown.
    number : int
        Number of the measured range.
    """

    distance: float
    patch: Patch
    sky: float
    noise: float
    width: float
    pitch_deviation: float
    metre: float
    lost: Clipping | None
    number: int = 0


@dataclass(frozen=True, slots=True)
class Crop:
    """The part of an image about a vehicle, the sky's light, and how the road's contrast to it falls."""

    luminance: NDArray[np.float32]
    origin: tuple[int, int]
    sky: float
    noise: float
    pitch_deviation: float
    road: RoadFall
    metre: float
    lost: Clipping | None


def vehicle_crop(image: NDArray[np.uint8] | NDArray[np.uint16], camera: Camera, distance: float) -> Crop:
    """Cut out of a frame where a vehicle at a distance can be.

    Parameters
    ----------
    image : (rows, cols) or (rows, cols, 3) uint8 or uint16
        An image of the camera.
    camera : Camera
        The told calibration.
    distance : float
        From the camera to the vehicle's rear [m].

    Raises
    ------
    CannotTellError
        If no vehicle can be seen there, or no sky by day, or lamps light the road.
    """
    if not 0.5 < distance < math.inf:
        raise CannotTellError(f"a range of {distance:.1f} m is none of a vehicle ahead")
    scale = camera.focal_length / distance
    if WIDTHS[1] * scale < LEAST_WIDTH:
        raise CannotTellError("the vehicle ahead is too small in the image")
    region = search_window(camera, distance)
    if region is None:
        raise CannotTellError("the vehicle ahead is outside the image")
    rows, cols = region
    level = levelled(image, camera)
    luminance = linear_luminance(level[rows, cols], camera.response, camera.bits)
    sky, noise, lost = _sky(level, camera, distance)

    def luminance_of(rows: slice, cols: slice) -> NDArray[np.float32]:
        return linear_luminance(level[rows, cols], camera.response, camera.bits)

    check_road(luminance_of(*road_before(camera, distance)), sky)
    road = road_fall(luminance_of, camera, distance, sky)
    pitch = 1.5 * PITCH_DEVIATION * camera.focal_length
    noise *= noise_gain(luminance, sky, camera)
    return Crop(luminance, (cols.start, rows.start), sky, noise, pitch, road, scale, lost)


def _sky(
    image: NDArray[np.uint8] | NDArray[np.uint16], camera: Camera, distance: float
) -> tuple[float, float, Clipping | None]:
    """Luminance of the sky above the horizon, deviation of its pixels [linear grey levels], and what clipping takes."""
    bottom = min(math.floor(camera.horizon_row - 3), camera.height)
    if bottom < 2:
        raise CannotTellError("no sky is in the image")
    top, side = max(bottom - max(camera.height // 16, 4), 0), camera.width // 6
    pixels = image[top:bottom, side : camera.width - side]
    luminance = linear_luminance(pixels, camera.response, camera.bits)
    bright = float(np.percentile(luminance, 80, method="lower"))
    if bright < MIN_AIRLIGHT:
        raise CannotTellError("too dark above the horizon: this is a daytime method")
    even = np.abs(luminance - bright) <= max(0.03 * bright, 4.0)
    across = np.abs(np.diff(luminance, axis=1))
    # Half of the neighbours are of one surface even where trees stand before the sky.
    noise = 1.4826 * float(np.median(across)) / math.sqrt(2.0)
    if noise > MOST_NOISE * bright:
        raise CannotTellError("what is above the horizon is no sky")
    hidden = hidden_beside(camera.focal_length, distance)
    mean = airlight_beside(luminance, bright, noise, camera.principal_point[0] - side, hidden)
    lost = clipping(pixels[even], camera)
    known = lost if lost.noise > 0.0 or mean < FULL else None
    return mean + lost.loss, max(noise, lost.noise), known


def sighting_of(crop: Crop, distance: float, window: RearBox, blur: float) -> Sighting:
    """Cut the picture of a vehicle out, with room about it for what is not known of its place.

    Parameters
    ----------
    crop : Crop
        Where it can be.
    distance : float
        From the camera to its rear [m].
    window : RearBox
        Where it is or is expected [px].
    blur : float
        Standard deviation of the lens' blur [px].

    Raises
    ------
    CannotTellError
        If it is too small or outside the image.
    """
    if window.width < LEAST_WIDTH:
        raise CannotTellError("the vehicle ahead is too small in the image")
    row, col = window.foot - MIDDLE * window.width - crop.origin[1], window.column - crop.origin[0]
    half_width, half_height = HALF_WIDTH * window.width, HALF_HEIGHT * window.width
    margin = MARGIN * window.width + MARGIN_PIXELS
    above = max(half_height, TOP * crop.metre - MIDDLE * window.width)
    rows = max(math.floor(row - above - margin), 0), math.ceil(row + half_height + margin) + 1
    cols = max(math.floor(col - half_width - margin), 0), math.ceil(col + half_width + margin) + 1
    pixels = crop.luminance[rows[0] : max(rows[1], 0), cols[0] : max(cols[1], 0)].astype(np.float64)
    patch = Patch(pixels, col - cols[0], row - rows[0], half_width, half_height, blur)
    inside = 0 <= patch.column < pixels.shape[1] and 0 <= patch.row < pixels.shape[0]
    if not inside or min(pixels.shape) < LEAST_WIDTH / 2:
        raise CannotTellError("the vehicle ahead is outside the image")
    return Sighting(
        distance, patch, crop.sky, max(crop.noise, 0.1), window.width, crop.pitch_deviation, crop.metre, crop.lost
    )
