"""Luminance by row: the curve that fog draws on the road."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.values.camera import Camera
from fogsim.values.observation import LeadMeasurement
from fogsim.vision.light.medians import row_medians, span_medians
from fogsim.vision.region.road_image import SATURATED, RoadImage
from fogsim.vision.region.road_region import Band

_MAX_BLOCKS = 48  # columns that a row's median is taken over; more cost time and gain nothing


def band_profile(luminance: NDArray[np.float32], band: Band) -> NDArray[np.float64]:
    """Median luminance of each row of a band.

    A wide band is first averaged over equal blocks of columns: that keeps the median's indifference to marks and other
    narrow things, and loses less to noise than a median of single pixels.

    Returns rows ``band.top`` … ``band.bottom`` from the top down. Takes `luminance` (rows, cols).
    """
    width = band.right - band.left + 1
    block = -(-width // _MAX_BLOCKS)
    count = width // block
    left = band.left + (width - count * block) // 2
    strip = luminance[band.top : band.bottom + 1, left : left + count * block]
    if block > 1:
        strip = strip.reshape(strip.shape[0], count, block).mean(axis=2, dtype=np.float64)
    return row_medians(strip)


def decreasing(profile: NDArray[np.float64]) -> NDArray[np.float64]:
    """Smooth a profile such that it never rises from the top down, and falls wherever its neighbourhood does.

    Isotonic regression, then the binomial 1-2-1, which keeps the order and rounds the steps off.

    Takes `profile` (n,).
    """
    ordered: NDArray[np.float64] = _isotonic_decreasing(np.ascontiguousarray(profile))
    padded = np.concatenate([ordered[:1], ordered, ordered[-1:]])
    return 0.25 * padded[:-2] + 0.5 * padded[1:-1] + 0.25 * padded[2:]


@kernel
def _isotonic_decreasing(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Nearest sequence in least squares that never rises: pool adjacent violators on (n,) float64."""
    count = values.size
    means = np.empty(count)
    sizes = np.empty(count, np.int64)
    blocks = 0
    for value in values:
        means[blocks], sizes[blocks] = value, 1
        blocks += 1
        while blocks > 1 and means[blocks - 2] < means[blocks - 1]:
            total = sizes[blocks - 2] + sizes[blocks - 1]
            means[blocks - 2] += (means[blocks - 1] - means[blocks - 2]) * sizes[blocks - 1] / total
            sizes[blocks - 2] = total
            blocks -= 1
    return np.repeat(means[:blocks], sizes[:blocks])


class RoadCurve(NamedTuple):
    """The luminance of the road by row, with what the flat world says about the rows."""

    below_horizon: NDArray[np.float64]  # (n,): v − v_h of each row, ascending [px]; not positive for rows of sky
    luminance: NDArray[np.float64]  # (n,): Linear luminance of each row
    distance: NDArray[np.float64]  # (n,): Length of the fog path to each row's road [m]; ``inf`` for rows of sky
    weight: NDArray[np.float64]  # (n,): 1, or 0 for rows that say nothing (saturated)
    row_distance: float  # λ of the camera [px·m]


def path_lengths(
    below_horizon: NDArray[np.float64], row_distance: float, slant: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Distance from the optical centre to the road by row.

    Returns distances [m]; ``inf`` at and above the horizon. Takes `below_horizon` (n,) [px], `row_distance` [px·m],
    `slant` (n,).
    """
    distance = np.full(below_horizon.shape, np.inf)
    np.divide(row_distance * slant, below_horizon, out=distance, where=below_horizon > 0)
    return distance


_HALF_ROAD = 2.5
"""How far to either side of the vehicle's axis the ground is surely road [m]."""

_LEAST_HALF = 3.0
"""Half width of the corridor about the horizon, where it would be narrower [px]."""

_HALF_BESIDE, _BESIDE = 6.0, 8.0
"""The same where a tracked vehicle hides the own lane [m], and by how much it is wider to either side than what is
hidden [px]."""

_HALF_VEHICLE, _VEHICLE_MARGIN = 1.5, 2.0
"""What a tracked vehicle hides either side of the axis, and how much nearer than measured its foot may be [m]."""

_FEWEST = 3
"""Fewest pixels that make a row's median."""


def hide_vehicle(
    region: NDArray[np.uint8],
    road: RoadImage,
    camera: Camera,
    lead: LeadMeasurement | None,
    half_width: float = _HALF_VEHICLE,
) -> float:
    """Take what a tracked vehicle may cover out of a region.

    Returns half the width of what is hidden [px]; 0 without a vehicle. Takes `region` (rows, cols) uint8, `half_width`
    [m].
    """
    if lead is None or not lead.distance > _VEHICLE_MARGIN:
        return 0.0
    free = max(lead.distance - _VEHICLE_MARGIN, 1.0)
    foot = math.ceil(camera.horizon_row + camera.row_distance / free) - road.first_row
    half = half_width * camera.focal_length / free
    middle = camera.principal_point[0] - road.first_column
    left, right = max(math.ceil(middle - half), 0), max(math.floor(middle + half) + 1, 0)
    region[: max(foot, 0), left:right] = 0
    return half


def corridor_curve(
    road: RoadImage,
    region: NDArray[np.uint8],
    horizon_row: float,
    axis: float,
    camera: Camera,
    *,
    own_lane: bool = True,
    hidden: float = 0.0,
) -> RoadCurve:
    """Medians of the region's rows within a corridor that narrows toward the horizon as the road does.

    Returns of all rows of the picture; those without region, or saturated, have no weight. Takes `region` (rows, cols)
    uint8, `horizon_row` [px], `axis` [px], `hidden` [px].
    """
    rows, cols = road.luminance.shape
    below = np.arange(rows, dtype=np.float64) + (road.first_row - horizon_row)
    # A lateral offset x at a depth z is α x / z columns, and z is λ / (v − v_h).
    per_metre = camera.focal_length / camera.row_distance
    wide, least = (_HALF_BESIDE, hidden + _BESIDE) if hidden > 0.0 else (_HALF_ROAD, _LEAST_HALF)
    half = np.maximum(wide * per_metre * np.abs(below), least) if own_lane else np.full(rows, float(cols))
    half = np.minimum(half, float(cols))
    middle = axis - road.first_column
    left, right = np.ceil(middle - half).astype(np.int64), np.floor(middle + half).astype(np.int64)
    # Every pixel counts: a picture and its mirror image have the same.
    medians = span_medians(road.luminance, region, left, right, 1 << 30, _FEWEST)
    weight = ((medians.number > 0) & (medians.luminance < SATURATED)).astype(np.float64)
    tilt = (below + (horizon_row - camera.principal_point[1])) / camera.focal_length
    distance = path_lengths(below, camera.row_distance, np.sqrt(1.0 + tilt**2))
    return RoadCurve(below, medians.luminance, distance, weight, camera.row_distance)
