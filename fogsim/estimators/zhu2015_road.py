"""What zhu2015 sees of the road in one frame: lane lines, horizon, region, and the fog in its rows."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera
from fogsim.values.observation import LeadMeasurement
from fogsim.vision.light.luminance import linear_pixels
from fogsim.vision.light.pixel_kernels import LinearPixels
from fogsim.vision.lines.edges import Edges, edge_map, smoothed
from fogsim.vision.lines.horizon import Horizon, calibrated_horizon, levelled
from fogsim.vision.lines.lane_lines import (
    CLEAR_OF_VANISHING_POINT,
    LaneLine,
    hough_lines,
    lane_vanishing_point,
    published_vanishing_point,
    refined_lines,
)
from fogsim.vision.lines.vanishing_point import VanishingPoint
from fogsim.vision.region.inflection import steepest_slope
from fogsim.vision.region.region_kernels import region_tops
from fogsim.vision.region.road_image import CannotTellError, RoadImage, road_image
from fogsim.vision.region.road_region import constant_limits, cumulative_limits, grow_region
from fogsim.vision.strips.joint_checks import CLEAR, LEAST_CONTRAST, MAX_MISFIT, no_road
from fogsim.vision.strips.joint_fit import MODEL_DEVIATION, JointFit, fit_agreeing
from fogsim.vision.strips.joint_kernels import JointPrior
from fogsim.vision.strips.joint_prior import SKY_DEVIATION
from fogsim.vision.strips.sky import UNKNOWN_VIGNETTING, Sky, sky_above
from fogsim.vision.strips.strip_curves import StripCurves, strip_curves, without_clipped
from fogsim.vision.strips.strip_geometry import StripGeometry, strip_geometry

LOWEST_ANGLE = math.radians(10.0)
"""Angle to the rows below which a line is no lane line (zhu2015 section 3.2) [rad]."""

SURE_LOWEST, SURE_STEEPEST = math.radians(25.0), math.radians(80.0)
"""The same for lines that are refined, and where poles and sides of vehicles begin [rad]: the edge of a line nearer to
the rows is many columns wide."""

LINES = 8
"""Lines of either half that are refined."""

SIMILARITY = 0.25
"""Steepest fog in contrasts of road to airlight a row; a silhouette takes at least 0.34 [-]."""

BENT_ROAD = 0.2
"""Deviation of the row where lane lines meet from the horizon, for roads bend and undulate [px]."""

HALF_VEHICLE, VEHICLE_MARGIN = 1.5, 2.0
"""What a tracked vehicle hides either side of the axis, and how much nearer than measured its foot may be [m]."""

COVERED = 0.6
"""Share of a bin that the region must hold for it to be road [-]."""

FIRST_BINS, FIRST_COVERED = 12, 0.5
"""Nearest bins of a strip, and the share of them that must be road: a region that gets beside the road farther away,
where the fog hides its edge, has found the verge [-]."""

CLIPPED_LEVEL, CLIPPED_DEVIATION = 1.03, 0.1
"""How much brighter than it looks a clipped sky is taken to be, and its deviation upward, relative to it [-]."""


@dataclass(frozen=True, slots=True)
class SeenRoad:
    """One frame's road.

    Attributes
    ----------
    image : RoadImage
        The pixels.
    horizon : Horizon
        From the lane lines where they meet, else from the calibration; in rows of the whole image.
    region : (rows, cols) uint8
        The grown region.
    vanishing_point : tuple of float or None
        Column and row [px].
    lines : tuple of LaneLine
        The lane lines that were looked at, in rows of `image`.
    pixels : LinearPixels
        The whole image, level.
    free : float
        Depth up to which the own lane is free of a tracked vehicle [m].
    """

    image: RoadImage
    horizon: Horizon
    region: NDArray[np.uint8]
    vanishing_point: tuple[float, float] | None
    lines: tuple[LaneLine, ...]
    pixels: LinearPixels
    free: float


def seen_road(
    image: NDArray[np.uint8] | NDArray[np.uint16],
    camera: Camera,
    pitch_deviation: float,
    growth: tuple[float, float] | None,
    lead: LeadMeasurement | None,
) -> SeenRoad:
    """Find lines, horizon and road in an image.

    Parameters
    ----------
    image : (rows, cols) or (rows, cols, 3) uint8 or uint16
        An image of the camera.
    camera : Camera
        The assumed calibration.
    pitch_deviation : float
        Standard deviation of the pitch [rad].
    growth : tuple of float or None
        G_max and ρ as published, or None for the corrected growth.
    lead : LeadMeasurement or None
        A tracked vehicle that hides part of the road.

    Raises
    ------
    CannotTellError
        If the image shows no road by day.
    """
    assumed, free = calibrated_horizon(camera, pitch_deviation), _free(lead)
    road = road_image(image, camera, assumed)
    blurred = smoothed(road.luminance)
    below = np.arange(blurred.shape[0], dtype=np.float64) + (road.first_row - assumed.row)
    slope = np.minimum(steepest_slope(below, road.airlight), SIMILARITY * road.contrast).astype(np.float32)
    edges = edge_map(blurred, slope if growth is None else np.zeros_like(slope))
    if edges.threshold > road.contrast:
        raise CannotTellError("noise or texture drowns the contrast of road and airlight")
    first = math.ceil(assumed.row - road.first_row) + 1
    if growth is not None:
        lines = hough_lines(edges.pixels, first, LOWEST_ANGLE)
        point = published_vanishing_point(lines)
        limits = constant_limits(blurred.shape[0], growth[0], growth[0] * growth[1], growth[0])
        region = grow_region(blurred, edges.pixels, limits)
    else:
        lines = _sure_lines(edges, blurred, road, camera, assumed)
        expected = (camera.principal_point[0], assumed.row - road.first_row)
        point = lane_vanishing_point(lines, expected, max(5.0 * assumed.standard_deviation, 2.0))
        steps = (slope + edges.threshold).astype(np.float32)
        limits = cumulative_limits(steps, SIMILARITY * road.contrast + edges.threshold)
        region = grow_region(blurred, edges.pixels, limits)
        _hide(region, road, camera, free)
    horizon = assumed if point is None else _combined(assumed, point, road.first_row, plain=growth is not None)
    where = None if point is None else (point.column, point.row + road.first_row)
    pixels = linear_pixels(levelled(image, camera), camera)
    return SeenRoad(road, horizon, region, where, tuple(lines), pixels, free)


def _sure_lines(
    edges: Edges, blurred: NDArray[np.float32], road: RoadImage, camera: Camera, assumed: Horizon
) -> list[LaneLine]:
    clear = min(CLEAR_OF_VANISHING_POINT, 0.08 * camera.height)
    first = math.ceil(assumed.row - road.first_row + clear)
    lines = hough_lines(edges.pixels, first, SURE_LOWEST, LINES, SURE_STEEPEST)
    return refined_lines(lines, edges.pixels, blurred, first)


def _combined(assumed: Horizon, point: VanishingPoint, first_row: int, *, plain: bool) -> Horizon:
    if plain:
        return Horizon(point.row + first_row, point.row_deviation)
    near = math.hypot(point.row_deviation, BENT_ROAD)
    share = assumed.standard_deviation**2 / (assumed.standard_deviation**2 + near**2)
    row = assumed.row + share * (point.row + first_row - assumed.row)
    return Horizon(row, math.sqrt(share) * near)


def _free(lead: LeadMeasurement | None) -> float:
    """Depth up to which the own lane is free of a tracked vehicle [m]."""
    if lead is None or not lead.distance > VEHICLE_MARGIN:
        return math.inf
    return max(lead.distance - VEHICLE_MARGIN, 1.0)


def _hide(region: NDArray[np.uint8], road: RoadImage, camera: Camera, free: float) -> None:
    """Take what a tracked vehicle may cover out of a region."""
    if math.isinf(free):
        return
    foot = math.ceil(camera.horizon_row + camera.row_distance / free) - road.first_row
    half = HALF_VEHICLE * camera.focal_length / free
    middle = camera.principal_point[0]
    left, right = max(math.ceil(middle - half), 0), max(math.floor(middle + half) + 1, 0)
    region[: max(foot, 0), left:right] = 0


def inflection_rows(road: SeenRoad) -> NDArray[np.float64]:
    """Rows at which the columns of the region end, below the horizon [px]: the published inflection.

    Parameters
    ----------
    road : SeenRoad
        The road.

    Raises
    ------
    CannotTellError
        If there is no region.
    """
    tops = region_tops(road.region)
    if tops.size == 0:
        raise CannotTellError("no region grows from the bottom row")
    return np.asarray(tops + (road.image.first_row - road.horizon.row), np.float64)


def fitted_fog(road: SeenRoad, camera: Camera) -> tuple[float, float]:
    """Extinction and its standard deviation by a fit over the region's strips and the sky [1/m].

    Parameters
    ----------
    road : SeenRoad
        The road.
    camera : Camera
        The assumed calibration.

    Raises
    ------
    CannotTellError
        If the road is hidden, too bright, or follows no Koschmieder's law, or the fog does not show.
    """
    horizon = road.horizon
    tilt = math.atan((camera.principal_point[1] - horizon.row) / camera.focal_length)
    level = replace(camera, pitch=tilt, roll=0.0)
    sky = sky_above(road.pixels, level, 3.0 * horizon.standard_deviation + 2.0)
    if sky is None:
        raise CannotTellError("no sky is seen above the horizon")
    geometry = strip_geometry(level, max(1.0, horizon.standard_deviation))
    curves = strip_curves(road.pixels, geometry, sky.noise, level, road.free)
    curves = without_clipped(curves) if sky.is_clipped else curves
    curves = _on_road(curves, geometry, road.region, road.image.first_row)
    fit = fit_agreeing(curves, geometry, _prior(sky, horizon))
    if fit is None:
        raise CannotTellError("no road is seen")
    _check(fit, sky)
    if why := no_road(fit, curves, geometry, level):
        raise CannotTellError(why)
    return max(fit.extinction, 0.0), math.hypot(fit.extinction_deviation, MODEL_DEVIATION * fit.extinction)


def _on_road(curves: StripCurves, geometry: StripGeometry, region: NDArray[np.uint8], first_row: int) -> StripCurves:
    """Leave out bins that are not on the region, and strips that begin beside it."""
    rows = (geometry.first + geometry.last) // 2 - first_row
    inside = np.cumsum(np.pad(region[rows] != 0, ((0, 0), (1, 0))), axis=1, dtype=np.int32)
    cols = region.shape[1]
    left = np.clip(np.ceil(geometry.left).astype(np.int64), 0, cols)
    right = np.clip(np.floor(geometry.right).astype(np.int64) + 1, left, cols)
    at = np.arange(rows.size)
    share = (inside[at, right] - inside[at, left]) / np.maximum(right - left, 1)
    road = (share >= COVERED) & (curves.variance > 0)
    for strip in range(1, len(road)):
        nearest = np.flatnonzero(curves.variance[strip] > 0)[:FIRST_BINS]
        if nearest.size == 0 or road[strip, nearest].mean() < FIRST_COVERED:
            road[strip] = False
    return replace(curves, variance=np.where(road, curves.variance, 0.0))


def _prior(sky: Sky, horizon: Horizon) -> JointPrior:
    airlight = sky.luminance
    below, above = (math.hypot(SKY_DEVIATION * airlight, apart) for apart in (sky.deviation, sky.upward))
    if sky.is_clipped:
        airlight *= CLIPPED_LEVEL
        below, above = below + airlight - sky.luminance, CLIPPED_DEVIATION * airlight
    return JointPrior(airlight, below, above, 0.0, horizon.standard_deviation, 0.0, UNKNOWN_VIGNETTING)


def _check(fit: JointFit, sky: Sky) -> None:
    if fit.road >= (1.0 - LEAST_CONTRAST) * fit.airlight or fit.road >= 0.98 * sky.luminance:
        raise CannotTellError("the road is nearly as bright as the airlight, or brighter")
    if fit.misfit > MAX_MISFIT:
        raise CannotTellError("the road fades into the airlight, but not as Koschmieder's law has it")
    deviation = fit.extinction_deviation
    if fit.extinction < 2.0 * deviation and fit.extinction + 2.0 * deviation > CLEAR:
        raise CannotTellError("the extinction is not observable: too little road is seen")
