"""Rough and accurate visibility combined over time and way (Huang 2015, section 5.2)."""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from fogsim.core.parameters import Range, checked_parameters
from fogsim.errors import InputError
from fogsim.estimators.huang2015_lead import Huang2015Lead
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
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values.camera import Camera
from fogsim.values.estimate import Estimate
from fogsim.values.observation import LeadMeasurement, Observation
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
from fogsim.vision.region.law import (
    check_law,
    detection_limit,
    extinction_deviation,
    fog_or_clear,
    is_clear,
    seen_up_to,
)
from fogsim.vision.region.profile import RoadCurve
from fogsim.vision.region.road_image import road_image

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


_MEASUREMENTS = 200
"""Measurements that are remembered."""

_LEAST_WEIGHT = 1e-3
"""Weight below which a measurement is forgotten [-]."""

_LEAST_EXTINCTION = OPTICAL_DEPTH_AT_VISIBILITY / 10_000.0
"""Extinction that "no fog" is averaged as [1/m]: that of 10 km."""


@dataclass(frozen=True, slots=True)
class Measurement:
    """One estimate, when and where."""

    # extinction, deviation: k and its standard deviation [1/m]
    extinction: float
    deviation: float
    time: float  # [s]
    way: float  # Driven since the start [m]
    track: int  # Which vehicle ahead it is from; 0 for the road
    common: float = 0.0  # Standard deviation of ln k that all frames have in common [-]


def decay(measurement: Measurement, time: float, way: float, time_scale: float, way_scale: float) -> float:
    """Weight of a measurement later and farther on, e^(−d_s/t_s) e^(−d_t/t_t) (section 5.2) [-].

    Takes `time`, `way` [s], [m], `time_scale`, `way_scale` [s], [m].
    """
    return math.exp(-abs(time - measurement.time) / time_scale - abs(way - measurement.way) / way_scale)


def mixture(values: Sequence[float], weights: Sequence[float], within: Sequence[float]) -> tuple[float, float]:
    """Mean and standard deviation of a mixture of normal distributions.

    Eqs. 5.1 and 5.2 with the square that 5.2 lacks, weighted, and with the components' own variances.
    """
    total = math.fsum(weights)
    mean = math.fsum(w * v for w, v in zip(weights, values, strict=True)) / total
    parts = zip(weights, values, within, strict=True)
    return mean, math.sqrt(math.fsum(w * ((v - mean) ** 2 + s * s) for w, v, s in parts) / total)


@checked_parameters
class Huang2015:
    """Rough and accurate estimates as one, decaying over time and way (Huang 2015, section 5.2).

    Every frame's road (`Huang2015Rough`) and every tracked vehicle (`Huang2015Lead`, its latest estimate) is a
    measurement; its weight falls as e^(−d_s/t_s − d_t/t_t).

    As published all measurements count alike and visibilities are averaged. Corrected, ln k is, weighted by the
    inverse variances too: a vehicle followed over 60 m says more than a frame of road. The deviation is the mixture's,
    which does not shrink with the number of frames, because their errors are the same road's and the same camera's, and
    grows as the latest measurement's weight falls.

    Parameters
    ----------
    camera : Camera
        The assumed calibration.
    as_published : bool
        Both methods and their combination as in the thesis.
    time_scale, way_scale : float
        t_t [s] and t_s [m]; the thesis gives none.
    setback : float
        From the own front bumper, where ranges begin, back to the camera [m].
    blur : float
        Standard deviation of the lens' blur next to the pixels' own size [px].
    range_from : {"sensor", "camera"}
        Where ranges of the vehicle ahead are from (see `Huang2015Lead`).
    vehicle_width : float, optional
        Width of the vehicle for ranges from the camera, where it is known [m].
    pitch_deviation : float
        Standard deviation of the true pitch about the assumed one [rad].
    scale_deviation : float
        Relative standard deviation of focal length × mount height, with which distances on the road go [-].
    """

    method = "huang2015"

    def __init__(
        self,
        camera: Camera,
        *,
        as_published: bool = False,
        time_scale: Annotated[float, Range(0.01, 1e9, "s")] = 10.0,
        way_scale: Annotated[float, Range(0.01, 1e9, "m")] = 200.0,
        setback: Annotated[float, Range(0.0, 10.0, "m")] = 0.0,
        blur: Annotated[float, Range(0.0, 10.0, "px")] = 0.0,
        range_from: Literal["sensor", "camera"] = "sensor",
        vehicle_width: Annotated[float, Range(0.5, 4.0, "m")] | None = None,
        pitch_deviation: PitchDeviation = PITCH_DEVIATION,
        scale_deviation: ScaleDeviation = SCALE_DEVIATION,
    ) -> None:
        self._check = ObservationCheck(camera)
        self._rough = Huang2015Rough(
            camera, as_published=as_published, pitch_deviation=pitch_deviation, scale_deviation=scale_deviation
        )
        self._lead = Huang2015Lead(
            camera,
            as_published=as_published,
            setback=setback,
            blur=blur,
            range_from=range_from,
            vehicle_width=vehicle_width,
            pitch_deviation=pitch_deviation,
        )
        self._as_published = as_published
        self._scales = (time_scale, way_scale)
        self.reset()

    def reset(self) -> None:
        """Forget all measurements and the vehicle ahead."""
        self._check.reset()
        self._rough.reset()
        self._lead.reset()
        self._measurements: deque[Measurement] = deque(maxlen=_MEASUREMENTS)
        self._time: float | None = None
        self._way = 0.0

    def update(self, observation: Observation) -> Estimate:
        """Estimate the fog from this and earlier frames.

        Parameters
        ----------
        observation : Observation
            Image, time, own speed and lead vehicle are used. Bare images have no time, and nothing decays.

        Returns
        -------
        Estimate
            Diagnostics: ``rough`` and ``accurate``, the `Estimate` of either method for this frame, ``measurements``,
            how many are combined, and those of the accurate one's ``confidence_distances`` and ``confidence`` where it
            is valid; or ``reason``.

        Raises
        ------
        InputError
            If camera, image or time do not fit (see `fogsim.estimators.image_check`), the range is NaN, or the
            speed is not finite.
        """
        self._check.image_of(observation)
        self._advance(observation)
        rough, accurate = self._rough.update(observation), self._lead.update(observation)
        self._remember(rough, 0)
        self._remember(accurate, self._lead.tracks)
        diagnostics: dict[str, object] = {"rough": rough, "accurate": accurate}
        diagnostics |= {key: accurate.diagnostics[key] for key in accurate.diagnostics if key.startswith("confidence")}
        if "horizon_row" in rough.diagnostics:
            diagnostics["horizon_row"] = rough.diagnostics["horizon_row"]
        known = [(m, self._weight(m)) for m in self._measurements]
        known = [(m, weight) for m, weight in known if weight >= _LEAST_WEIGHT]
        diagnostics["measurements"] = len(known)
        if not known:
            return Estimate.invalid(self.method, str(rough.diagnostics.get("reason", "nothing seen")), **diagnostics)
        extinction, deviation = _published(known) if self._as_published else _combined(known)
        common = math.fsum(m.common * weight for m, weight in known) / math.fsum(weight for _, weight in known)
        return Estimate(self.method, extinction, deviation, diagnostics=diagnostics, common_deviation=common)

    def _advance(self, observation: Observation) -> None:
        time, speed = observation.time, observation.speed
        if not math.isfinite(speed):
            raise InputError(f"an observation's speed [m/s] must be finite, got {speed!r}")
        if self._time is not None:
            self._way += max(speed, 0.0) * max(time - self._time, 0.0)
        self._time = time

    def _weight(self, measurement: Measurement) -> float:
        return decay(measurement, self._time or 0.0, self._way, *self._scales)

    def _remember(self, estimate: Estimate, track: int) -> None:
        if not estimate.valid:
            return
        if track:
            # What a vehicle says is refined with every picture: one measurement a vehicle.
            kept = [m for m in self._measurements if m.track != track]
            self._measurements = deque(kept, maxlen=_MEASUREMENTS)
        own = (estimate.extinction, estimate.standard_deviation, self._time or 0.0, self._way)
        self._measurements.append(Measurement(*own, track, estimate.common_deviation))


def _published(known: list[tuple[Measurement, float]]) -> tuple[float, float]:
    """Weighted mean of visibilities, as an extinction and its deviation [1/m]."""
    seen = [OPTICAL_DEPTH_AT_VISIBILITY / max(m.extinction, _LEAST_EXTINCTION) for m, _ in known]
    mean, spread = mixture(seen, [weight for _, weight in known], [0.0] * len(known))
    extinction = OPTICAL_DEPTH_AT_VISIBILITY / mean
    # One measurement has no spread; its own deviation is all that is known then.
    own = min(m.deviation for m, _ in known)
    return extinction, max(extinction * spread / mean, own)


def _combined(known: list[tuple[Measurement, float]]) -> tuple[float, float]:
    """Mixture in ln k, as an extinction and its deviation [1/m]."""
    logs = [math.log(max(m.extinction, _LEAST_EXTINCTION)) for m, _ in known]
    relative = [m.deviation / max(m.extinction, _LEAST_EXTINCTION) for m, _ in known]
    weights = [weight / max(sd, 1e-3) ** 2 for (_, weight), sd in zip(known, relative, strict=True)]
    mean, deviation = mixture(logs, weights, [min(sd, 3.0) for sd in relative])
    extinction = math.exp(mean)
    deviation /= math.sqrt(max(weight for _, weight in known))
    if extinction <= 1.5 * _LEAST_EXTINCTION:
        return 0.0, max(m.deviation for m, _ in known)
    return extinction, extinction * deviation
