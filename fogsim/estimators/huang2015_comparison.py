"""Two pictures of the vehicle ahead compared: its place, its detail and its light."""

import math
from dataclasses import dataclass, replace

from fogsim.estimators.huang2015_sighting import MIDDLE, TOP, Sighting
from fogsim.vision.light.clipped_sky import darker_by
from fogsim.vision.region.road_image import CannotTellError
from fogsim.vision.vehicle.contrast_ratio import MeanLuminances, mean_luminances
from fogsim.vision.vehicle.patch import Patch, Placement, rescale_position, shrink
from fogsim.vision.vehicle.registration import PlacementPrior, Regression, register

RANGE_DEVIATION = 0.3
"""Standard deviation of the told range [m]."""

STEERING = 0.1
"""Change of the lateral offset between frames in widths of the vehicle [-]."""

SMALL = 0.6
"""Relative standard deviation of a contrast by how little a small picture shows [px]: over the vehicle's width."""

BROADEST = 64.0
"""Width of a vehicle beyond which its picture is shrink before it is compared [px]: it shows no more."""

OUTLINE = 1.28
"""Size of what a vehicle is placed by, over that of what is compared [-]: its outline tells more than its rear."""


AGREES, CONTRADICTED = 0.1, 0.1
"""Relative difference of the fading of detail and of mean contrast that says nothing, and the share of the rest of it
that the mean may err by [-]."""

MISPLACED = 3.0
"""Standard deviation of the fading of detail that is faster than the light's, over their difference [-]."""

LOST = 0.25
"""Deviation of what clipping takes from a vehicle, relative to it [-]."""

BUMPER = 0.15
"""Height of the lowest part of a rear that tells no light, in widths of the vehicle [-]: black plinths and shadows end
there at heights that no far picture resolves."""


@dataclass(frozen=True, slots=True)
class Picture:
    """A sighting, and its window's variance before it was shrink.

    Attributes
    ----------
    sighting : Sighting
        The vehicle, no broader than `BROADEST`.
    variance : float
        Of the window's pixels [linear grey levels²].
    scale : float
        Size over that in the frame [-].
    """

    sighting: Sighting
    variance: float
    scale: float


@dataclass(frozen=True, slots=True)
class Comparison:
    """A picture compared with the reference.

    Attributes
    ----------
    distance : float
        From the camera to the vehicle's rear [m].
    variance : float
        Of the picture's window [linear grey levels²].
    contrast, deviation : float
        Detail over that of the reference, changes of exposure taken out, and its standard deviation [-].
    mean, near_mean : float
        Mean luminance of the picture and of the same pixels of the reference, either over its sky's [-].
    mean_deviation : float
        Standard deviation of the mean; ``inf`` if it is not known, as where the sky is saturated [-].
    regression : Regression
        Of the picture on the reference.
    number : int
        Number of the measured range.
    """

    distance: float
    variance: float
    contrast: float
    deviation: float
    mean: float
    near_mean: float
    mean_deviation: float
    regression: Regression
    number: int = 0

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


def picture_of(sighting: Sighting) -> Picture:
    """Shrink a broad sighting; its variance is measured before."""
    scale = min(BROADEST / sighting.width, 1.0)
    small = replace(
        sighting, patch=shrink(sighting.patch, scale), width=sighting.width * scale, noise=sighting.noise * scale,
        pitch_deviation=sighting.pitch_deviation * scale, metre=sighting.metre * scale,
    )  # fmt: skip
    return Picture(small, window_variance(sighting.patch), scale)


def placed(picture: Picture, sighting: Sighting, at: Placement) -> Picture:
    """Picture of a sighting whose vehicle has been found at a place.

    Parameters
    ----------
    picture : Picture
        The sighting's.
    sighting : Sighting
        As it was cut from the frame.
    at : Placement
        Where the vehicle is in the picture.
    """
    small = replace(picture.sighting.patch, column=at.column, row=at.row)
    sizes = zip(small.luminance.shape, sighting.patch.luminance.shape, strict=True)
    places = zip((at.row, at.column), sizes, strict=True)
    row, column = (rescale_position(place, 1.0 / picture.scale, *size) for place, size in places)
    variance = window_variance(replace(sighting.patch, column=column, row=row))
    return replace(picture, sighting=replace(picture.sighting, patch=small), variance=variance)


def lowered(picture: Picture, widths: float) -> Picture:
    """The same picture of a vehicle that turned out to stand lower in it, by so many of its widths [-]."""
    sighting = picture.sighting
    patch = replace(sighting.patch, row=sighting.patch.row + widths * sighting.width)
    # Of a picture that was shrink the frame's own pixels are gone, and with them its exact variance.
    variance = window_variance(patch) if picture.scale == 1.0 else picture.variance
    return replace(picture, sighting=replace(sighting, patch=patch), variance=variance)


def window_variance(patch: Patch) -> float:
    """Variance of the pixels of the followed thing (eq. 4.12 with the square that it lacks); 0 if none are there."""
    spans = (
        slice(max(round(middle - half), 0), max(round(middle + half) + 1, 0))
        for middle, half in ((patch.row, patch.half_height), (patch.column, patch.half_width))
    )
    pixels = patch.luminance[tuple(spans)]
    return float(pixels.var()) if pixels.size else 0.0


def expected_placement(reference: Sighting, sighting: Sighting) -> PlacementPrior:
    """Where the reference is expected in the next frame: as before, but for pitch, steering and the range's noise."""
    nearness = 1.0 / sighting.distance + 1.0 / reference.distance
    placement = Placement(sighting.patch.column, sighting.patch.row, sighting.width / reference.width)
    return PlacementPrior(
        placement, 1.0 + STEERING * sighting.width, 0.5 + sighting.pitch_deviation, RANGE_DEVIATION * nearness
    )


def known_placement(reference: Sighting, sighting: Sighting) -> PlacementPrior:
    """Where the reference is expected in a picture that has been registered before."""
    return replace(expected_placement(reference, sighting), column_deviation=0.5, row_deviation=0.5)


def compared(reference: Picture, picture: Picture, prior: PlacementPrior, most: float = math.inf) -> Comparison | None:
    """Compare a picture with the reference.

    Parameters
    ----------
    reference, picture : Picture
        The two; the reference shows more.
    prior : PlacementPrior
        Where the reference is expected in the picture.
    most : float
        Largest contrast over the reference's that can be true [-].

    Returns
    -------
    Comparison or None
        None if too few pixels can be compared.
    """
    near, far = reference.sighting, picture.sighting
    # A saturated sky does not tell the exposure.
    seen = near.lost is not None and far.lost is not None
    gain = far.sky / near.sky if seen else 1.0
    found = register(near.patch, far.patch, prior, far.noise, most * gain, OUTLINE)
    if found is None:
        # Too many pixels are near saturation, or none differ: only its light may say something.
        found = _unplaced(prior.placement) if seen else None
    if found is None:
        return None
    body, at = _above_bumper(near, found.placement)
    light = mean_luminances(body, far.patch, at, (near.sky, far.sky), far.noise) if seen else None
    light = None if light is None else _unclipped(light, far)
    if light is None and found.pixels == 0:
        return None
    # What a small picture does not resolve alike: its detail and its place.
    by_size = SMALL / far.width * abs(found.slope)
    # Detail that has faded otherwise than the light was not found where it is, or it is drawn or lit otherwise.
    apart = _apart(found, gain, light)
    contradicted = 0.0 if light is None else CONTRADICTED * max(apart, 0.0) * (1.0 - light.near)
    return Comparison(
        distance=far.distance,
        variance=picture.variance,
        contrast=found.slope / gain,
        deviation=math.hypot(found.slope_deviation / gain, by_size / gain, MISPLACED * abs(apart)),
        mean=found.mean / far.sky if light is None else light.far,
        near_mean=found.near_mean / near.sky if light is None else light.near,
        mean_deviation=math.inf if light is None else math.hypot(light.deviation, contradicted),
        regression=found,
        number=far.number,
    )


def _apart(found: Regression, gain: float, light: MeanLuminances | None) -> float:
    """By how much detail that is clearly seen has faded less than the mean contrast, beyond what says nothing [-]."""
    if light is None or light.near >= 1.0 or not math.isfinite(found.noise_deviation):
        return 0.0
    fallen = (1.0 - light.far) / (1.0 - light.near)
    apart = found.slope / gain - fallen
    return math.copysign(max(abs(apart) - AGREES * abs(fallen) - 2.0 * found.noise_deviation / gain, 0.0), apart)


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


def _unclipped(light: MeanLuminances, far: Sighting) -> MeanLuminances:
    """The same light with what clipping takes of pixels that are hardly darker than the sky."""
    if far.lost is None or far.lost.noise <= 0.0:
        return light
    fall, lost = darker_by(1.0 - light.far, 255.0 / far.sky - 1.0, far.lost.spread / far.sky)
    return replace(light, far=1.0 - fall, deviation=math.hypot(light.deviation, LOST * lost))


def _above_bumper(near: Sighting, at: Placement) -> tuple[Patch, Placement]:
    """The rear from above its lowest part up to where roofs of all vehicles may be, and where that is."""
    bottom = near.patch.row + near.patch.half_height - BUMPER * near.width
    top = max(
        min(near.patch.row - near.patch.half_height, near.patch.row + MIDDLE * near.width - TOP * near.metre), 0.5
    )
    middle = 0.5 * (bottom + top)
    body = replace(near.patch, row=middle, half_height=bottom - middle)
    return body, replace(at, row=at.row + (middle - near.patch.row) * at.scale)


def compared_with_itself(reference: Picture) -> Comparison:
    """The reference as the first of its comparisons.

    Its contrast is 1 by definition, which says nothing of how much of its detail others show; its light does count.

    Raises
    ------
    CannotTellError
        If it shows nothing that could be followed.
    """
    own = compared(reference, reference, known_placement(reference.sighting, reference.sighting))
    if own is None or not (math.isfinite(own.regression.noise_deviation) or own.shows_light):
        raise CannotTellError("the vehicle ahead shows nothing that could be followed")
    exact = 0.0 if math.isfinite(own.mean_deviation) else math.inf
    return replace(own, contrast=1.0, deviation=math.inf, mean=own.near_mean, mean_deviation=exact)
