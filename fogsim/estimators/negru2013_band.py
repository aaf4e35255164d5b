"""The band of road in whose rows negru2013 looks for fog (Negru & Nedevschi 2013, section IV.B.b)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera
from fogsim.values.observation import LeadMeasurement
from fogsim.vision.lines.edges import Edges, smoothed
from fogsim.vision.lines.horizon import CannotTellError, Horizon
from fogsim.vision.region.inflection import steepest_slope
from fogsim.vision.region.profile import RoadCurve, corridor_curve, hide_vehicle, path_lengths
from fogsim.vision.region.road_image import MIN_ROWS, SATURATED, RoadImage
from fogsim.vision.region.road_region import Band, GrowthLimits, crossing_band, cumulative_limits, grow_region

_SIMILARITY = 0.25  # [-] steepest fog, in contrasts of road to airlight a row; a silhouette takes at least 0.34

_HALF_BODY = 1.1
"""Half the width of a vehicle ahead, next to which a band may lie at once [m]."""


@dataclass(frozen=True, slots=True)
class SeenBand:
    """A band of road and the picture that it is in."""

    road: RoadImage  # The picture, cut out and linear
    horizon: Horizon  # The horizon above it
    band: Band  # Where the band is: columns of the whole picture, rows of `road`
    profile: NDArray[np.float64]  # (n,): Median luminance of each of its rows from the top down [linear grey levels]

    @property
    def below_horizon(self) -> NDArray[np.float64]:
        """Rows of the band below the horizon [px]."""
        rows = np.arange(self.band.top, self.band.bottom + 1, dtype=np.float64)
        return rows + (self.road.first_row - self.horizon.row)


def fog_slope(road: RoadImage, horizon: Horizon) -> NDArray[np.float32]:
    """Steepest brightening upward that fog can make of each row [linear grey levels per px]."""
    below_horizon = np.arange(road.luminance.shape[0], dtype=np.float64) + (road.first_row - horizon.row)
    return np.minimum(steepest_slope(below_horizon, road.airlight), _SIMILARITY * road.contrast).astype(np.float32)


def fog_limits(road: RoadImage, edges: Edges, slope: NDArray[np.float32]) -> GrowthLimits:
    """Limits of a region whose neighbouring rows differ by no more than what fog of the given slopes and noise make."""
    steps = slope + np.float32(edges.threshold)
    return cumulative_limits(steps, _SIMILARITY * road.contrast + edges.threshold)


def road_band(
    road: RoadImage,
    edges: Edges,
    limits: GrowthLimits,
    camera: Camera,
    *,
    widest: bool = False,
    lead: LeadMeasurement | None = None,
) -> Band:
    """Find the band of road: columns are counted in the whole picture, rows in that of the road."""
    blurred = smoothed(road.luminance)
    region = grow_region(blurred, edges.pixels, limits)
    hide_vehicle(region, road, camera, lead, _HALF_BODY)
    cols, centre = camera.width, camera.principal_point[0] - road.first_column
    most = cols if widest else max(5, cols // 24)
    band = crossing_band(
        region, blurred, centre, min_width=max(3, cols // 80), max_width=most, hole=max(2, cols // 128)
    )
    if band is None or band.bottom - band.top < MIN_ROWS // 2:
        raise CannotTellError("no vertical band crosses the road's region")
    return band.moved(road.first_column)


def narrowed_curve(seen: SeenBand, axis: float, camera: Camera) -> RoadCurve:
    """Luminance of a band of road by row, as far as it is road: a band before the vehicle narrows upward with it.

    Takes `axis` [px].
    """
    road, band = seen.road, seen.band
    if not band.left <= axis <= band.right:
        # What is seen next to a vehicle ahead is all there is.
        return road_curve(seen, camera)
    inside = np.zeros(road.luminance.shape, np.uint8)
    inside[band.top : band.bottom + 1, band.left - road.first_column : band.right + 1 - road.first_column] = 1
    curve = corridor_curve(road, inside, seen.horizon.row, axis, camera)
    rows = slice(band.top, band.bottom + 1)
    return RoadCurve(
        curve.below_horizon[rows], curve.luminance[rows], curve.distance[rows], curve.weight[rows], curve.row_distance
    )


def road_curve(seen: SeenBand, camera: Camera) -> RoadCurve:
    """Luminance of a band of road over the rows below its horizon."""
    below, band = seen.below_horizon, seen.band
    u0, v0 = camera.principal_point
    across = (0.5 * (band.left + band.right) - u0) / camera.focal_length
    slant = np.sqrt(1.0 + across**2 + ((below + (seen.horizon.row - v0)) / camera.focal_length) ** 2)
    weight = (seen.profile < SATURATED).astype(np.float64)
    return RoadCurve(below, seen.profile, path_lengths(below, camera.row_distance, slant), weight, camera.row_distance)
