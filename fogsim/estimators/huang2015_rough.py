"""Rough visibility from the road's luminance in one frame (Huang 2015, section 4.2)."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fogsim.core.parameters import checked_parameters
from fogsim.estimators.huang2015_medians import (
    BELOW_INFLECTION,
    ROWS_APART,
    Huang2015Repair,
    MedianRows,
    first_extinctions,
    grown_medians,
    optimised_extinctions,
)
from fogsim.estimators.image_check import ObservationCheck
from fogsim.estimators.repairs import chosen
from fogsim.values.camera import Camera
from fogsim.values.estimate import Estimate
from fogsim.values.observation import LeadMeasurement, Observation
from fogsim.vision.day.confirmation import Confirmation
from fogsim.vision.day.day_fit import free_road
from fogsim.vision.lines.horizon import (
    PITCH_DEVIATION,
    SCALE_DEVIATION,
    PitchDeviation,
    ScaleDeviation,
    calibrated_horizon,
)
from fogsim.vision.region.curve_checks import check_law, detection_limit, fog_or_clear, is_clear, seen_up_to
from fogsim.vision.region.law import extinction_deviation
from fogsim.vision.region.profile import RoadCurve
from fogsim.vision.region.road_image import CannotTellError, road_image

__all__ = ["BELOW_INFLECTION", "ROWS_APART", "Huang2015Repair", "Huang2015Rough"]


@checked_parameters
class Huang2015Rough:
    """Inflection of the grown road's row medians, then a search about it (Huang 2015, section 4.2).

    A region grown from the bottom row under four constraints, the median of each of its rows, the row where it
    changes most over 20 rows, the horizon from the two longest lane lines if it agrees with the calibration's, and of
    the extinctions k0 ± 0.01 1/m about that of the inflection the one that fits the medians best, from the horizon to
    50 rows below the inflection, with A the median of the region's top row and R that of its bottom row.

    The thesis' steps of 3 grey levels let no fog thinner than some 150 m grow; 20 rows for a difference are more than
    lie between horizon and inflection beyond some 300 m; ± 0.01 1/m keeps the inflection's own error in dense fog; and
    the bottom row is fogged. What the corrected form (the default) does instead is listed in `Huang2015Repair`, and can
    be switched one by one. The thesis' eq. 4.11 is wrong by a factor of 10 (with α = 1.4 · 400 px and H = 1 m, λ is
    560 px·m and the inflection at 500 m lies 1.7 px below the horizon, not 16.8). Constraint 4 is read row by row: the
    median of the whole region would cut the fog's own curve to 20 grey levels.

    Daytime, flat and straight road, road darker than the airlight.

    Parameters
    ----------
    camera : Camera
        The assumed calibration.
    as_published : bool
        Make no repairs: the thesis' own constraints, 20-row differences and search.
    repairs : {'all', 'none'} or list of str
        Which of the repairs are made.
    pitch_deviation : float
        Standard deviation of the true pitch about the assumed one [rad].
    scale_deviation : float
        Relative standard deviation of focal length × mount height, with which distances on the road go [-].

    Raises
    ------
    InputError
        If a parameter is out of range.
    """

    method = "huang2015_rough"

    def __init__(
        self,
        camera: Camera,
        *,
        as_published: bool = False,
        repairs: Literal["all", "none"] | Sequence[Huang2015Repair] = "all",
        pitch_deviation: PitchDeviation = PITCH_DEVIATION,
        scale_deviation: ScaleDeviation = SCALE_DEVIATION,
    ) -> None:
        self._camera, self._check = camera, ObservationCheck(camera)
        self._repairs = chosen(Huang2015Repair, repairs, as_published=as_published)
        self._assumed = calibrated_horizon(camera, pitch_deviation)
        self._confirmation = Confirmation(camera, self._assumed, scale_deviation)

    def reset(self) -> None:
        """Let time start again."""
        self._check.reset()
        self._confirmation.reset()

    def update(self, observation: Observation) -> Estimate:
        """Estimate the fog from one image.

        Parameters
        ----------
        observation : Observation
            Its image is used, and the range of its lead vehicle to leave that out.

        Returns
        -------
        Estimate
            Diagnostics: ``horizon_row`` and ``inflection_row`` [px], ``first_extinction``, that before the search
            [1/m], ``airlight`` and ``road`` [linear grey levels]; or ``reason``.

        Raises
        ------
        InputError
            If camera, image or time do not fit (see `fogsim.estimators.image_check`).
        """
        image = self._check.kernel_image(observation)
        try:
            own = self._read(image, observation.lead)
        except CannotTellError as reason:
            return Estimate.invalid(self.method, str(reason), horizon_row=self._camera.horizon_row)
        if Huang2015Repair.CONFIRMED not in self._repairs:
            return own
        return self._confirmation.of(own, image, free_road(observation.lead), observation.time)

    def _read(self, image: NDArray[np.uint8] | NDArray[np.uint16], lead: LeadMeasurement | None) -> Estimate:
        linear = Huang2015Repair.LINEAR_LUMINANCE in self._repairs
        road = road_image(image, self._camera, self._assumed, linear=linear)
        medians = grown_medians(road, self._camera, self._assumed, self._repairs, lead)
        curve, apart = medians.curve, medians.horizon.standard_deviation
        if Huang2015Repair.GROWTH_BY_FOG in self._repairs:
            top = seen_up_to(curve)
            if top > -1.0 and is_clear(curve, road):
                limit = detection_limit(top, apart, curve.row_distance)
                return self._estimate(0.0, limit, medians)
        elif medians.top > 0.0:
            raise CannotTellError("the region holds no sky: no fog, or fog that the method does not see")
        light = curve.luminance[:, None]
        first = float(first_extinctions(curve, light, self._repairs)[0])
        if not first > 0.0:
            raise CannotTellError("the row of the largest change lies above the horizon")
        extinction = float(optimised_extinctions(curve, light, np.array([first]), self._repairs)[0])
        if Huang2015Repair.SCALED_ROWS not in self._repairs:
            # 20 rows place an inflection no better than to a quarter of them.
            deviation = 2.0 / curve.row_distance * 0.25 * ROWS_APART
            return self._estimate(extinction, deviation, medians, first_extinction=first)
        airlight, dark = check_law(curve, extinction, road)
        deviation = extinction_deviation(curve, extinction, self._extinctions, apart)
        found = {"first_extinction": first, "airlight": airlight, "road": dark}
        return self._estimate(*fog_or_clear(extinction, deviation), medians, **found)

    def _extinctions(self, curve: RoadCurve, luminance: NDArray[np.float64]) -> NDArray[np.float64]:
        first = first_extinctions(curve, luminance, self._repairs)
        return optimised_extinctions(curve, luminance, first, self._repairs)

    def _estimate(self, extinction: float, deviation: float, medians: MedianRows, **more: float) -> Estimate:
        row = medians.horizon.row
        found = {"horizon_row": row, "inflection_row": row + 0.5 * extinction * self._camera.row_distance, **more}
        return Estimate(self.method, extinction, deviation, diagnostics=found)
