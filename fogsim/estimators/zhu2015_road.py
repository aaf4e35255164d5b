"""What zhu2015 sees of the road in one frame: lane lines, horizon, region, and the fog in its rows."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera
from fogsim.values.observation import LeadMeasurement
from fogsim.vision.curve_fit import fit_curve
from fogsim.vision.edges import Edges, edge_map, smoothed
from fogsim.vision.horizon import Horizon, calibrated_horizon
from fogsim.vision.inflection import FogModel, steepest_slope
from fogsim.vision.lane_lines import (
    CLEAR_OF_VANISHING_POINT,
    VanishingPoint,
    hough_lines,
    plain_vanishing_point,
    refined_lines,
    vanishing_point,
)
from fogsim.vision.profile import RoadCurve, path_lengths
from fogsim.vision.region import grow_region
from fogsim.vision.road_growth import GrowthLimits, grown_road, region_tops, row_medians
from fogsim.vision.road_image import (
    MIN_CONTRAST,
    MIN_ROWS,
    SATURATED,
    CannotTellError,
    RoadImage,
    road_image,
    sky_profile,
)

LOWEST_ANGLE = math.radians(10.0)
"""Angle to the rows below which a line is no lane line (zhu2015 section 3.2) [rad]."""

SURE_LOWEST, SURE_STEEPEST = math.radians(25.0), math.radians(80.0)
"""The same for lines that are refined, and where poles and sides of vehicles begin [rad]: the edge of a line nearer to
the rows is many columns wide."""

LINES = 8
"""Lines of either half that are refined."""

SIMILARITY = 0.25
"""Steepest fog in contrasts of road to airlight a row; a silhouette takes at least 0.34 [-]."""

HALF_ROAD = 5.0
"""Half the width of road whose rows are looked at [m]: own lane and its neighbours."""

HALF_VEHICLE, VEHICLE_MARGIN = 1.5, 2.0
"""What a tracked vehicle hides either side of the axis, and how much nearer than told its foot may be [m]."""

NEAR_HORIZON, FAR_ENOUGH = 4.0, 100.0
"""A region that ends this close below the horizon [px], or reaches this far [m], would have seen fog: at 100 m that of
1000 m visibility takes a quarter of the road's contrast."""

ALBEDO_SHARE = 0.03
"""Relative standard deviation of k that 3 % of patchy albedo make, which the residuals of one frame do not show [-]."""

MAX_RESIDUAL = 0.12
"""Largest residual relative to the fitted contrast: more is no curve of Koschmieder's [-]."""


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
    """

    image: RoadImage
    horizon: Horizon
    region: NDArray[np.uint8]
    vanishing_point: tuple[float, float] | None


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
    told = calibrated_horizon(camera, pitch_deviation)
    road = road_image(image, camera, told)
    blurred = smoothed(road.luminance)
    below = np.arange(blurred.shape[0], dtype=np.float64) + (road.first_row - told.row)
    slope = np.minimum(steepest_slope(below, road.airlight), SIMILARITY * road.contrast).astype(np.float32)
    edges = edge_map(blurred, slope if growth is None else np.zeros_like(slope))
    if edges.threshold > road.contrast:
        raise CannotTellError("noise or texture drowns the contrast of road and airlight")
    first = math.ceil(told.row - road.first_row) + 1
    if growth is not None:
        point = plain_vanishing_point(hough_lines(edges.pixels, first, LOWEST_ANGLE))
        region = grown_road(blurred, edges.pixels, GrowthLimits(growth[0], growth[0] * growth[1], growth[0]))
    else:
        point = _sure_point(edges, blurred, road, camera, told)
        steps = (slope + edges.threshold).astype(np.float32)
        region = grow_region(blurred, edges.pixels, steps, SIMILARITY * road.contrast + edges.threshold)
        _hide(region, road, camera, lead)
    horizon = told if point is None else _combined(told, point, road.first_row, plain=growth is not None)
    where = None if point is None else (point.column, point.row + road.first_row)
    return SeenRoad(road, horizon, region, where)


def _sure_point(
    edges: Edges, blurred: NDArray[np.float32], road: RoadImage, camera: Camera, told: Horizon
) -> VanishingPoint | None:
    clear = min(CLEAR_OF_VANISHING_POINT, 0.08 * camera.height)
    first = math.ceil(told.row - road.first_row + clear)
    lines = hough_lines(edges.pixels, first, SURE_LOWEST, LINES, SURE_STEEPEST)
    expected = (camera.principal_point[0], told.row - road.first_row)
    return vanishing_point(
        refined_lines(lines, edges.pixels, blurred, first), expected, max(5.0 * told.standard_deviation, 2.0)
    )


def _combined(told: Horizon, point: VanishingPoint, first_row: int, *, plain: bool) -> Horizon:
    if plain:
        return Horizon(point.row + first_row, point.row_deviation)
    share = told.standard_deviation**2 / (told.standard_deviation**2 + point.row_deviation**2)
    row = told.row + share * (point.row + first_row - told.row)
    return Horizon(row, math.sqrt(share) * point.row_deviation)


def _hide(region: NDArray[np.uint8], road: RoadImage, camera: Camera, lead: LeadMeasurement | None) -> None:
    """Take what a tracked vehicle may cover out of a region."""
    if lead is None or not lead.distance > VEHICLE_MARGIN:
        return
    near = max(lead.distance - VEHICLE_MARGIN, 1.0)
    foot = math.ceil(camera.horizon_row + camera.row_distance / near) - road.first_row
    half = HALF_VEHICLE * camera.focal_length / near
    left, right = max(int(camera.principal_point[0] - half), 0), max(int(camera.principal_point[0] + half) + 1, 0)
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
    """Extinction and its standard deviation by least squares over the region's rows and the sky [1/m].

    A whole road without a trace of fog gives 0, with the detection limit as the deviation.

    Raises
    ------
    CannotTellError
        If the road is hidden or follows no Koschmieder's law.
    """
    curve, top = _curve(road, camera)
    model = _credible(fit_curve(curve), curve, road.image)
    if model is None:
        if top > max(NEAR_HORIZON, camera.row_distance / FAR_ENOUGH):
            raise CannotTellError("the road's region ends below the horizon, and no inflection lies in it")
        if float(np.median(curve.luminance[curve.below_horizon > 0][:3])) > road.image.road + 0.5 * road.image.contrast:
            raise CannotTellError("the road fades into the airlight, but not as Koschmieder's law has it")
        return 0.0, 2.0 / camera.row_distance * math.hypot(max(top, 1.0) + 1.0, road.horizon.standard_deviation)
    by_horizon = model.horizon_sensitivity * road.horizon.standard_deviation
    return model.extinction, math.hypot(model.standard_deviation, by_horizon, ALBEDO_SHARE * model.extinction)


def _curve(road: SeenRoad, camera: Camera) -> tuple[RoadCurve, float]:
    """Luminance by row, and the rows below the horizon at which the road's part begins."""
    image, (u0, v0) = road.image, camera.principal_point
    rows = np.arange(image.luminance.shape[0]) + image.first_row
    below = rows - road.horizon.row
    half = np.maximum(HALF_ROAD / camera.mount_height * np.maximum(below, 0.0), 2.0)
    left, right = np.floor(u0 - half).astype(np.int64), np.ceil(u0 + half).astype(np.int64)
    medians = row_medians(image.luminance, road.region, left, right)
    # A row that the horizon crosses shows both sky and road.
    seen = (medians.count > 0) & (below > 0.7)
    if int(seen.sum()) < MIN_ROWS // 2:
        raise CannotTellError("no road is seen")
    sky = sky_profile(image, margin=3)
    # Half of the pixels of a row lie farther from the axis than this, and the ray to them is that much longer.
    across = 0.5 * (np.minimum(right, camera.width - 1) - np.maximum(left, 0))[seen] / 2.0
    slant: NDArray[np.float64] = np.sqrt(1.0 + (across**2 + (rows[seen] - v0) ** 2) / camera.focal_length**2)
    distance = path_lengths(below[seen].astype(np.float64), camera.row_distance, slant)
    luminance = np.concatenate([sky, medians.luminance[seen]])
    counted = np.concatenate([np.ones(sky.size), medians.count[seen] / (medians.count[seen] + 8.0)])
    curve = RoadCurve(
        below_horizon=np.concatenate([np.arange(-sky.size, 0.0), below[seen]]),
        luminance=luminance,
        distance=np.concatenate([np.full(sky.size, np.inf), distance]),
        weight=np.where(luminance < SATURATED, counted, 0.0),
        row_distance=camera.row_distance,
    )
    return curve, float(below[seen][0])


def _credible(model: FogModel | None, curve: RoadCurve, image: RoadImage) -> FogModel | None:
    """Pass a model only if it is one of fog over this road and rows at its inflection or near it were seen."""
    if model is None or not 0.0 < model.extinction < math.inf:
        return None
    drop = model.airlight - model.road
    seen = 0.5 * model.extinction * curve.row_distance <= curve.below_horizon[-1]
    fits = drop >= MIN_CONTRAST and model.residual <= MAX_RESIDUAL * drop
    excess = model.airlight - image.airlight
    airlight = abs(excess) <= 0.3 * image.contrast or (excess > 0 and image.airlight >= SATURATED)
    return model if seen and fits and airlight else None
