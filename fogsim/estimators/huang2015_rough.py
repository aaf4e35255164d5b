"""Rough visibility from the road's luminance in one frame (Huang 2015, section 4.2)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.estimators.image_check import ObservationCheck
from fogsim.estimators.zhu2015_road import fitted_fog, seen_road
from fogsim.parameters import checked_parameters
from fogsim.values.camera import Camera
from fogsim.values.estimate import Estimate
from fogsim.values.observation import Observation
from fogsim.vision.lines.edges import edge_map, smoothed
from fogsim.vision.lines.horizon import PITCH_DEVIATION, PitchDeviation, calibrated_horizon
from fogsim.vision.lines.lane_lines import hough_lines, published_vanishing_point
from fogsim.vision.region.inflection import koschmieder
from fogsim.vision.region.profile import path_lengths
from fogsim.vision.region.road_image import CannotTellError, RoadImage, road_image
from fogsim.vision.region.road_region import constant_limits, grow_region, region_medians

STEP = 3.0
"""Largest difference between a pixel and its seed in the row below, and to the bottom row's median for each row
between (constraints 1 and 2) [linear grey levels]."""

FROM_MEDIAN = 10.0
"""Largest difference of a pixel from its row's median (constraint 4) [linear grey levels]."""

ROWS_APART = 20
"""Rows over which the medians' difference is taken [px]."""

BELOW_INFLECTION = 50
"""Rows below the inflection that the optimisation looks at [px]."""

SEARCH, SEARCH_STEPS = 0.01, 401
"""Half-width of the search about k0 [1/m], and how many extinctions it tries."""

DISAGREEMENT = math.radians(1.0)
"""Largest difference between the horizons of lane lines and of the calibration [rad]; the thesis names no number."""


@checked_parameters
class Huang2015Rough:
    """Inflection of the grown road's row medians (Huang 2015, section 4.2).

    A region grown from the bottom row under four constraints, the median of each of its rows, the row where it
    changes most over 20 rows, the horizon from the two longest lane lines if it agrees with the calibration's, and the
    extinction near that of the inflection, k0 ± 0.01 1/m, that fits the medians best.

    The thesis fixes R and A to the medians of the bottom and of the top row, lets no step of more than 3 grey levels
    join (beyond some 150 m fog itself is steeper), needs 20 rows for a difference (beyond some 300 m the inflection is
    nearer to the horizon than that) and ± 0.01 1/m keeps the inflection's own error in dense fog. Corrected, the steps
    are those that fog can make, lane lines are fitted to a fraction of a pixel, and k, R and A are fitted freely over
    region and sky. Its eq. 4.11 is wrong by a factor of 10 (with α = 1.4 · 400 px and H = 1 m, λ is 560 px·m and the
    inflection at 500 m lies 1.7 px below the horizon, not 16.8). Constraint 4 is read row by row: the median of the
    whole region would cut the fog's own curve to 20 grey levels.

    Daytime, flat and straight road, road darker than the airlight.

    Parameters
    ----------
    camera : Camera
        The assumed calibration.
    as_published : bool
        The thesis' own constraints, 20-row medians and search.
    pitch_deviation : float
        Standard deviation of the true pitch about the assumed one [rad].
    """

    method = "huang2015_rough"

    def __init__(
        self, camera: Camera, *, as_published: bool = False, pitch_deviation: PitchDeviation = PITCH_DEVIATION
    ) -> None:
        self._camera, self._check = camera, ObservationCheck(camera)
        self._as_published = as_published
        self._pitch_deviation = pitch_deviation

    def reset(self) -> None:
        """Let time begin anew: every frame stands alone."""
        self._check.reset()

    def update(self, observation: Observation) -> Estimate:
        """Estimate the fog from one image.

        Parameters
        ----------
        observation : Observation
            Its image is used, and (not as published) the range of its lead vehicle to leave that out.

        Returns
        -------
        Estimate
            Diagnostics: ``horizon_row`` and ``inflection_row`` [px], as published also ``first_extinction``, that
            before the optimisation [1/m]; or ``reason``.

        Raises
        ------
        InputError
            If camera, image or time do not fit (see `fogsim.estimators.image_check`).
        """
        image = self._check.image_of(observation)
        try:
            if self._as_published:
                return self._published(image)
            road = seen_road(image, self._camera, self._pitch_deviation, None, observation.lead)
            extinction, deviation = fitted_fog(road, self._camera)
        except CannotTellError as reason:
            return Estimate.invalid(self.method, str(reason), horizon_row=self._camera.horizon_row)
        return self._estimate(extinction, deviation, road.horizon.row)

    def _published(self, image: NDArray[np.uint8] | NDArray[np.uint16]) -> Estimate:
        assumed = calibrated_horizon(self._camera, self._pitch_deviation)
        road = road_image(image, self._camera, assumed)
        medians, horizon = _grown_medians(road, self._camera)
        if medians.rows[0] > horizon:
            raise CannotTellError("the region holds no sky: no fog, or fog that the method does not see")
        inflection = _inflection_row(medians)
        if inflection <= horizon:
            raise CannotTellError("the row of the largest change lies above the horizon")
        first = 2.0 * (inflection - horizon) / self._camera.row_distance
        extinction = _optimised(medians, horizon, inflection, first, self._camera)
        # 20 rows place an inflection no better than to a quarter of them.
        deviation = 2.0 / self._camera.row_distance * 0.25 * ROWS_APART
        return self._estimate(extinction, deviation, horizon, first_extinction=first)

    def _estimate(self, extinction: float, deviation: float, horizon: float, **more: float) -> Estimate:
        inflection = horizon + 0.5 * extinction * self._camera.row_distance
        found = {"horizon_row": horizon, "inflection_row": inflection, **more}
        return Estimate(self.method, extinction, deviation, diagnostics=found)


@dataclass(frozen=True, slots=True)
class _Medians:
    """Medians of the region's rows from the top down; rows of the whole image."""

    rows: NDArray[np.float64]
    luminance: NDArray[np.float64]


def _grown_medians(road: RoadImage, camera: Camera) -> tuple[_Medians, float]:
    """Row medians of the region, and the row of the horizon."""
    blurred = smoothed(road.luminance)
    edges = edge_map(blurred, np.zeros(blurred.shape[0], np.float32))
    region = grow_region(blurred, edges.pixels, constant_limits(blurred.shape[0], STEP, STEP, FROM_MEDIAN))
    rows = region_medians(road.luminance, region)
    region[np.abs(road.luminance - rows.luminance[:, None]) > FROM_MEDIAN] = 0
    rows = region_medians(road.luminance, region)
    seen = rows.number > 0
    if int(seen.sum()) <= ROWS_APART:
        raise CannotTellError("the region grows over fewer rows than the method compares")
    medians = _Medians((np.flatnonzero(seen) + road.first_row).astype(np.float64), rows.luminance[seen])
    below = math.ceil(camera.horizon_row) - road.first_row + 1
    point = published_vanishing_point(hough_lines(edges.pixels, below, math.radians(1.0)))
    agrees = (
        point is not None and abs(point.row + road.first_row - camera.horizon_row) <= DISAGREEMENT * camera.focal_length
    )
    return medians, point.row + road.first_row if point is not None and agrees else camera.horizon_row


def _inflection_row(medians: _Medians) -> float:
    """Middle of the 20 rows over which the medians change most."""
    change = np.abs(medians.luminance[ROWS_APART:] - medians.luminance[:-ROWS_APART])
    best = int(np.argmax(change))
    return 0.5 * float(medians.rows[best] + medians.rows[best + ROWS_APART])


def _optimised(medians: _Medians, horizon: float, inflection: float, first: float, camera: Camera) -> float:
    """Extinction within k0 ± 0.01 that fits best, R and A being the medians of bottom and top (section 4.2.4)."""
    below = medians.rows - horizon
    used = (below > 0) & (medians.rows <= inflection + BELOW_INFLECTION)
    distance = path_lengths(below[used], camera.row_distance, np.ones(int(used.sum())))
    tried = np.linspace(max(first - SEARCH, 1e-5), first + SEARCH, SEARCH_STEPS)
    airlight, road = float(medians.luminance[0]), float(medians.luminance[-1])
    model = koschmieder(tried[:, None], road, airlight, distance)
    return float(tried[int(np.argmin(((model - medians.luminance[used]) ** 2).sum(axis=1)))])
