"""Fog from how the contrast of the tracked vehicle ahead falls with its range."""

import math
import operator
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.core.parameters import Range, checked_parameters
from fogsim.estimators.image_check import ObservationCheck
from fogsim.estimators.lead_contrast_track import DENSEST, SPACING, ContrastTrack, RearDetection
from fogsim.estimators.tracked_vehicle import SmoothedRanges
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values.camera import Camera
from fogsim.values.estimate import Estimate
from fogsim.values.observation import LeadMeasurement, Observation
from fogsim.vision.day.confirmation import without_far_objects
from fogsim.vision.light.daylight import CannotTellError
from fogsim.vision.light.medians import median
from fogsim.vision.lines.horizon import PITCH_DEVIATION, PitchDeviation, calibrated_horizon
from fogsim.vision.strips.airlight_slopes import USUAL_EXTINCTION
from fogsim.vision.vehicle.airlight import RoadFall
from fogsim.vision.vehicle.contrast_ratio import HALF_BODY, LARGE
from fogsim.vision.vehicle.vehicle_crop import daytime_crop

Floats = NDArray[np.float64]

_STEPS, _HUBER = 12, 2.5
"""Gauss–Newton steps, and residual beyond which a range counts linearly, in standard deviations [-]."""


@dataclass(frozen=True, slots=True)
class DecayFit:
    """Decay c = C e^(−kd) + o."""

    # extinction, deviation: k and its standard deviation [1/m]
    extinction: float
    deviation: float
    contrast: float  # C [-]
    misfit: float  # Mean square of the standardised residuals [-]


def fit_decay(distance: Floats, contrast: Floats, noise: Floats, relative: float, offset: float) -> DecayFit | None:
    """Fit Duntley's law to contrasts at several ranges (Gauss–Newton, weights by the model's own values).

    Fitted in the contrasts themselves and not in their logarithms, which noise would bias and make undefined.

    Returns None if there are fewer than three ranges or no contrast. Takes `distance`, `contrast`, `noise` (n,) [m].
    """
    if distance.size < 3:
        return None
    k, deviation, size, misfit = _decay(distance, contrast, noise, relative, offset)
    return None if size == 0.0 else DecayFit(k, deviation, size, misfit)


@kernel
def _decay(
    distance: Floats, contrast: Floats, noise: Floats, relative: float, offset: float
) -> tuple[float, float, float, float]:
    """The fields of `DecayFit`; all 0 without contrast."""
    if np.abs(contrast).max() <= 0.0:
        return 0.0, 0.0, 0.0, 0.0
    near = distance.mean()
    size, k = _first_guess(distance - near, contrast, noise)
    size, k, variance, misfit = _descended(distance - near, contrast, noise, relative, offset, size, k)
    misfit /= max(distance.size - 2, 1)
    return k, math.sqrt(max(variance, 0.0) * max(misfit, 1.0)), size * math.exp(min(k * near, 50.0)), misfit


@kernel
def _descended(
    distance: Floats, contrast: Floats, noise: Floats, relative: float, offset: float, size: float, k: float
) -> tuple[float, float, float, float]:
    """Size, extinction, the variance of the latter, and the sum of squared standardised residuals."""
    o, variance, misfit = 0.0, 0.0, 0.0
    for _ in range(_STEPS):
        # Normal equations in the order of size, offset and extinction; the diagonal keeps them regular.
        aa, ab, ac, bb, bc, cc = 1e-9, 0.0, 0.0, 1.0 / offset**2, 0.0, 1e-3
        ra, rb, rc, misfit = 0.0, -o / offset**2, 0.0, 0.0
        for i in range(distance.size):
            fall = math.exp(-k * distance[i])
            residual = contrast[i] - size * fall - o
            weight = 1.0 / (noise[i] ** 2 + (relative * size * fall) ** 2)
            # Ranges at which something else was seen count less (Huber).
            weight *= min(1.0, _HUBER / max(abs(residual) * math.sqrt(weight), 1e-9))
            slope = -size * distance[i] * fall
            aa, ab, ac = aa + weight * fall * fall, ab + weight * fall, ac + weight * fall * slope
            bb, bc, cc = bb + weight, bc + weight * slope, cc + weight * slope * slope
            ra, rb, rc = ra + weight * fall * residual, rb + weight * residual, rc + weight * slope * residual
            misfit += weight * residual * residual
        # Elimination in that order leaves what is known of the extinction last.
        by_a, by_c = ab / aa, ac / aa
        bb, bc, rb = bb - by_a * ab, bc - by_a * ac, rb - by_a * ra
        cc, rc = cc - by_c * ac - bc * bc / bb, rc - by_c * ra - bc * rb / bb
        variance = 1.0 / cc
        step = rc * variance
        lifted = (rb - bc * step) / bb
        size, o = size + (ra - ab * lifted - ac * step) / aa, o + lifted
        most = 0.5 * abs(k) + 2e-3
        k += min(max(step, -most), most)
    return size, k, variance, misfit


@kernel
def _first_guess(distance: Floats, contrast: Floats, noise: Floats) -> tuple[float, float]:
    """Straight line through the logarithms of what stands out of the noise."""
    sign = 1.0 if contrast[np.argmax(np.abs(contrast))] > 0 else -1.0
    clear = sign * contrast > 3.0 * noise
    if clear.sum() < 2 or distance[clear].max() <= distance[clear].min():
        return float(contrast.mean()), 0.0
    x, y = distance[clear], np.log(sign * contrast[clear])
    middle, level = x.mean(), y.mean()
    slope = ((x - middle) * (y - level)).sum() / ((x - middle) ** 2).sum()
    return sign * math.exp(min(level - slope * middle, 5.0)), -slope


_MIN_SAMPLES = 4
"""Fewest ranges for a fit."""

_MIN_ALIKE = 3
"""Fewest of them at which the vehicle was surely seen; it may have faded at the others."""

_REGISTRATION = 0.005
"""Relative deviation of a contrast by what is not noise: place, shading [-]."""

_SHAPE, _BRIGHT_SHAPE = 0.022, 0.03
"""Relative deviation of the farthest contrast from the nearest by what size and aspect do: a slope's error [-]. The
latter is that of the luminance, which matters as much more as a vehicle is brighter than its contrast to the sky."""

_SMOOTHED = 0.008
"""Relative deviation of k by what neighbouring detections share: errors of smoothed ranges, places in noise [-]."""

_LARGE_SHAPE = 0.025
"""That deviation of a lorry or a bus: one sees below it, and differently far as it moves away [-]."""

_OWN_CONTRAST, _DISAGREEMENT = (math.log(0.7), 0.35), 2.0
"""Logarithm of a vehicle's contrast without fog, by its dark parts, with its standard deviation [-]; and deviations of
k's difference beyond which that contrast and its decrease with range exclude each other."""

_AIRLIGHT_DEVIATION = 0.002
"""Relative deviation of the airlight behind the vehicle from the sky above it [-]."""

_RECKONED_LEVEL = 0.4
"""Deviation of its level at the horizon where that is not seen but reckoned, over that of its darkening down to the
nearest rear's foot [-]: both go by how much the sky brightens upward."""

_CLIPPED_AIRLIGHT_DEVIATION = 0.03
"""The same where some of the sky is clipped [-]."""

_JUMP, _SURPRISE = 15.0, 5.0
"""Changes of range, as such and against what the relative speed says, that together mean another vehicle [m]."""

_MAX_MISFIT = 6.0
"""Mean square of the standardised residuals beyond which the contrast does not fall as Duntley's law has it [-]."""

_WORST = 0.4
"""Largest deviation of k relative to itself for an estimate of fog [-]."""

_SURELY = 2.5
"""Standard deviations by which the contrast must grow with the range for it to be no vehicle's [-]."""

_LEAST_EXTINCTION = 0.003
"""Least extinction with which the airlight before the vehicle is reckoned [1/m]."""

_CLEAR = OPTICAL_DEPTH_AT_VISIBILITY / 500.0
"""Extinction that an unsure estimate must surely be below to say "little fog" [1/m]."""


@checked_parameters
class LeadContrast:
    """Mean contrast of the tracked vehicle ahead to the sky against its range (Duntley's law, c = C e^(−kd)).

    The range of the sensor says where to look; edges and symmetry show the rear, car or motorcycle, and from then on it
    is placed by its likeness to the nearest picture. A picture's contrast over that one's is a line through the
    airlight: dark parts weigh most, lamps that were lit since are left out, and as contrast is relative to the sky's
    luminance, exposure cancels. k is the rate at which it falls while the range changes: no flat road, no horizon and
    no reflectance enters. A constant error of the range, as by the setback, changes k by a few percent: images
    are then compared at sizes that are not quite the same.

    Own method, after the contrast of preceding vehicles in Mori et al. 2007. Daytime only. Remembers the track; another
    vehicle begins a new one. What does not look like the same vehicle at another range does not count.

    Parameters
    ----------
    camera : Camera
        The assumed calibration.
    setback : float
        Distance of the camera behind the front bumper, from which the range counts [m].
    range_deviation : float
        Standard deviation of the measured range [m].
    pitch_deviation : float
        Standard deviation of the true pitch about the assumed one [rad].
    window : float
        How long a detection counts [s].
    frames : int
        How many detections count at most.

    Raises
    ------
    InputError
        If a parameter is out of range.
    """

    method = "lead_contrast"

    def __init__(
        self,
        camera: Camera,
        *,
        setback: Annotated[float, Range(0.0, 10.0, "m")] = 1.7,
        range_deviation: Annotated[float, Range(0.0, 100.0, "m")] = 0.25,
        pitch_deviation: PitchDeviation = PITCH_DEVIATION,
        window: Annotated[float, Range(0.01, 1e6, "s")] = 60.0,
        frames: Annotated[int, Range(_MIN_SAMPLES, 10_000)] = 64,
    ) -> None:
        self._camera, self._setback = camera, setback
        self._horizon = calibrated_horizon(camera, pitch_deviation)
        self._check = ObservationCheck(camera)
        self._range_deviation, self._pitch_deviation = range_deviation, pitch_deviation
        self._window, self._frames = window, int(frames)
        self.reset()

    def reset(self) -> None:
        """Forget the track."""
        self._check.reset()
        self._forget()

    def _forget(self) -> None:
        self._ranges = SmoothedRanges(self._range_deviation)
        self._track = ContrastTrack(self._ranges, self._pitch_deviation, self._window, self._frames)
        self._last: tuple[float, LeadMeasurement] | None = None
        self._fitted: tuple[Floats, tuple[RearDetection, ...], DecayFit | None] = np.zeros(0), (), None

    def update(self, observation: Observation) -> Estimate:
        """Add one look at the vehicle ahead and estimate the fog from all of the track.

        Parameters
        ----------
        observation : Observation
            Its image, time and lead are used.

        Returns
        -------
        Estimate
            Diagnostics: ``lead_box`` (left, right, top, bottom) of what was looked at [px], ``distance`` and
            ``contrast`` (n,) of the track [m] and over the nearest [-], ``misfit`` [-]; or ``reason``.

        Raises
        ------
        InputError
            If camera, image or time do not fit (see `fogsim.estimators.image_check`).
        """
        image = self._check.kernel_image(observation)
        found: dict[str, object] = {"horizon_row": self._camera.horizon_row}
        lead, time = observation.lead, observation.time
        if lead is None or not (math.isfinite(lead.distance) and lead.distance >= 0):
            self._miss(time)
            return Estimate.invalid(self.method, "no vehicle ahead is tracked", **found)
        surprise = self._surprise(lead, time)
        self._last = (time, lead)
        reason, road = "", None
        try:
            number = self._ranges.add(time, lead)
            likely = float(self._ranges.smoothed([number], np.array([lead.distance]))[0])
            fit = self._fit(self._track.likely_distances())
            about = USUAL_EXTINCTION if fit is None else min(max(fit.extinction, _LEAST_EXTINCTION), DENSEST)
            self._track.relevel(about)
            crop = daytime_crop(image, self._camera, likely + self._setback, self._pitch_deviation, about)
            densest = math.inf if fit is None else max(fit.extinction + 2.0 * fit.deviation, 0.0)
            detection = self._track.look(crop, number, lead.distance, time, surprise=surprise, densest=densest)
            found["lead_box"], road = _box(detection), crop.road
        except CannotTellError as error:
            reason = str(error)
            self._miss(time)
        return without_far_objects(self._estimate(reason, road, found), image, self._camera, self._horizon)

    def _miss(self, time: float) -> None:
        if self._track.is_lost(time):
            self._forget()

    def _surprise(self, lead: LeadMeasurement, time: float) -> float:
        """How far the range is from where the same vehicle can be [m]; a certain other vehicle begins again."""
        if self._last is None:
            return 0.0
        before, earlier = self._last
        expected = earlier.distance + earlier.relative_speed * (time - before)
        jump, surprise = abs(lead.distance - earlier.distance), abs(lead.distance - expected)
        if jump > _JUMP and surprise > _SURPRISE:
            self._forget()
            return 0.0
        return min(jump, surprise)

    def _estimate(self, reason: str, road: RoadFall | None, found: dict[str, object]) -> Estimate:
        distance = self._track.likely_distances()
        found |= {"distance": distance, "contrast": np.array([s.contrast.ratio for s in self._track.detections])}
        fit = self._fit(distance)
        if reason or fit is None:
            return Estimate.invalid(self.method, reason or "the track is too short yet", **found)
        found["misfit"] = fit.misfit
        likely, spread = self._by_own_contrast()
        weight = spread**2 / (spread**2 + fit.deviation**2)
        extinction, deviation = likely + weight * (fit.extinction - likely), math.sqrt(weight) * fit.deviation
        if fit.misfit > _MAX_MISFIT or fit.extinction < -_SURELY * fit.deviation:
            reason = "the contrast does not fall with the range as Duntley's law has it"
        elif abs(fit.extinction - likely) > _DISAGREEMENT * math.hypot(fit.deviation, spread):
            reason = "the vehicle's contrast and its decrease with range disagree: the fog may be uneven"
        elif deviation > _WORST * extinction and extinction + 2.0 * deviation > _CLEAR:
            reason = "the range has not changed enough yet"
        elif road is not None and road.is_lit(extinction, deviation):
            reason = "lamps light the road: this is a daytime method"
        if reason:
            return Estimate.invalid(self.method, reason, **found)
        reach = float(distance.max()) + self._setback
        return Estimate(self.method, max(extinction, 0.0), deviation, diagnostics=found, reach=reach)

    def _by_own_contrast(self) -> tuple[float, float]:
        """Extinction before the vehicle by its contrast alone, and its standard deviation [1/m]."""
        nearest = min(self._track.detections, key=lambda one: one.depth)
        # The lever is the inverse of the contrast of the picture that all are compared with.
        depth = (self._track.reference or nearest).depth
        return (math.log(max(nearest.contrast.lever, 1e-9)) + _OWN_CONTRAST[0]) / depth, _OWN_CONTRAST[1] / depth

    def _fit(self, distance: Floats) -> DecayFit | None:
        """Fit to the track; most frames leave it as it was when the frame came."""
        track, (before, known, fit) = self._track.detections, self._fitted
        is_known = len(known) == len(track) and all(map(operator.is_, known, track))
        if not is_known or before.tobytes() != distance.tobytes():
            fit = self._fit_to(track, distance)
            self._fitted = distance, tuple(track), fit
        return fit

    def _fit_to(self, track: Sequence[RearDetection], distance: Floats) -> DecayFit | None:
        if len(track) < _MIN_SAMPLES or [one.alike for one in track].count(True) < _MIN_ALIKE:
            return None
        looks = [(one.contrast.ratio, one.contrast.deviation, one.contrast.lever) for one in track]
        contrast, noise, lever = np.array(looks).T.copy()
        clipped = True in [one.clipped for one in track]
        uneven = max([one.airlight_deviation for one in track])
        level = math.hypot(_AIRLIGHT_DEVIATION, _RECKONED_LEVEL * uneven)
        airlight = _CLIPPED_AIRLIGHT_DEVIATION if clipped else level
        usual = median(lever)
        offset = max(airlight * usual, 1e-6)
        fit = fit_decay(distance, contrast, noise, _REGISTRATION, offset)
        if fit is None:
            return None
        # Noise of the range acts as a relative noise of the contrast, k σ.
        relative = math.hypot(_REGISTRATION, fit.extinction * self._range_deviation)
        fit = fit_decay(distance, contrast, noise, relative, offset)
        if fit is None:
            return None
        certain = contrast**2 / (noise**2 + (relative * contrast) ** 2 + offset**2)
        # What is wrong of an uneven airlight's shape is so at the nearest range, and nearly nothing far away.
        shape = math.hypot(self._shape(fit.extinction, usual), uneven * usual)
        by_shape = shape / max(_span(distance, certain), SPACING)
        return replace(fit, deviation=math.hypot(fit.deviation, by_shape, _SMOOTHED * fit.extinction))

    def _shape(self, extinction: float, lever: float) -> float:
        """By how much size and aspect may change the farthest contrast, relative [-]."""
        depth = min([one.depth for one in self._track.detections])
        # What the lever would be without fog is over 1 by luminance over contrast.
        bright = max(lever * math.exp(-max(extinction, 0.0) * depth) - 1.0, 0.0)
        large = self._track.detections[0].picture.width >= LARGE
        return math.hypot(_LARGE_SHAPE if large else _SHAPE, _BRIGHT_SHAPE * bright)


def _span(distance: NDArray[np.float64], weight: NDArray[np.float64]) -> float:
    """Change of range over which the contrast is known: that of an even density of the same spread [m]."""
    mean = float((weight * distance).sum() / weight.sum())
    return math.sqrt(12.0 * float((weight * (distance - mean) ** 2).sum() / weight.sum()))


def _box(detection: RearDetection) -> tuple[int, int, int, int]:
    """Left, right, top and bottom of the part of a rear that is compared [px]."""
    window, scale = detection.box, detection.picture.scale
    low, high = detection.picture.heights
    left, right = window.column - HALF_BODY * window.width, window.column + HALF_BODY * window.width
    return round(left), round(right), round(window.foot - high * scale), round(window.foot - low * scale)
