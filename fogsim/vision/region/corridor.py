"""The luminance of the road's rows within a corridor along the vehicle's axis, next to what a vehicle ahead hides."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera
from fogsim.values.observation import LeadMeasurement
from fogsim.vision.light.medians import span_medians
from fogsim.vision.region.profile import RoadCurve, path_lengths
from fogsim.vision.region.road_image import SATURATED, RoadImage

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
