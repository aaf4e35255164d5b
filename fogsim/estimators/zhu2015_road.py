"""What zhu2015 sees of the road in one frame: lane lines, horizon, region, and the fog in its rows."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.estimators.zhu2015_fit import fitted_strips
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
"""What a tracked vehicle hides either side of the axis, and how much nearer than told its foot may be [m]."""


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
        The told calibration.
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
    told, free = calibrated_horizon(camera, pitch_deviation), _free(lead)
    road = road_image(image, camera, told)
    blurred = smoothed(road.luminance)
    below = np.arange(blurred.shape[0], dtype=np.float64) + (road.first_row - told.row)
    slope = np.minimum(steepest_slope(below, road.airlight), SIMILARITY * road.contrast).astype(np.float32)
    edges = edge_map(blurred, slope if growth is None else np.zeros_like(slope))
    if edges.threshold > road.contrast:
        raise CannotTellError("noise or texture drowns the contrast of road and airlight")
    first = math.ceil(told.row - road.first_row) + 1
    if growth is not None:
        lines = hough_lines(edges.pixels, first, LOWEST_ANGLE)
        point = published_vanishing_point(lines)
        limits = constant_limits(blurred.shape[0], growth[0], growth[0] * growth[1], growth[0])
        region = grow_region(blurred, edges.pixels, limits)
    else:
        lines = _sure_lines(edges, blurred, road, camera, told)
        expected = (camera.principal_point[0], told.row - road.first_row)
        point = lane_vanishing_point(lines, expected, max(5.0 * told.standard_deviation, 2.0))
        steps = (slope + edges.threshold).astype(np.float32)
        limits = cumulative_limits(steps, SIMILARITY * road.contrast + edges.threshold)
        region = grow_region(blurred, edges.pixels, limits)
        _hide(region, road, camera, free)
    horizon = told if point is None else _combined(told, point, road.first_row, plain=growth is not None)
    where = None if point is None else (point.column, point.row + road.first_row)
    pixels = linear_pixels(levelled(image, camera), camera)
    return SeenRoad(road, horizon, region, where, tuple(lines), pixels, free)


def _sure_lines(
    edges: Edges, blurred: NDArray[np.float32], road: RoadImage, camera: Camera, told: Horizon
) -> list[LaneLine]:
    clear = min(CLEAR_OF_VANISHING_POINT, 0.08 * camera.height)
    first = math.ceil(told.row - road.first_row + clear)
    lines = hough_lines(edges.pixels, first, SURE_LOWEST, LINES, SURE_STEEPEST)
    return refined_lines(lines, edges.pixels, blurred, first)


def _combined(told: Horizon, point: VanishingPoint, first_row: int, *, plain: bool) -> Horizon:
    if plain:
        return Horizon(point.row + first_row, point.row_deviation)
    near = math.hypot(point.row_deviation, BENT_ROAD)
    share = told.standard_deviation**2 / (told.standard_deviation**2 + near**2)
    row = told.row + share * (point.row + first_row - told.row)
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

    Raises
    ------
    CannotTellError
        If the road is hidden or follows no Koschmieder's law.
    """
    fit, deviation = fitted_strips(road.pixels, road.region, road.image.first_row, camera, road.horizon, road.free)
    return max(fit.extinction, 0.0), deviation
