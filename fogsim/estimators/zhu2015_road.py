"""What zhu2015 sees of the road in one frame: lane lines, horizon, region, and the inflection of its rows."""

import math
from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.estimators.negru2013_band import fog_limits, fog_slope
from fogsim.estimators.repairs import Repair
from fogsim.values.camera import Camera
from fogsim.values.observation import LeadMeasurement
from fogsim.vision.light.luminance import linear_pixels
from fogsim.vision.lines.edges import Edges, edge_map, smoothed
from fogsim.vision.lines.horizon import CannotTellError, Horizon, calibrated_horizon
from fogsim.vision.lines.road_lines import seen_horizon
from fogsim.vision.lines.vanishing_point import LaneLine, hough_lines, longest_pair, published_vanishing_point
from fogsim.vision.region.law import (
    check_law,
    detection_limit,
    extinction_deviation,
    fog_or_clear,
    is_clear,
    seen_up_to,
    slants,
    transmittance,
)
from fogsim.vision.region.profile import RoadCurve, corridor_curve, hide_vehicle
from fogsim.vision.region.road_image import MIN_ROWS, SATURATED, RoadImage, road_image
from fogsim.vision.region.road_region import GrowthLimits, constant_limits, grow_region, region_tops

Floats = NDArray[np.float64]

_LEAST_REACH = 1.5
"""Rows to either side over which a slope is taken at least [px]."""

_PLACES, _HIGHEST = 96, 0.6
"""Places at which the slope is looked at, evenly in ln(v − v_h), and the first of them below the horizon [px]."""

_SEEN = 0.7
"""Share of the rows of a window that must be seen [-]."""

_PEAK = 0.85
"""Share of the steepest slope from which on places count for that of the peak [-]."""

_NEAREST_OF_RISE, _FARTHEST_OF_RISE = 1.2, 0.2
"""Rows between which the steepest is sought, over the row about which the luminance changes most in ln(v − v_h), which
by Koschmieder's law is twice the inflection's [-]."""

_STEPS = 4
"""How often the law's own steepest row is compared with the one that is seen."""


def places(curve: RoadCurve) -> Floats:
    """Heights below the horizon at which slopes are looked at.

    Returns v − v_h, ascending [px].
    """
    return np.asarray(np.geomspace(_HIGHEST, max(float(curve.below_horizon[-1]), 2.0 * _HIGHEST), _PLACES))


def slopes(curve: RoadCurve, luminance: Floats, reach: float) -> Floats:
    """Brightening upward about `places`, the slope of least squares over rows in proportion to their height.

    In the logarithm of v − v_h all fogs have one curve, shifted; a window in proportion to v − v_h keeps that.

    Returns slopes, positive where it brightens upward [linear grey levels per px]; −inf where too little is seen. Takes
    `luminance` (n, m).
    """
    at, rows = places(curve), curve.below_horizon[:, None]
    half = np.maximum(reach * at, _LEAST_REACH)
    weight = curve.weight[:, None]
    columns = np.concatenate(
        (weight, weight * rows, weight * rows**2, weight * luminance, weight * rows * luminance), axis=1
    )
    sums = np.concatenate((np.zeros((1, columns.shape[1])), np.cumsum(columns, axis=0)))
    within = _sums_up_to(sums, at + half - rows[0, 0] + 0.5) - _sums_up_to(sums, at - half - rows[0, 0] + 0.5)
    count, by_row, by_square = within[:, :1], within[:, 1:2], within[:, 2:3]
    by_light, by_both = np.split(within[:, 3:], 2, axis=1)
    spread = count * by_square - by_row**2
    seen = (count[:, 0] >= _SEEN * 2.0 * half) & (at + half <= rows[-1, 0] + 0.5)
    slope = -(count * by_both - by_row * by_light) / np.maximum(spread, 1e-9)
    return np.asarray(np.where(seen[:, None], slope, -np.inf))


def _sums_up_to(sums: Floats, place: Floats) -> Floats:
    """Sums up to places between rows; a part of the row after each place counts."""
    place = np.clip(place, 0.0, len(sums) - 1.0)
    row = np.minimum(place.astype(np.int64), len(sums) - 2)
    part = (place - row)[:, None]
    return np.asarray(sums[row] * (1.0 - part) + sums[row + 1] * part)


def _steepest_rows(curve: RoadCurve, luminance: Floats, reach: float) -> Floats:
    """Steepest row of each of some curves, by a parabola over the logarithm of v − v_h about the peak.

    Returns v − v_h [px]; NaN where it never brightens upward (m,).
    """
    at = places(curve)
    slope = slopes(curve, luminance, reach)
    # A step of noise near the horizon may be steeper than dense fog, but is no large one.
    rise = at[np.argmax(slope * at[:, None], axis=0)]
    near = (at[:, None] <= _NEAREST_OF_RISE * rise) & (at[:, None] >= _FARTHEST_OF_RISE * rise)
    return _peaks(at, np.ascontiguousarray(np.where(near, slope, -np.inf)))


@kernel
def _peaks(at: NDArray[np.float64], slope: NDArray[np.float64]) -> NDArray[np.float64]:
    """Places of the greatest slopes: `at` (p,) even in its logarithm, `slope` (p, m); NaN where none is positive."""
    count, step = at.size, np.log(at[1] / at[0])
    out = np.full(slope.shape[1], np.nan)
    for column in range(slope.shape[1]):
        best = 0
        for place in range(1, count):
            if slope[place, column] > slope[best, column]:
                best = place
        most = slope[best, column]
        if not most > 0.0:
            continue
        first, last = best, best
        while first > 0 and slope[first - 1, column] >= _PEAK * most:
            first -= 1
        while last + 1 < count and slope[last + 1, column] >= _PEAK * most:
            last += 1
        middle, reach = 0.5 * (first + last), 0.5 * (last - first)
        # A parabola of least squares: x and x² − mean are independent over places evenly about the middle.
        tilt, bend, squares, fourths = 0.0, 0.0, 0.0, 0.0
        mean = reach * (reach + 1.0) / 3.0
        for place in range(first, last + 1):
            x = place - middle
            curved = x * x - mean
            tilt += x * slope[place, column]
            bend += curved * slope[place, column]
            squares += x * x
            fourths += curved * curved
        offset = best - middle
        if last - first >= 2 and bend < 0.0:
            offset = min(max(-0.5 * (tilt / squares) / (bend / fourths), -reach), reach)
        out[column] = at[0] * np.exp(step * (middle + offset))
    return out


def _highest_place(curve: RoadCurve, reach: float) -> float:
    """Place nearest to the horizon about which enough rows are seen for a slope [px below it]; infinite without any."""
    seen = np.isfinite(slopes(curve, curve.luminance[:, None], reach)[:, 0])
    return float(places(curve)[seen][0]) if seen.any() else np.inf


def _fog_of_steepest_rows(curve: RoadCurve, luminance: Floats, reach: float) -> Floats:
    """Extinctions whose laws are steepest, over the same rows and windows, where some curves are.

    At the inflection itself that is k = 2 (v_i − v_h) / λ (zhu2015 eq. 21); a window of some width, and rows of one,
    shift the steepest row by a share of v − v_h that follows from the law itself.

    Returns k [1/m]; NaN where a curve never brightens upward (m,).
    """
    seen = _steepest_rows(curve, luminance, reach)
    optical = 2.0 * seen
    for _ in range(_STEPS):
        law = -transmittance(optical * slants(curve)[:, None], curve.below_horizon[:, None])
        optical = optical * np.clip(seen / _steepest_rows(curve, law, reach), 0.5, 2.0)
    return np.asarray(optical / curve.row_distance)


_LOWEST_ANGLE = math.radians(10.0)
"""Angle to the rows below which a line is no lane line (zhu2015 section 3.2) [rad]."""

REACH = 0.7
"""Rows to either side over which the steepest slope is taken, over those below the horizon [-]."""

_RESOLVED = 1.3
"""The steepest row over the topmost at which a slope is seen, from which on it is no end of what is seen [-]."""

_MOST_SCATTER = 0.2
"""Median deviation of the nearest row's pixels from their median, over the contrast, beyond which it is no road [-]."""

_TOGETHER = 3
"""Neighbouring rows that make the last that is seen."""

_FARTHEST_NEAR, _LEAST_LEFT, _ALBEDO = 30.0, 0.05, 0.04
"""Distance that the last row must have at least [m], least share of its contrast that must be left, and deviation of
two places of a road from one another [-]."""


class Zhu2015Repair(Repair):
    """What the corrected zhu2015 does otherwise than the paper."""

    LINEAR_LUMINANCE = (
        "linear_luminance",
        "pixel values stand for luminance",
        "the camera's response is undone, for Koschmieder's law is of light",
    )
    FOG_DRAWS_NO_EDGES = (
        "fog_draws_no_edges",
        "Canny's edges include the fog's own gradient, and stop the region at its steepest",
        "each row's gradient is taken away as far as fog can make it",
    )
    GROWTH_BY_FOG = (
        "growth_by_fog",
        "one G_max for all rows, and no value for it or ρ: no value suits both dense and thin fog",
        "G_max of a row is the steepest that fog can be there, airlight / (e (v − v_h)); a silhouette's step is more",
    )
    STEEPEST_ROW = (
        "steepest_row",
        "the row where the region ends is taken for the inflection",
        "the steepest row of the region's medians, to a fraction of a row, its slopes taken over rows in proportion to"
        " their height below the horizon; the shift of the steepest row by such a window follows from the law",
    )
    LAST_ROW = (
        "last_row",
        "a road that is hidden before its inflection (by a vehicle, or by what stands along the horizon) has none, and"
        " its end is taken for it",
        "k from how far the last visible row has brightened towards the sky since the bottom of the image",
    )
    SUBPIXEL_HORIZON = (
        "subpixel_horizon",
        "the intersection of whole Hough cells (1 px, 1°) is the horizon",
        "lines within the pixel, weighed against the calibration",
    )
    OWN_LANE = (
        "own_lane",
        "the region grows between the two longest lines (section 4), which may be any lines, and over the whole image"
        " where they are not found; in fog it spreads over the verge",
        "what of the region lies within 2.5 m of the lane lines' vanishing column counts, as the lane narrows",
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
class SeenRoad:
    """One frame's road."""

    image: RoadImage  # The pixels
    horizon: Horizon  # From the lane lines where they meet, else from the calibration; in rows of the whole image
    region: NDArray[np.uint8]  # (rows, cols) uint8: The grown region
    vanishing_point: tuple[float, float] | None  # Column and row [px]
    lines: tuple[LaneLine, ...]  # The published method's lane lines, in rows of `image`
    hidden: float = 0.0  # Half of what a tracked vehicle hides of the width of the image [px]; 0 without one


def seen_road(
    image: NDArray[np.uint8] | NDArray[np.uint16],
    camera: Camera,
    pitch_deviation: float,
    growth: tuple[float, float],
    repairs: AbstractSet[Zhu2015Repair],
    lead: LeadMeasurement | None,
) -> SeenRoad:
    """Find lines, horizon and road in an image (`image` (rows, cols), `pitch_deviation` [rad])."""
    assumed = calibrated_horizon(camera, pitch_deviation)
    road = road_image(image, camera, assumed, linear=Zhu2015Repair.LINEAR_LUMINANCE in repairs)
    blurred = smoothed(road.luminance)
    slope = fog_slope(road, assumed)
    edges = edge_map(blurred, slope if Zhu2015Repair.FOG_DRAWS_NO_EDGES in repairs else np.zeros_like(slope))
    if edges.threshold > road.contrast:
        raise CannotTellError("noise or texture drowns the contrast of road and airlight")
    lines: list[LaneLine] = []
    if not {Zhu2015Repair.SUBPIXEL_HORIZON, Zhu2015Repair.OWN_LANE} <= repairs:
        lines = hough_lines(edges.pixels, math.ceil(assumed.row - road.first_row) + 1, _LOWEST_ANGLE)
    if Zhu2015Repair.SUBPIXEL_HORIZON in repairs:
        horizon, point = seen_horizon(linear_pixels(road.level, camera), camera, assumed)
    else:
        point = published_vanishing_point(lines, road.first_row)
        horizon = assumed if point is None else point.horizon
    blocked = edges.pixels
    if Zhu2015Repair.OWN_LANE not in repairs:
        blocked = blocked | _outside_lines(lines, blocked.shape)
    region = grow_region(blurred, blocked, _limits(slope, road, edges, growth, repairs))
    hidden = hide_vehicle(region, road, camera, lead) if Zhu2015Repair.LEAD_LEFT_OUT in repairs else 0.0
    where = None if point is None else (point.column, point.row)
    return SeenRoad(road, horizon, region, where, tuple(lines), hidden)


def _limits(
    slope: NDArray[np.float32],
    road: RoadImage,
    edges: Edges,
    growth: tuple[float, float],
    repairs: AbstractSet[Zhu2015Repair],
) -> GrowthLimits:
    if Zhu2015Repair.GROWTH_BY_FOG not in repairs:
        step, share = growth
        return constant_limits(slope.size, step, step * share, step)
    return fog_limits(road, edges, slope)


def _outside_lines(lines: Sequence[LaneLine], shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """1 outside the longest line of either half, from where they meet down; 0 everywhere if a half has none."""
    pair = longest_pair(lines)
    if pair is None:
        return np.zeros(shape, np.uint8)
    rows, cols = np.arange(shape[0])[:, None], np.arange(shape[1])
    left, right = (line.offset + line.slope * rows for line in pair)
    return ((cols < left) | (cols > right)).astype(np.uint8)


def inflection_rows(road: SeenRoad) -> NDArray[np.float64]:
    """Rows at which the columns of the region end, below the horizon [px]: the published inflection."""
    tops = region_tops(road.region)
    if tops.size == 0:
        raise CannotTellError("no region grows from the bottom row")
    return np.asarray(tops + (road.image.first_row - road.horizon.row), np.float64)


@dataclass(frozen=True, slots=True)
class Inflection:
    """The fog of one frame."""

    # extinction, deviation: k and its standard deviation [1/m]; k is 0 where no fog shows
    extinction: float
    deviation: float
    # airlight, road: A and R that go with it [linear grey levels]
    airlight: float | None = None
    road: float | None = None


def steepest_fog(road: SeenRoad, camera: Camera, repairs: AbstractSet[Zhu2015Repair]) -> Inflection:
    """Fog of the steepest row of the region's medians."""
    curve = _curve(road, camera, own_lane=Zhu2015Repair.OWN_LANE in repairs)
    apart = road.horizon.standard_deviation
    if is_clear(curve, road.image):
        if Zhu2015Repair.LAST_ROW in repairs:
            return _of_last_row(curve, road)
        return Inflection(0.0, detection_limit(seen_up_to(curve), apart, camera.row_distance))
    extinction = float(_read(curve, curve.luminance[:, None])[0])
    resolved = _RESOLVED * _highest_place(curve, REACH)
    if extinction > 0.0 and _steepest_rows(curve, curve.luminance[:, None], REACH)[0] >= resolved:
        airlight, dark = check_law(curve, extinction, road.image)
        deviation = extinction_deviation(curve, extinction, _read, apart)
        return Inflection(*fog_or_clear(extinction, deviation), airlight, dark)
    if Zhu2015Repair.LAST_ROW not in repairs:
        seen_up_to(curve)
        raise CannotTellError("the inflection lies above the last row of the road that is seen")
    return _of_last_row(curve, road)


def _of_last_row(curve: RoadCurve, road: SeenRoad) -> Inflection:
    """Fog of how far the last row that is seen has brightened."""
    rows = np.flatnonzero((curve.weight > 0.0) & (curve.below_horizon >= 1.0))
    # A row of a few pixels between edges may be anything: the last counts that has others below it.
    together = np.flatnonzero(rows[_TOGETHER - 1 :] - rows[: 1 - _TOGETHER] == _TOGETHER - 1)
    rows = rows[int(together[0]) :] if together.size else rows[:0]
    if rows.size < MIN_ROWS // 2 or curve.below_horizon[rows[0]] * _FARTHEST_NEAR > curve.row_distance:
        raise CannotTellError("the road's region ends below the horizon, and no inflection lies in it")
    near = rows[curve.below_horizon[rows] >= 0.5 * curve.below_horizon[-1]]
    if near.size == 0:
        raise CannotTellError("no road is seen")
    bottom_row = int(near[-1])
    pixels = road.image.luminance[bottom_row][road.region[bottom_row] != 0]
    if pixels.size and np.median(np.abs(pixels - np.median(pixels))) > _MOST_SCATTER * road.image.contrast:
        raise CannotTellError("what is ahead is too patchy for a road")
    last = rows[:_TOGETHER]
    below, apart = float(curve.below_horizon[last[_TOGETHER // 2]]), road.horizon.standard_deviation
    dark = road.image.airlight - float(np.median(curve.luminance[last]))
    bottom = road.image.airlight - float(np.median(curve.luminance[near]))
    if dark <= _LEAST_LEFT * bottom:
        raise CannotTellError("the road has faded into the airlight where it is last seen")
    # (A − I) e^(kλ/(v − v_h)) is the same of both rows, and the nearer one's fog is thin.
    span = 1.0 / below - float(np.mean(1.0 / curve.below_horizon[near]))
    optical = max(math.log(bottom / dark), 0.0) / span
    noise = road.image.contrast * _ALBEDO / dark
    deviation = math.hypot(math.hypot(_ALBEDO, noise) / span, optical * apart / below)
    return Inflection(*fog_or_clear(optical / curve.row_distance, deviation / curve.row_distance))


def _read(curve: RoadCurve, luminance: NDArray[np.float64]) -> NDArray[np.float64]:
    return _fog_of_steepest_rows(curve, luminance, REACH)


def _curve(road: SeenRoad, camera: Camera, *, own_lane: bool) -> RoadCurve:
    axis = camera.principal_point[0] if road.vanishing_point is None else road.vanishing_point[0]
    curve = corridor_curve(
        road.image, road.region, road.horizon.row, axis, camera, own_lane=own_lane, hidden=road.hidden
    )
    # A sky that is clipped does not brighten: rows of it tell where the slope ends.
    return curve._replace(weight=np.maximum(curve.weight, curve.luminance >= SATURATED))
