"""The part of a daytime image in which the vehicle ahead must be, as contrast to the sky."""

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera, Response
from fogsim.vision.light.daylight import TOO_DARK, CannotTellError
from fogsim.vision.light.luminance import Clipping, clipping, linear_pixels, linear_table
from fogsim.vision.light.medians import median
from fogsim.vision.light.pixel_kernels import LinearPixels, Pixels, part_luminance
from fogsim.vision.lines.horizon import calibrated_horizon, levelled
from fogsim.vision.strips.airlight_slopes import USUAL_EXTINCTION, RowAirlight, row_airlight
from fogsim.vision.strips.sky import Sky, sky_above
from fogsim.vision.vehicle.airlight import (
    RoadFall,
    Rows,
    check_road,
    hidden_at_side,
    neighbouring_airlight,
    road_before,
    road_fall,
)
from fogsim.vision.vehicle.contrast_ratio import RearPicture
from fogsim.vision.vehicle.rear_localisation import STANDS_OUT, WIDTHS, RearBox, localise_rear, search_window

_MIN_AIRLIGHT = 6.0
"""Sky darker than this is no day [linear grey levels]."""

MOST_NOISE = 0.1
"""Noise of a sky relative to its luminance beyond which it is none [-]."""

_SKY_CORE, _SKY_SHARE = 0.08, 0.25
"""Relative half-width of the luminances that count as sky, and how much of the middle of the image above the horizon
must have them [-]."""

_SKY_HEIGHT = 0.06
"""How far above the horizon the airlight is read [rad]; less where the image ends."""

_LEAST_WIDTH = 3.0
"""Narrowest vehicle that is looked at [px]."""


Luminance = NDArray[np.float32]


class SkyReading(NamedTuple):
    """The airlight as a method reads it above the horizon."""

    # luminance, noise: its luminance, and the deviation of its single pixels [linear grey levels]
    luminance: float
    noise: float
    clipping: Clipping | None  # What clipping takes of it; None if it is saturated, and its luminance unknown
    is_clipped: bool  # Whether it may be brighter than it looks
    # Relative deviation of the airlight before the vehicle from it, where that is another by elevation [-]
    deviation: float = 0.0


@dataclass(frozen=True, slots=True)
class LevelledRows:
    """Rows that were taken relative to their own airlight, as it is with some extinction."""

    sky: Sky  # The sky that brightens upward
    camera: Camera  # The assumed calibration
    # rows, above: rows of the image that were cut out, and those above the horizon where the airlight is read
    rows: slice
    above: slice
    extinction: float  # With which their airlight was reckoned [1/m]

    def change(self, extinction: float) -> NDArray[np.float64]:
        """By which factor luminance over the airlight is another with another extinction, (rows,) float64 [-].

        Takes `extinction` [1/m].
        """
        was, now = (row_airlight(self.sky, self.camera, k) for k in (self.extinction, extinction))
        if was is None or now is None:
            return np.ones(self.rows.stop - self.rows.start)
        change = was.share / now.share
        return np.asarray(change[self.rows] / change[self.above].mean(), np.float64)


@dataclass(frozen=True, slots=True)
class VehicleCrop:
    """Where in an image the vehicle ahead is looked for."""

    camera: Camera  # The assumed calibration
    depth: float  # From the camera to the vehicle's rear [m]
    luminance: NDArray[np.float32]  # (rows, cols): The part of the image [linear grey levels]
    origin: tuple[int, int]  # Column and row of the whole image that its first pixel is
    sky: SkyReading  # The airlight
    noise: float  # Deviation of its single pixels [linear grey levels]
    road: RoadFall  # How the contrast of the nearest road falls
    levelled: LevelledRows | None = None  # How rows were taken relative to their own airlight; None where that is even

    @property
    def scale(self) -> float:
        """Pixels in a metre at the vehicle [px/m]."""
        return self.camera.focal_length / self.depth

    def localise(self) -> RearPicture:
        """Find a vehicle that has not been seen before."""
        window = localise_rear(self.luminance, self.origin, self.camera, self.depth, self.noise)
        if window is None or window.width < _LEAST_WIDTH:
            raise CannotTellError("no vehicle stands out where the range says that there is one")
        return self.picture(RearBox(window.column, self._road_row, window.width), self.scale)

    def expected(self, aside: float, width: float) -> RearPicture:
        """Picture of a vehicle where it is expected (`aside`, `width` [m])."""
        column = self.camera.principal_point[0] + aside * self.scale
        return self.picture(RearBox(column, self._road_row, width * self.scale), self.scale)

    def picture(self, window: RearBox, scale: float) -> RearPicture:
        """Picture of what stands at a place in the image (`scale` [px/m])."""
        spread = 0.0 if self.sky.clipping is None else self.sky.clipping.spread
        contrast = 1.0 - self.luminance.astype(np.float64) / self.sky.luminance
        return RearPicture(
            contrast=contrast,
            noise=self.noise / self.sky.luminance,
            column=window.column - self.origin[0],
            foot=window.foot - self.origin[1],
            scale=scale,
            width=window.width / scale,
            clipped=(255.0 / self.sky.luminance - 1.0, spread / self.sky.luminance),
        )

    def box_of(self, picture: RearPicture) -> RearBox:
        """Place in the image."""
        column, foot = picture.column + self.origin[0], picture.foot + self.origin[1]
        return RearBox(column, foot, picture.width * picture.scale)

    def lateral_offset(self, picture: RearPicture) -> float:
        """How far the vehicle is to the right of the axis [m]."""
        return (picture.column + self.origin[0] - self.camera.principal_point[0]) / self.scale

    def pitch_error(self, picture: RearPicture) -> float:
        """How far above where the assumed pitch has it the vehicle is [rad]."""
        return (self._road_row - picture.foot - self.origin[1]) / self.camera.focal_length

    @property
    def _road_row(self) -> float:
        return self.camera.horizon_row + self.camera.row_distance / self.depth


def vehicle_crop(
    camera: Camera,
    depth: float,
    luminance_of: Callable[[Rows, slice], Luminance],
    read_sky: Callable[[], SkyReading],
    least_noise: float = 0.0,
    share: NDArray[np.float64] | None = None,
) -> VehicleCrop:
    """Cut out of a frame where a vehicle can be.

    Takes `depth` [m], `luminance_of` [linear grey levels], `least_noise` [linear grey levels], `share` (rows,).
    """
    region = search_window(camera, depth)
    if region is None:
        raise CannotTellError("the vehicle ahead is too small in the image, or outside it")
    sky = read_sky()
    luminance = luminance_of(*region)
    check_road(luminance_of(*road_before(camera, depth)), sky.luminance)
    return VehicleCrop(
        camera=camera,
        depth=depth,
        luminance=luminance,
        origin=(region[1].start, region[0].start),
        sky=sky,
        noise=max(sky.noise * noise_gain(luminance, sky.luminance, camera), least_noise),
        road=road_fall(luminance_of, camera, depth, sky.luminance, share),
    )


def daytime_crop(
    image: Pixels, camera: Camera, depth: float, pitch_deviation: float, extinction: float = USUAL_EXTINCTION
) -> VehicleCrop:
    """Cut out of a frame where a vehicle can be, before an even sky or one that brightens upward.

    In the latter case the airlight before the vehicle darkens downward, and each row is taken relative to its own.

    Takes `image` (rows, cols), `depth` [m], `pitch_deviation` [rad], `extinction` [1/m].
    """
    if abs(camera.roll) > math.pi / 4:
        raise CannotTellError("the camera lies on its side or is upside-down")
    if not 1.0 < depth < math.inf:
        raise CannotTellError(f"a range of {depth:.1f} m is none of a vehicle ahead")
    pixels = linear_pixels(levelled(image, camera), camera)
    margin = 3.0 * calibrated_horizon(camera, pitch_deviation).standard_deviation + 2.0
    sky = sky_above(pixels, camera, margin)
    airlight = None if sky is None else row_airlight(sky, camera, extinction)
    luminance = partial(_luminance, pixels) if airlight is None else partial(_levelled_out, pixels, airlight)
    crop = vehicle_crop(
        camera,
        depth,
        luminance,
        partial(_daylight, _DaytimeFrame(pixels, camera, margin, sky, airlight, luminance), depth),
        least_noise=0.3 * 255.0 / 2**camera.bits,
        share=None if airlight is None else airlight.share,
    )
    if sky is None or airlight is None:
        return crop
    first, count = crop.origin[1], crop.luminance.shape[0]
    rows = slice(first, first + count)
    return replace(crop, levelled=LevelledRows(sky, camera, rows, _rows_above(camera, margin), extinction))


def _luminance(pixels: LinearPixels, rows: Rows, cols: slice) -> NDArray[np.float32]:
    if isinstance(rows, slice):
        rows = np.arange(*rows.indices(len(pixels.pixels)))
    left, right, _ = cols.indices(pixels.pixels.shape[1])
    return part_luminance(pixels, rows, left, right)


def _levelled_out(pixels: LinearPixels, airlight: RowAirlight, rows: Rows, cols: slice) -> NDArray[np.float32]:
    """Luminance over the share of the airlight that its rows have."""
    share: NDArray[np.float32] = airlight.share[rows].astype(np.float32)
    return np.asarray(_luminance(pixels, rows, cols) / share[:, None], np.float32)


class _DaytimeFrame(NamedTuple):
    """A frame, the margin below its sky [px], that sky, and the airlight of its rows where that is not even."""

    pixels: LinearPixels
    camera: Camera
    margin: float
    sky: Sky | None
    airlight: RowAirlight | None
    luminance_of: Callable[[Rows, slice], Luminance]


def _rows_above(camera: Camera, margin: float) -> slice:
    """Rows in which the airlight is read."""
    bottom = min(max(math.floor(camera.horizon_row - margin), 1), camera.height)
    return slice(max(bottom - max(math.ceil(_SKY_HEIGHT * camera.focal_length), 4), 0), bottom)


def _daylight(day: _DaytimeFrame, depth: float) -> SkyReading:
    """Sky by day, or the reason why this is none."""
    pixels, camera, margin, sky = day.pixels, day.camera, day.margin, day.sky
    if sky is None or sky.luminance < _MIN_AIRLIGHT:
        raise CannotTellError(TOO_DARK)
    if sky.saturated > 0.9:
        raise CannotTellError("the sky is saturated")
    rows = _rows_above(camera, margin)
    light = day.luminance_of(rows, slice(camera.width // 6, camera.width - camera.width // 6))
    level = sky.luminance if day.airlight is None else day.airlight.level
    core = np.count_nonzero(np.abs(light - level) <= _SKY_CORE * level + 4.0 * sky.noise)
    if sky.noise > MOST_NOISE * level or not light.size or core / light.size < _SKY_SHARE:
        raise CannotTellError("what is above the horizon is no sky")
    hidden = hidden_at_side(camera.focal_length, depth)
    axis = camera.principal_point[0] - camera.width // 6
    luminance = neighbouring_airlight(light, level, sky.noise, axis, hidden)
    clear = np.abs(light - luminance) <= 4.0 * max(sky.noise, 1.0)
    if not clear.any():
        raise CannotTellError("no part of the sky is as bright as the sky next to the vehicle")
    sides = pixels.pixels[rows, camera.width // 6 : camera.width - camera.width // 6]
    lost = clipping(sides[clear], camera) if sides.max() == 2**camera.bits - 1 else Clipping(0.0, 0.0, 0.0)
    # What clipping takes from the sky, its noise shows; then it is no longer clipped.
    is_clipped = not lost.noise > 0.0 and sky.is_clipped
    deviation = 0.0
    if day.airlight is not None:
        foot = min(math.ceil(camera.horizon_row + camera.row_distance / depth), camera.height - 1)
        deviation = float(day.airlight.deviation[max(foot, 0)])
    return SkyReading(luminance + lost.loss, max(sky.noise, lost.noise), lost, is_clipped, deviation)


def noise_gain(luminance: NDArray[np.float32], sky: float, camera: Camera) -> float:
    """How much larger noise is on a vehicle than on the sky once the response is undone, as noise is of the signal.

    Takes `luminance` (rows, cols) [linear grey levels], `sky` [linear grey levels].
    """
    table, slope = _table_with_slope(camera.response, camera.bits, camera.black_level)
    here, there = np.minimum(table.searchsorted((median(luminance), sky)), table.size - 1)
    return float(slope[here] / slope[there])


@functools.lru_cache(maxsize=8)
def _table_with_slope(
    response: Response, bits: int, black_level: float
) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    table = linear_table(response, bits, black_level)
    return table, np.gradient(table.astype(np.float64))


_NEAREST, STEP = 8.0, 1.1
"""Nearest range at which an unknown vehicle is searched [m], and the ratio of each range to the next [-]."""

_LEAST_RANGED = 8.0
"""Narrowest vehicle that is searched [px]."""

_USUAL_WIDTH, _WIDTH_SPREAD, _UNUSUAL = 1.8, 0.15, 0.4
"""Median width of vehicles [m], the standard deviation of its logarithm, and how far that may be from it [-]."""

_FOOT = 0.15
"""Standard deviation of the height of what is taken for the foot [m]: in fog a bumper's lower edge is clearer."""

_KNOWN_WIDTH = 0.02
"""Relative standard deviation of a width that is given: edges are rounded [-]."""

_CONSISTENT = 0.1
"""Largest relative difference of a range by the contact with the road from the range that is tried [-]."""

_EDGE, _REGISTERED = 0.3, 0.2
"""Standard deviation of the width between two edges, and of one by registration [px]."""

_MOST_JUMP = 12.0
"""Change of range between frames by more than which the vehicle is another one [m]."""


def registered_deviation(camera: Camera, distance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Standard deviation of ranges whose pictures were registered [m]."""
    return np.asarray(_REGISTERED * distance**2 / (_USUAL_WIDTH * camera.focal_length))


class CameraRange:
    """Ranges to a vehicle by the width of its picture, d = f W / w.

    Its width W is known, or follows from the row at which it stands on the road, d = λ / (v − v_h), weighted over its
    pictures, for the nearest show it best, and from the usual width of vehicles. An error of W is common to all ranges,
    and so goes into k as a factor.

    Takes `width` [m], `pitch_deviation` [rad].
    """

    def __init__(self, camera: Camera, width: float | None, pitch_deviation: float) -> None:
        self._camera, self._known, self._pitch_deviation = camera, width, pitch_deviation
        self.reset()

    def reset(self) -> None:
        """Forget the vehicle."""
        self._distance: float | None = None
        self._first_width, self._weighted, self._weight, self._nearest = 0.0, 0.0, 0.0, math.inf

    @property
    def scale(self) -> float:
        """What true ranges are over the measured ones, by all pictures and the usual width of vehicles [-]."""
        if self._known:
            return 1.0
        share = (self.scale_deviation / _WIDTH_SPREAD) ** 2
        width = (1.0 - share) * self._weighted / self._weight + share * math.log(_USUAL_WIDTH)
        return math.exp(width) / self._first_width

    @property
    def scale_deviation(self) -> float:
        """Relative standard deviation of all ranges together [-]."""
        if self._known:
            return _KNOWN_WIDTH
        # The pitch may be off by as much in every picture; the nearest shows that least.
        by_contact = math.hypot(self._pitch_deviation * self._nearest, _FOOT) / self._camera.mount_height
        return 1.0 / math.hypot(1.0 / by_contact, 1.0 / _WIDTH_SPREAD)

    def measure(self, crop_at: Callable[[float], VehicleCrop]) -> tuple[float, float]:
        """Range from the camera, and its standard deviation that is not common to all [m] (`crop_at` [m])."""
        box = self._search(crop_at) if self._distance is None else self._follow(crop_at, self._distance)
        width = self._known or self._first_width
        distance = width * self._camera.focal_length / box.width
        if self._distance is not None and abs(distance - self._distance) > _MOST_JUMP:
            raise CannotTellError("the vehicle ahead no longer stands out")
        self._distance = distance
        contact = self._contact(box)
        if contact is not None and not self._known:
            weight = contact**-2.0
            self._weighted += weight * math.log(box.width * contact / self._camera.focal_length)
            self._weight += weight
            self._nearest = min(self._nearest, contact)
        return distance, _EDGE * distance / box.width

    def _contact(self, box: RearBox) -> float | None:
        """Range by the row at which a vehicle stands [m]; None where its foot does not stand out."""
        below = box.foot - self._camera.horizon_row
        clear = box.evidence > math.log1p(STANDS_OUT**2) and below > 1.0
        return self._camera.row_distance / below if clear else None

    def _search(self, crop_at: Callable[[float], VehicleCrop]) -> RearBox:
        farthest = WIDTHS[1] * self._camera.focal_length / _LEAST_RANGED
        count = max(math.ceil(math.log(max(farthest, _NEAREST) / _NEAREST) / math.log(STEP)), 1)
        for tried in np.geomspace(_NEAREST, _NEAREST * STEP**count, count + 1):
            try:
                box = _localised(crop_at(float(tried)), float(tried))
            except CannotTellError:
                continue
            contact = None if box is None else self._contact(box)
            if box is None or contact is None or abs(math.log(contact / tried)) > _CONSISTENT:
                continue
            width = box.width * contact / self._camera.focal_length
            if abs(math.log(width / (self._known or _USUAL_WIDTH))) < _UNUSUAL:
                # Farther ones are parts of it: in the image they lie above its foot.
                self._first_width = width
                return box
        raise CannotTellError("no vehicle stands out ahead whose range the image shows")

    def _follow(self, crop_at: Callable[[float], VehicleCrop], distance: float) -> RearBox:
        box = _localised(crop_at(distance), distance)
        if box is None:
            raise CannotTellError("the vehicle ahead no longer stands out")
        return box


def _localised(crop: VehicleCrop, distance: float) -> RearBox | None:
    return localise_rear(crop.luminance, crop.origin, crop.camera, distance, crop.noise)
