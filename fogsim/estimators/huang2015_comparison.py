"""Pictures of the vehicle ahead as huang2015 compares them: their place, their detail and their light."""

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import matrix_product
from fogsim.estimators.huang2015_ratios import RANGE_DEVIATION
from fogsim.values.camera import Camera
from fogsim.vision.light.daylight import TOO_DARK, CannotTellError
from fogsim.vision.light.luminance import clipping, darker_by, linear_luminance
from fogsim.vision.light.pixel_kernels import Pixels
from fogsim.vision.lines.horizon import PITCH_DEVIATION, levelled
from fogsim.vision.region.road_image import MIN_AIRLIGHT
from fogsim.vision.vehicle.airlight import Rows, hidden_at_side, neighbouring_airlight
from fogsim.vision.vehicle.contrast_ratio import LOST, TOP, MeanLuminances, mean_luminances
from fogsim.vision.vehicle.patch import Patch, Placement, pixel_shares, rescale_position, shrink
from fogsim.vision.vehicle.rear_localisation import WIDTHS, RearBox
from fogsim.vision.vehicle.registration import PlacementPrior, Regression, register
from fogsim.vision.vehicle.vehicle_crop import MOST_NOISE, SkyReading, VehicleCrop, vehicle_crop

_HALF_WIDTH, _MIDDLE, _HALF_HEIGHT = 0.42, 0.42, 0.32
"""The part of a rear that is compared, in widths of the vehicle: half its width, its middle above the foot, and half
its height [-]. It ends below the roof of the flattest car and above the shadow under it."""

BODY_HALF_WIDTH, BODY_HEIGHTS = 0.34, (0.15, 0.7)
"""The part whose variance is taken, in widths of the vehicle [-]. It lies on the body of every vehicle: next to a
narrow roof there is sky, and under the bumper road, whose share of a larger window would change with its place."""

_MARGIN, _MARGIN_PIXELS = 0.12, 8
"""What a stored picture holds around that part: widths of the vehicle [-] and pixels."""

FULL = 254.7
"""Mean luminance of a sky that is saturated; a little less, and its noise still shows where it is [linear levels]."""

_LEAST_WIDTH = 8.0
"""Narrowest vehicle whose picture is compared [px]."""

_STEERING = 0.1
"""Change of the lateral offset between frames in widths of the vehicle [-]."""

_SMALL = 0.6
"""Relative standard deviation of a contrast by how little a small picture shows [px]: over the vehicle's width."""

BROADEST = 64.0
"""Width of a vehicle beyond which its picture is shrink before it is compared [px]: it shows no more."""

_OUTLINE = 1.28
"""Size of the region that places a vehicle, over the compared region [-]: an outline is more precise than a rear."""


_AGREES, _CONTRADICTED = 0.1, 0.1
"""Relative difference of the fading of detail and of mean contrast that says nothing, and the share of the rest of it
that the mean may err by [-]."""

_MISPLACED = 3.0
"""Standard deviation of the fading of detail that is faster than the light's, over their difference [-]."""

_BUMPER = 0.15
"""Height of the lowest part of a rear without information on light, in widths of the vehicle [-]: black plinths and
shadows end at heights that no distant image resolves."""


@dataclass(frozen=True, slots=True)
class RearPatch:
    """One picture of the vehicle ahead."""

    number: int  # Number of the measured range
    distance: float  # From the camera to its rear [m]
    patch: Patch  # The picture, about the middle of its body
    variance: float  # Of the body's pixels, before the picture was shrunk [linear grey levels²]
    sky: SkyReading  # The airlight [linear grey levels]
    noise: float  # Deviation of single pixels of the vehicle [linear grey levels]
    width: float  # Of the vehicle [px]
    pitch_deviation: float  # Rows by which pitch moves the picture between frames [px]
    metre: float  # Pixels in a metre at the vehicle [px/m]
    scale: float = 1.0  # Size over that in the frame [-]


@dataclass(frozen=True, slots=True)
class Comparison:
    """A picture compared with the reference."""

    picture: RearPatch  # The picture
    distance: float  # From the camera to the vehicle's rear [m]
    # contrast, deviation: detail over that of the reference, changes of exposure taken out, and its standard deviation
    # [-]
    contrast: float
    deviation: float
    # mean, near_mean: mean luminance of the picture and of the same pixels of the reference, either over its sky's [-]
    mean: float
    near_mean: float
    # Standard deviation of the mean; ``inf`` if it is not known, as where the sky is saturated [-]
    mean_deviation: float
    regression: Regression  # Of the picture on the reference

    @property
    def number(self) -> int:
        """Number of the measured range."""
        return self.picture.number

    @property
    def variance(self) -> float:
        """Of the picture's body [linear grey levels²]."""
        return self.picture.variance

    @property
    def fallen(self) -> tuple[float, float]:
        """Contrast to the sky over that of the reference, and its deviation; that of the detail if it is not known."""
        if not self.shows_light:
            return self.contrast, self.deviation
        return (1.0 - self.mean) / (1.0 - self.near_mean), self.mean_deviation / (1.0 - self.near_mean)

    @property
    def shows_light(self) -> bool:
        """Whether the reference differs from the sky by more than its mean may err."""
        return 1.0 - self.near_mean > 3.0 * self.mean_deviation


def crop_vehicle(image: Pixels, camera: Camera, distance: float) -> VehicleCrop:
    """Cut out of a frame where a vehicle can be, before the sky in a band above the horizon.

    Takes `image` (rows, cols), `distance` [m].
    """
    if not 0.5 < distance < math.inf:
        raise CannotTellError(f"a range of {distance:.1f} m is none of a vehicle ahead")
    if WIDTHS[1] * camera.focal_length / distance < _LEAST_WIDTH:
        raise CannotTellError("the vehicle ahead is too small in the image")
    level = levelled(image, camera)

    def luminance_of(rows: Rows, cols: slice) -> NDArray[np.float32]:
        return linear_luminance(level[rows, cols], camera.response, camera.bits, camera.black_level)

    return vehicle_crop(camera, distance, luminance_of, partial(_sky_above, level, camera, distance))


def _sky_above(image: Pixels, camera: Camera, distance: float) -> SkyReading:
    """The sky in a band above the horizon."""
    bottom = min(math.floor(camera.horizon_row - 3), camera.height)
    if bottom < 2:
        raise CannotTellError("no sky is in the image")
    top, side = max(bottom - max(camera.height // 16, 4), 0), camera.width // 6
    pixels = image[top:bottom, side : camera.width - side]
    luminance = linear_luminance(pixels, camera.response, camera.bits, camera.black_level)
    bright = float(np.percentile(luminance, 80, method="lower"))
    if bright < MIN_AIRLIGHT:
        raise CannotTellError(TOO_DARK)
    even = np.abs(luminance - bright) <= max(0.03 * bright, 4.0)
    across = np.abs(np.diff(luminance, axis=1))
    # Half of the neighbours are of one surface even where trees stand before the sky.
    noise = 1.4826 * float(np.median(across)) / math.sqrt(2.0)
    if noise > MOST_NOISE * bright:
        raise CannotTellError("what is above the horizon is no sky")
    hidden = hidden_at_side(camera.focal_length, distance)
    mean = neighbouring_airlight(luminance, bright, noise, camera.principal_point[0] - side, hidden)
    lost = clipping(pixels[even], camera)
    known = lost if lost.noise > 0.0 or mean < FULL else None
    return SkyReading(mean + lost.loss, max(noise, lost.noise), known, known is None)


def cut_patch(crop: VehicleCrop, window: RearBox, number: int, blur: float) -> RearPatch:
    """Cut the picture of a vehicle out, with room about it for what is not known of its place.

    Takes `window` [px], `blur` [px].
    """
    if window.width < _LEAST_WIDTH:
        raise CannotTellError("the vehicle ahead is too small in the image")
    row, col = window.foot - _MIDDLE * window.width - crop.origin[1], window.column - crop.origin[0]
    half_width, half_height = _HALF_WIDTH * window.width, _HALF_HEIGHT * window.width
    margin = _MARGIN * window.width + _MARGIN_PIXELS
    above = max(half_height, TOP * crop.scale - _MIDDLE * window.width)
    rows = max(math.floor(row - above - margin), 0), math.ceil(row + half_height + margin) + 1
    cols = max(math.floor(col - half_width - margin), 0), math.ceil(col + half_width + margin) + 1
    pixels = crop.luminance[rows[0] : max(rows[1], 0), cols[0] : max(cols[1], 0)].astype(np.float64)
    patch = Patch(pixels, col - cols[0], row - rows[0], half_width, half_height, blur)
    inside = 0 <= patch.column < pixels.shape[1] and 0 <= patch.row < pixels.shape[0]
    if not inside or min(pixels.shape) < _LEAST_WIDTH / 2:
        raise CannotTellError("the vehicle ahead is outside the image")
    return RearPatch(
        number=number,
        distance=crop.depth,
        patch=patch,
        variance=_window_variance(patch),
        sky=crop.sky,
        noise=max(crop.noise, 0.1),
        width=window.width,
        pitch_deviation=1.5 * PITCH_DEVIATION * crop.camera.focal_length,
        metre=crop.scale,
    )


def shrink_broad(picture: RearPatch) -> RearPatch:
    """The same picture no broader than `BROADEST`."""
    scale = min(BROADEST / picture.width, 1.0)
    return replace(
        picture, patch=shrink(picture.patch, scale), width=picture.width * scale, noise=picture.noise * scale,
        pitch_deviation=picture.pitch_deviation * scale, metre=picture.metre * scale, scale=scale,
    )  # fmt: skip


def placed_at(picture: RearPatch, full: RearPatch, at: Placement) -> RearPatch:
    """Picture of a vehicle that has been found at a place."""
    small = replace(picture.patch, column=at.column, row=at.row)
    sizes = zip(small.luminance.shape, full.patch.luminance.shape, strict=True)
    places = zip((at.row, at.column), sizes, strict=True)
    row, column = (rescale_position(place, 1.0 / picture.scale, *size) for place, size in places)
    return replace(picture, patch=small, variance=_window_variance(replace(full.patch, column=column, row=row)))


def lower(picture: RearPatch, widths: float) -> RearPatch:
    """The same picture of a vehicle that turned out to stand lower in it."""
    patch = replace(picture.patch, row=picture.patch.row + widths * picture.width)
    # Of a picture that was shrunk the frame's own pixels are gone, and with them its exact variance.
    variance = _window_variance(patch) if picture.scale == 1.0 else picture.variance
    return replace(picture, patch=patch, variance=variance)


def _window_variance(patch: Patch) -> float:
    """Variance over the body (eq. 4.12 with the square that it lacks), pixels at its edges by their share of it."""
    width = patch.half_width / _HALF_WIDTH
    low, high = ((_MIDDLE - height) * width + patch.row for height in BODY_HEIGHTS[::-1])
    sizes = patch.luminance.shape
    rows = pixel_shares(sizes[0], np.array([0.5 * (low + high)]), 0.5 * (high - low))
    cols = pixel_shares(sizes[1], np.array([patch.column]), BODY_HALF_WIDTH * width)
    inside = float(rows.sum() * cols.sum())
    if inside <= 0.0:
        return 0.0
    mean, square = (
        float(matrix_product(matrix_product(rows, power), cols.T)[0, 0]) / inside
        for power in (patch.luminance, patch.luminance**2)
    )
    return max(square - mean**2, 0.0)


def expected_placement(
    reference: RearPatch, picture: RearPatch, range_deviation: float = RANGE_DEVIATION
) -> PlacementPrior:
    """Where the reference is expected in the next frame: as before, but for pitch, steering and noise of the range [m].

    Takes `range_deviation` [m].
    """
    nearness = 1.0 / picture.distance + 1.0 / reference.distance
    placement = Placement(picture.patch.column, picture.patch.row, picture.width / reference.width)
    return PlacementPrior(
        placement, 1.0 + _STEERING * picture.width, 0.5 + picture.pitch_deviation, range_deviation * nearness
    )


def known_placement(reference: RearPatch, picture: RearPatch) -> PlacementPrior:
    """Where the reference is expected in a picture that has been registered before."""
    return replace(expected_placement(reference, picture), column_deviation=0.5, row_deviation=0.5)


def compare(near: RearPatch, far: RearPatch, prior: PlacementPrior, most: float = math.inf) -> Comparison | None:
    """Compare a picture with the reference.

    Returns None if too few pixels can be compared.
    """
    # A saturated sky does not tell the exposure.
    seen = near.sky.clipping is not None and far.sky.clipping is not None
    gain = far.sky.luminance / near.sky.luminance if seen else 1.0
    found = register(near.patch, far.patch, prior, far.noise, most * gain, _OUTLINE)
    if found is None:
        # Too many pixels are near saturation, or none differ: only its light may say something.
        found = _unplaced(prior.placement) if seen else None
    if found is None:
        return None
    skies = near.sky.luminance, far.sky.luminance
    body, at = _above_bumper(near, found.placement)
    light = mean_luminances(body, far.patch, at, skies, far.noise) if seen else None
    light = None if light is None else _unclipped(light, far.sky)
    if light is None and found.pixels == 0:
        return None
    # What a small picture does not resolve alike: its detail and its place.
    by_size = _SMALL / far.width * abs(found.slope)
    # Detail that has faded otherwise than the light was not found where it is, or it is drawn or lit otherwise.
    apart = _apart(found, gain, light)
    contradicted = 0.0 if light is None else _CONTRADICTED * max(apart, 0.0) * (1.0 - light.near)
    return Comparison(
        picture=far,
        distance=far.distance,
        contrast=found.slope / gain,
        deviation=math.hypot(found.slope_deviation / gain, by_size / gain, _MISPLACED * abs(apart)),
        mean=found.mean / skies[1] if light is None else light.far,
        near_mean=found.near_mean / skies[0] if light is None else light.near,
        mean_deviation=math.inf if light is None else math.hypot(light.deviation, contradicted),
        regression=found,
    )


def _apart(found: Regression, gain: float, light: MeanLuminances | None) -> float:
    """By how much detail that is clearly seen has faded less than the mean contrast, beyond what says nothing [-]."""
    if light is None or light.near >= 1.0 or not math.isfinite(found.noise_deviation):
        return 0.0
    fallen = (1.0 - light.far) / (1.0 - light.near)
    apart = found.slope / gain - fallen
    return math.copysign(max(abs(apart) - _AGREES * abs(fallen) - 2.0 * found.noise_deviation / gain, 0.0), apart)


def _unplaced(at: Placement) -> Regression:
    """Regression of no pixels, where the vehicle is expected."""
    return Regression(
        placement=at,
        slope=0.0,
        slope_deviation=math.inf,
        noise_deviation=math.inf,
        mean=0.0,
        near_mean=0.0,
        residual=0.0,
        variance=0.0,
        pixels=0,
    )


def _unclipped(light: MeanLuminances, sky: SkyReading) -> MeanLuminances:
    """The same light with what clipping takes of pixels that are hardly darker than the sky."""
    if sky.clipping is None or sky.clipping.noise <= 0.0:
        return light
    fall, lost = darker_by(1.0 - light.far, 255.0 / sky.luminance - 1.0, sky.clipping.spread / sky.luminance)
    return replace(light, far=1.0 - fall, deviation=math.hypot(light.deviation, LOST * lost))


def _above_bumper(near: RearPatch, at: Placement) -> tuple[Patch, Placement]:
    """The rear from above its lowest part up to where roofs of all vehicles may be, and where that is."""
    bottom = near.patch.row + near.patch.half_height - _BUMPER * near.width
    top = max(
        min(near.patch.row - near.patch.half_height, near.patch.row + _MIDDLE * near.width - TOP * near.metre), 0.5
    )
    middle = 0.5 * (bottom + top)
    body = replace(near.patch, row=middle, half_height=bottom - middle)
    return body, replace(at, row=at.row + (middle - near.patch.row) * at.scale)


def compare_with_itself(reference: RearPatch) -> Comparison:
    """The reference as the first of its comparisons.

    Its contrast is 1 by definition, which says nothing of how much of its detail others show; its light does count.
    """
    own = compare(reference, reference, known_placement(reference, reference))
    if own is None or not (math.isfinite(own.regression.noise_deviation) or own.shows_light):
        raise CannotTellError("the vehicle ahead shows nothing that could be followed")
    exact = 0.0 if math.isfinite(own.mean_deviation) else math.inf
    return replace(own, contrast=1.0, deviation=math.inf, mean=own.near_mean, mean_deviation=exact)
