"""Fog and its class from the road's luminance in three frames (Zhu & Song 2015)."""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import matrix_product
from fogsim.core.parameters import Range, checked_parameters
from fogsim.estimators.image_check import ObservationCheck
from fogsim.estimators.repairs import chosen
from fogsim.estimators.zhu2015_road import SeenRoad, Zhu2015Repair, inflection_rows, seen_road, steepest_fog
from fogsim.values.camera import Camera
from fogsim.values.estimate import Estimate, FogCategory, fog_category
from fogsim.values.observation import Observation
from fogsim.vision.day.confirmation import Confirmation
from fogsim.vision.day.day_fit import free_road
from fogsim.vision.lines.horizon import (
    PITCH_DEVIATION,
    SCALE_DEVIATION,
    CannotTellError,
    PitchDeviation,
    ScaleDeviation,
    calibrated_horizon,
)

FRAMES = 3
"""Frames whose inflections are averaged, and equal classes that make a state."""

_STALE = 2.0
"""Age beyond which an earlier frame is not averaged [s]: a gap, or images taken one by one."""

GROWTH, GROWTH_SHARE = 2.0, 0.8
"""G_max of the published growth [linear grey levels], of least mean error in the last table of `fogsim reproduce
zhu2015`, and ρ, which changes nothing there [-]; the paper prints neither."""


def zhu_category(visibility: float) -> FogCategory:
    """Class of a visibility by zhu2015, table 1: no fog from 1000 m, low from 300 m, moderate from 100 m, else dense.

    Takes `visibility` [m].
    """
    category = fog_category(visibility)
    return FogCategory.DENSE if category is FogCategory.VERY_DENSE else category


def weighted_row(rows: NDArray[np.float64]) -> float:
    """Weighted average of rows by how often each occurs (zhu2015 section 3.4).

    The largest and the smallest are dropped, mean and median of the rest are added to it, and every value counts by its
    frequency; as values come one by one, a value that occurs n times has n² of the say.

    Takes `rows` (n,) [px].
    """
    kept = np.sort(rows)[1:-1] if rows.size > 2 else rows
    data = np.concatenate([kept, [kept.mean(), np.median(kept)]])
    _, where, count = np.unique(data, return_inverse=True, return_counts=True)
    weight = count[where] / data.size
    return float(matrix_product(weight, data)) / float(weight.sum())


@dataclass(frozen=True, slots=True)
class _Reading:
    """What one frame adds: rows of inflections below its horizon [px], and the deviation of k by them [1/m]."""

    rows: NDArray[np.float64]
    deviation: float
    time: float  # [s]


@checked_parameters
class Zhu2015:
    """Classes of fog from three frames (Zhu & Song 2015).

    Canny's edges, the longest lane lines left and right by a Hough transform of limited angle, the horizon at their
    intersection, a region grown from the road's bottom row, the inflection of its luminance averaged over three frames
    (weights by frequency, the extremes dropped), V = 3 λ / (2 (v_i − v_h)), four classes, and a state that changes
    after three equal ones.

    As published the region grows between the two lines (section 4), and where its columns end is the inflection, which
    cannot work: the columns next to the lane's middle end at the lines far below the inflection, so that with any G_max
    all air is thick fog. A region over the whole image grows beyond the horizon in dense fog ("no fog"), for the road
    fades into the sky without an edge, and stops too low in thin fog, which is steeper from row to row (`fogsim
    reproduce zhu2015`). What the corrected form (the default) does instead is listed in `Zhu2015Repair`, and can be
    switched one by one. Further
    errors of the paper: eq. 4 lacks the squares in its Gaussian, eqs. 13 and 14 contradict each other (13's sign of θ
    holds for a camera that looks up), eqs. 18 to 20 have v₀ for v_h and e^(−k·−kλ/…) for e^(−kλ/(v − v_h)), and the
    bound on ρ in section 3.2 is the whole diagonal of what is looked at, which limits nothing. The angle that is
    limited to 10° … 170° is here that of the line to the rows, as the paper words it; its eq. 7 has the normal's, by
    which upright lines would go and the horizon stay.

    Where the lines do not meet the calibration gives the horizon, and an image that shows no road by day is refused, in
    either form. Daytime, flat and straight road, road darker than the airlight.

    Parameters
    ----------
    camera : Camera
        The assumed calibration.
    as_published : bool
        Make no repairs: the end of the region between the lane lines is the inflection, whole Hough cells are lines.
    repairs : {'all', 'none'} or list of str
        Which of the repairs are made.
    growth : float
        G_max, the largest step of luminance between rows, as published [linear grey levels]; the paper names none.
    growth_share : float
        ρ < 1 of eq. 10, as published [-].
    pitch_deviation : float
        Standard deviation of the true pitch about the assumed one [rad].
    scale_deviation : float
        Relative standard deviation of focal length × mount height, with which distances on the road go [-].

    Raises
    ------
    InputError
        If a parameter is out of range.
    """

    method = "zhu2015"

    def __init__(
        self,
        camera: Camera,
        *,
        as_published: bool = False,
        repairs: Literal["all", "none"] | Sequence[Zhu2015Repair] = "all",
        growth: Annotated[float, Range(0.0, 255.0)] = GROWTH,
        growth_share: Annotated[float, Range(0.0, 1.0)] = GROWTH_SHARE,
        pitch_deviation: PitchDeviation = PITCH_DEVIATION,
        scale_deviation: ScaleDeviation = SCALE_DEVIATION,
    ) -> None:
        self._camera, self._check = camera, ObservationCheck(camera)
        self._repairs = chosen(Zhu2015Repair, repairs, as_published=as_published)
        self._growth = (growth, growth_share)
        self._pitch_deviation = pitch_deviation
        self._confirmation = Confirmation(camera, calibrated_horizon(camera, pitch_deviation), scale_deviation)
        self._readings: deque[_Reading] = deque(maxlen=FRAMES)
        self._classes: deque[FogCategory] = deque(maxlen=FRAMES)
        self._state: FogCategory | None = None

    def reset(self) -> None:
        """Forget all frames and the state."""
        self._check.reset()
        self._confirmation.reset()
        self._readings.clear()
        self._classes.clear()
        self._state = None

    def update(self, observation: Observation) -> Estimate:
        """Estimate the fog from one image and the two before it, as far as they are at most 2 s old.

        Parameters
        ----------
        observation : Observation
            Its image is used, and the range of its lead vehicle to leave that out.

        Returns
        -------
        Estimate
            Diagnostics: ``class`` of this estimate and ``state`` after three equal ones (`FogCategory` without "very
            dense"; None before), ``horizon_row`` and ``inflection_row`` [px], ``vanishing_point`` (column, row) [px]
            or None, ``frames`` averaged; or ``reason``.

        Raises
        ------
        InputError
            If camera, image or time do not fit (see `fogsim.estimators.image_check`).
        """
        image = self._check.kernel_image(observation)
        diagnostics: dict[str, object] = {"state": self._state, "horizon_row": self._camera.horizon_row}
        try:
            road = seen_road(image, self._camera, self._pitch_deviation, self._growth, self._repairs, observation.lead)
            diagnostics |= {"horizon_row": road.horizon.row, "vanishing_point": road.vanishing_point}
            while self._readings and observation.time - self._readings[0].time > _STALE:
                self._readings.popleft()
            self._readings.append(self._reading(road, observation.time))
        except CannotTellError as reason:
            self._readings.clear()
            self._classes.clear()
            return Estimate.invalid(self.method, str(reason), **diagnostics)
        extinction, deviation = self._averaged()
        inflection = road.horizon.row + 0.5 * extinction * self._camera.row_distance
        diagnostics |= {"inflection_row": inflection, "frames": len(self._readings)}
        own = Estimate(self.method, extinction, deviation, diagnostics=diagnostics)
        if Zhu2015Repair.CONFIRMED in self._repairs:
            own = self._confirmation.of(own, image, free_road(observation.lead), observation.time)
        return self._classified(own) if own.valid else own

    def _reading(self, road: SeenRoad, time: float) -> _Reading:
        per_row = 2.0 / self._camera.row_distance
        if Zhu2015Repair.STEEPEST_ROW in self._repairs:
            found = steepest_fog(road, self._camera, self._repairs)
            return _Reading(np.array([found.extinction / per_row]), found.deviation, time)
        rows = inflection_rows(road)
        # A region's end is known to a row at best.
        return _Reading(rows, per_row * math.hypot(1.0, float(rows.std())), time)

    def _averaged(self) -> tuple[float, float]:
        """Extinction of the last frames and its standard deviation [1/m]."""
        rows = np.concatenate([reading.rows for reading in self._readings])
        extinction = 2.0 / self._camera.row_distance * max(weighted_row(rows), 0.0)
        # The same camera over the same road: what errs does so alike in all frames.
        return extinction, float(np.median([reading.deviation for reading in self._readings]))

    def _classified(self, estimate: Estimate) -> Estimate:
        found = zhu_category(estimate.visibility)
        self._classes.append(found)
        if len(self._classes) == FRAMES and len(set(self._classes)) == 1:
            self._state = found
        return replace(estimate, diagnostics={**estimate.diagnostics, "class": found, "state": self._state})
