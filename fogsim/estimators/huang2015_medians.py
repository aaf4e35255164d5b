"""huang2015_rough's region, its row medians, the row of their largest change, and the search about it (section 4.2)."""

import math
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import matrix_product
from fogsim.estimators.negru2013_band import fog_limits, fog_slope
from fogsim.estimators.repairs import Repair
from fogsim.values.camera import Camera
from fogsim.values.observation import LeadMeasurement
from fogsim.vision.light.luminance import linear_pixels
from fogsim.vision.lines.edges import Edges, edge_map, smoothed
from fogsim.vision.lines.horizon import CannotTellError, Horizon
from fogsim.vision.lines.road_lines import seen_horizon
from fogsim.vision.lines.vanishing_point import hough_lines, published_vanishing_point
from fogsim.vision.region.law import slants, transmittance
from fogsim.vision.region.profile import RoadCurve, corridor_curve, hide_vehicle
from fogsim.vision.region.road_image import RoadImage
from fogsim.vision.region.road_region import constant_limits, grow_region, region_medians

Floats = NDArray[np.float64]

STEP = 3.0
"""Largest difference between a pixel and its seed in the row below, and to the bottom row's median for each row
between (constraints 1 and 2) [linear grey levels]."""

_FROM_MEDIAN = 10.0
"""Largest difference of a pixel from its row's median (constraint 4) [linear grey levels]."""

ROWS_APART = 20
"""Rows over which the medians' difference is taken [px]."""

BELOW_INFLECTION = 50
"""Rows below the inflection that the optimisation looks at [px]."""

_SEARCH, _SEARCH_STEPS = 0.01, 401
"""Half-width of the search about k0 [1/m], and how many extinctions it tries."""

_WIDER, _TRIED = 2.0, 121
"""The same where it is as wide in the ratio of k to k0 [-]."""

_DISAGREEMENT = math.radians(1.0)
"""Largest difference between the horizons of lane lines and of the calibration [rad]; the thesis names no number."""

_NEARER = 2.0
"""Ratio of the heights below the horizon of the two rows whose medians are compared [-]."""

_PLACES, _HIGHEST = 160, 0.7
"""Pairs of rows that are compared, evenly in ln(v − v_h), and the upper row of the first [px]."""


class Huang2015Repair(Repair):
    """What the corrected huang2015_rough does otherwise than the thesis."""

    LINEAR_LUMINANCE = (
        "linear_luminance",
        "pixel values stand for luminance",
        "the camera's response is undone, for Koschmieder's law is of light",
    )
    FOG_DRAWS_NO_EDGES = (
        "fog_draws_no_edges",
        "edges include the fog's own gradient, and stop the region at its steepest",
        "each row's gradient is taken away as far as fog can make it",
    )
    GROWTH_BY_FOG = (
        "growth_by_fog",
        "no step of more than 3 grey levels joins, but fog itself is steeper from some 150 m on",
        "steps are as large as fog can make them in each row; a region that ends at the horizon without brightening is"
        " clear air",
    )
    OWN_LANE = (
        "own_lane",
        "the whole region counts, which in fog spreads over the verge",
        "what of it lies within 2.5 m of the lane lines' vanishing column, as the lane narrows",
    )
    SUBPIXEL_HORIZON = (
        "subpixel_horizon",
        "the two longest lines are whole Hough cells (1 px, 1°), and count or do not",
        "lines within the pixel, weighed against the calibration",
    )
    SCALED_ROWS = (
        "scaled_rows",
        "medians are compared over 20 rows; beyond some 300 m the inflection is nearer to the horizon than that",
        "medians are compared of a row and of that at twice its height below the horizon, whose difference is greatest"
        " where that height is kλ / (2 ln 2), whatever k is",
    )
    OWN_LUMINANCE = (
        "own_luminance",
        "R is the fogged luminance of the bottom row",
        "R is the road's own, which fits the medians best with each k",
    )
    RELATIVE_SEARCH = (
        "relative_search",
        "k is searched within ± 0.01 1/m of k0, which is little in dense fog and more than all in thin",
        "k is searched from k0 / 2 to 2 k0",
    )
    LEAD_LEFT_OUT = (
        "lead_left_out",
        "a vehicle ahead joins the region or ends it",
        "what the tracked vehicle hides is left out, and the road next to it is used",
    )
    CONFIRMED = (
        "confirmed",
        "the curve of the road alone is fog or clear air, whatever else the image shows, and the camera is exact",
        "the day model of road and sky must show fog, or contrast far away, as well; the interval spans both models,"
        " and what height, focal length and response leave open",
    )


@dataclass(frozen=True, slots=True)
class MedianRows:
    """Medians of the region's rows."""

    curve: RoadCurve  # The medians from the top down; rows without any have no weight
    horizon: Horizon  # In rows of the whole image
    top: float  # Topmost row that has a median, below the horizon [px]


def grown_medians(
    road: RoadImage,
    camera: Camera,
    assumed: Horizon,
    repairs: AbstractSet[Huang2015Repair],
    lead: LeadMeasurement | None,
) -> MedianRows:
    """Grow the region and take the medians of its rows."""
    blurred = smoothed(road.luminance)
    slope = fog_slope(road, assumed)
    edges = edge_map(blurred, slope if Huang2015Repair.FOG_DRAWS_NO_EDGES in repairs else np.zeros_like(slope))
    if edges.threshold > road.contrast:
        raise CannotTellError("noise or texture drowns the contrast of road and airlight")
    if Huang2015Repair.GROWTH_BY_FOG in repairs:
        region = grow_region(blurred, edges.pixels, fog_limits(road, edges, slope))
    else:
        region = grow_region(blurred, edges.pixels, constant_limits(slope.size, STEP, STEP, _FROM_MEDIAN))
        medians = region_medians(road.luminance, region)
        region[np.abs(road.luminance - medians.luminance[:, None]) > _FROM_MEDIAN] = 0
    hidden = hide_vehicle(region, road, camera, lead) if Huang2015Repair.LEAD_LEFT_OUT in repairs else 0.0
    horizon, axis = _horizon(edges, road, camera, assumed, repairs)
    own_lane = Huang2015Repair.OWN_LANE in repairs
    curve = corridor_curve(road, region, horizon.row, axis, camera, own_lane=own_lane, hidden=hidden)
    seen = np.flatnonzero(curve.weight > 0.0)
    if seen.size <= ROWS_APART:
        raise CannotTellError("the region grows over fewer rows than the method compares")
    return MedianRows(curve, horizon, float(curve.below_horizon[seen[0]]))


def _horizon(
    edges: Edges, road: RoadImage, camera: Camera, assumed: Horizon, repairs: AbstractSet[Huang2015Repair]
) -> tuple[Horizon, float]:
    """Horizon, and column of the two longest lines' vanishing point if it agrees with the calibration's."""
    column = camera.principal_point[0]
    if Huang2015Repair.SUBPIXEL_HORIZON in repairs:
        horizon, seen = seen_horizon(linear_pixels(road.level, camera), camera, assumed)
        return horizon, column if seen is None else seen.column
    below = math.ceil(camera.horizon_row) - road.first_row + 1
    point = published_vanishing_point(hough_lines(edges.pixels, below, math.radians(1.0)), road.first_row)
    if point is None or abs(point.row - camera.horizon_row) > _DISAGREEMENT * camera.focal_length:
        return assumed, column
    return Horizon(point.row, assumed.standard_deviation), column


def first_extinctions(curve: RoadCurve, luminance: Floats, repairs: AbstractSet[Huang2015Repair]) -> Floats:
    """Extinctions by the rows where some curves change most.

    Returns k0 [1/m]; NaN or not positive where the largest change is above the horizon (m,). Takes `luminance` (n, m)
    [linear grey levels].
    """
    seen = curve.weight > 0.0
    below, light = curve.below_horizon[seen], luminance[seen]
    if Huang2015Repair.SCALED_ROWS not in repairs:
        change = np.abs(light[ROWS_APART:] - light[:-ROWS_APART])
        best = np.argmax(change, axis=0)
        return np.asarray((below[best] + below[best + ROWS_APART]) / curve.row_distance)
    upper = np.geomspace(_HIGHEST, max(float(below[-1]) / _NEARER, 2.0 * _HIGHEST), _PLACES)
    change = _between(below, light, upper) - _between(below, light, _NEARER * upper)
    best = np.argmax(change, axis=0)
    # Of e^(−K/(2u)) − e^(−K/u) the greatest is where e^(−K/(2u)) = 1/2.
    return np.asarray(_NEARER * math.log(_NEARER) / (_NEARER - 1.0) * upper[best] / curve.row_distance)


def _between(below: Floats, light: Floats, places: Floats) -> Floats:
    """Luminance at places between rows, averaged over as much to either side as a sixth of their height."""
    sums = np.concatenate((np.zeros((1, light.shape[1])), np.cumsum(light, axis=0)))
    edges = np.concatenate((below - 0.5, below[-1:] + 0.5))
    half = np.maximum(places / 6.0, 0.5)
    ends = [np.interp(places + side * half, edges, np.arange(edges.size)) for side in (-1.0, 1.0)]
    within = [_up_to(sums, end) for end in ends]
    return np.asarray((within[1] - within[0]) / np.maximum(ends[1] - ends[0], 1e-9)[:, None])


def _up_to(sums: Floats, place: Floats) -> Floats:
    row = np.minimum(place.astype(np.int64), len(sums) - 2)
    part = (place - row)[:, None]
    return np.asarray(sums[row] * (1.0 - part) + sums[row + 1] * part)


def optimised_extinctions(
    curve: RoadCurve, luminance: Floats, first: Floats, repairs: AbstractSet[Huang2015Repair]
) -> Floats:
    """Extinctions about the first ones that fit best, A being the median of the top row (section 4.2.4).

    Returns k [1/m]; NaN where there is no k0 (m,). Takes `first` (m,) [1/m].
    """
    known = np.isfinite(first) & (first > 0.0)
    if not known.any():
        return np.full(first.size, math.nan)
    least, most = float(first[known].min()), float(first[known].max())
    if Huang2015Repair.RELATIVE_SEARCH in repairs:
        tried = np.geomspace(least / _WIDER, most * _WIDER, round(_TRIED * (1.0 + math.log(most / least))))
        near = (tried[:, None] >= first / _WIDER) & (tried[:, None] <= first * _WIDER)
    else:
        steps = round(_SEARCH_STEPS * (1.0 + (most - least) / (2.0 * _SEARCH)))
        tried = np.linspace(max(least - _SEARCH, 1e-5), most + _SEARCH, steps)
        near = np.abs(tried[:, None] - first) <= _SEARCH
    seen = np.flatnonzero(curve.weight > 0.0)
    lowest = 0.5 * float(np.median(first[known])) * curve.row_distance + BELOW_INFLECTION
    used = seen[(curve.below_horizon[seen] > 0.0) & (curve.below_horizon[seen] <= lowest)]
    airlight = luminance[_top(curve)]
    shape = transmittance(tried[:, None] * (curve.row_distance * slants(curve)[used]), curve.below_horizon[used])
    missing = airlight - luminance[used]
    squares, both = (shape**2).sum(axis=1)[:, None], matrix_product(shape, missing)
    if Huang2015Repair.OWN_LUMINANCE in repairs:
        drop = np.maximum(both / np.maximum(squares, 1e-12), 0.0)
    else:
        drop = np.broadcast_to(airlight - luminance[seen[-1]], both.shape)
    error = (missing**2).sum(axis=0) - 2.0 * drop * both + drop**2 * squares
    best = np.argmin(np.where(near & known, error, np.inf), axis=0)
    return np.asarray(np.where(known, tried[best], math.nan))


def _top(curve: RoadCurve) -> int:
    """Topmost row of the region, be it saturated."""
    return int(np.flatnonzero((curve.weight > 0.0) | (curve.luminance > 0.0))[0])
