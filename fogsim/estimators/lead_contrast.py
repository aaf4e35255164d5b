"""Fog from how the contrast of the tracked vehicle ahead falls with its range."""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.estimators.image_check import checked_count, checked_image
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values.camera import Camera
from fogsim.values.estimate import Estimate
from fogsim.values.observation import LeadMeasurement, Observation
from fogsim.vision.decay_fit import DecayFit, fit_decay
from fogsim.vision.horizon import PITCH_DEVIATION, levelled
from fogsim.vision.lead_patch import LeadPatch, lead_patch, registered_contrast
from fogsim.vision.strips import Pixels, linear_pixels, sky_above

MIN_AIRLIGHT = 6.0
"""Sky darker than this is no day [linear grey levels]."""

MOST_NOISE = 0.1
"""Noise of a sky relative to its luminance beyond which it is none [-]."""

MIN_SAMPLES = 5
"""Fewest ranges for a fit."""

MIN_CONTRAST = 0.05
"""Least contrast of the vehicle's rear at the nearest range for a track to begin [-]."""

REGISTRATION = 0.012
"""Relative deviation of a contrast by what is not noise: the panel's place, its shading [-]."""

AIRLIGHT_DEVIATION = 0.002
"""Relative deviation of the airlight behind the vehicle from the sky above it [-]."""

JUMP, SURPRISE = 15.0, 5.0
"""Changes of range, as such and against what the relative speed says, that together mean another vehicle [m]."""

MAX_MISFIT = 9.0
"""Mean square of the standardised residuals beyond which the contrast does not fall as Duntley's law has it [-]."""

SURE_OF_FOG = 2.5
"""Least k in its standard deviations for an estimate."""

CLEAR = OPTICAL_DEPTH_AT_VISIBILITY / 500.0
"""Extinction that an unsure estimate must surely be below to say "little fog" [1/m]."""


@dataclass(frozen=True, slots=True)
class _Sample:
    """One look at the vehicle ahead: range [m], contrast relative to the first, its noise, time [s]."""

    distance: float
    contrast: float
    noise: float
    time: float


class LeadContrast:
    """Mean contrast of the tracked vehicle ahead to the sky against its range (Duntley's law, c = C e^(−kd)).

    The range of the sensor says where to look; in the pixels the rear's panel between the lamps is found sideways as
    what differs most from both its flanks, and its height is registered on the first sight. What is brighter than
    the airlight (lamps) is left out, and contrast relative to the sky's luminance is indifferent to the exposure. k is
    the rate at which the contrast falls while the range changes: no flat road, no horizon and no reflectance of the
    road enters. A constant error of the range changes nothing.

    Own method, after the contrast of preceding vehicles in Mori et al. 2007. Daytime only. Remembers the track; another
    vehicle begins a new one.

    Parameters
    ----------
    camera : Camera
        The calibration as the vehicle was told it.
    setback : float
        Distance of the camera behind the front bumper, from which the range counts [m].
    range_deviation : float
        Standard deviation of the measured range [m].
    pitch_deviation : float
        Standard deviation of the true pitch about the told one [rad].
    window : float
        How long a sight counts [s].
    frames : int
        How many sights count at most.

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
        setback: float = 1.7,
        range_deviation: float = 0.25,
        pitch_deviation: float = PITCH_DEVIATION,
        window: float = 60.0,
        frames: int = 600,
    ) -> None:
        for name, value in (("setback", setback), ("range_deviation", range_deviation)):
            if not (math.isfinite(value) and value >= 0):
                raise InputError(f"{name} must be a length in metres and not negative, got {value!r}")
        for name, value in (("pitch_deviation", pitch_deviation), ("window", window)):
            if not (math.isfinite(value) and value > 0):
                raise InputError(f"{name} must be positive and finite, got {value!r}")
        self._camera, self._setback, self._window = camera, setback, window
        self._range_deviation, self._pitch_deviation = range_deviation, pitch_deviation
        self._samples: deque[_Sample] = deque(maxlen=checked_count("frames", frames, MIN_SAMPLES))
        self._first: LeadPatch | None = None
        self._offset: float | None = None
        self._last: tuple[float, LeadMeasurement] | None = None

    def reset(self) -> None:
        """Forget the track."""
        self._samples.clear()
        self._first = self._offset = self._last = None

    def update(self, observation: Observation) -> Estimate:
        """Add one look at the vehicle ahead and estimate the fog from all of the track.

        Parameters
        ----------
        observation : Observation
            Its image, time and lead are used.

        Returns
        -------
        Estimate
            Diagnostics: ``lead_box`` (left, right, top, bottom) of the panel looked at [px], ``distance`` and
            ``contrast`` (n,) of the track [m, -], ``misfit`` [-]; or ``reason``.

        Raises
        ------
        InputError
            If the image is not of the camera's bit depth, not grey or colour, or not of the told camera's size.
        """
        image = checked_image(observation.image, self._camera)
        found: dict[str, object] = {"horizon_row": self._camera.horizon_row}
        lead = observation.lead
        if lead is None or not (math.isfinite(lead.distance) and lead.distance >= 0):
            self.reset()
            return Estimate.invalid(self.method, "no vehicle ahead is tracked", **found)
        self._follow(lead, observation.time)
        reason = self._look(image, lead, observation.time, found)
        fit = self._fit()
        if fit is None:
            return Estimate.invalid(self.method, reason or "the track is too short yet", **found)
        found |= {"misfit": fit.misfit, "distance": self._column("distance"), "contrast": self._column("contrast")}
        reason = _doubt(fit)
        if reason:
            return Estimate.invalid(self.method, reason, **found)
        return Estimate(self.method, max(fit.extinction, 0.0), fit.deviation, diagnostics=found)

    def _follow(self, lead: LeadMeasurement, time: float) -> None:
        """Begin anew where the range says that this is another vehicle."""
        if self._last is not None:
            before, earlier = self._last
            expected = earlier.distance + earlier.relative_speed * (time - before)
            if abs(lead.distance - earlier.distance) > JUMP and abs(lead.distance - expected) > SURPRISE:
                self.reset()
        self._last = (time, lead)
        while self._samples and time - self._samples[0].time > self._window:
            self._samples.popleft()

    def _look(  # noqa: PLR0911 - each way in which a frame can say nothing has a reason of its own
        self, image: Pixels, lead: LeadMeasurement, time: float, found: dict[str, object]
    ) -> str:
        """Add a sample; say why if none can be had from this frame."""
        if abs(self._camera.roll) > math.pi / 4:
            return "the camera lies on its side or is upside-down"
        pixels = linear_pixels(levelled(image, self._camera), self._camera)
        margin = 3.0 * self._pitch_deviation * self._camera.focal_length + 2.0
        sky = sky_above(pixels, self._camera, margin)
        if sky is None or sky.luminance < MIN_AIRLIGHT:
            return "too dark above the horizon, or no sky: this is a daytime method"
        if sky.noise > MOST_NOISE * sky.luminance:
            return "what is above the horizon is no sky"
        if sky.saturated > 0.9:
            return "the sky is saturated"
        depth = lead.distance + self._setback
        patch = lead_patch(pixels, self._camera, depth, sky, self._offset)
        if patch is None:
            return "the vehicle ahead is too small in the image, outside it, or not told apart"
        found["lead_box"] = patch.box
        if self._first is None:
            if abs(patch.panel) < MIN_CONTRAST:
                return "the vehicle ahead hardly differs from the airlight"
            self._first = patch
        self._offset = patch.offset
        shift = depth * self._pitch_deviation + 0.02
        contrast = registered_contrast(patch.contrast, self._first.contrast, patch.deviation, shift)
        noise = patch.deviation / abs(self._first.panel)
        self._samples.append(_Sample(lead.distance, contrast, noise, time))
        return ""

    def _column(self, name: str) -> NDArray[np.float64]:
        return np.array([getattr(sample, name) for sample in self._samples])

    def _fit(self) -> DecayFit | None:
        if len(self._samples) < MIN_SAMPLES or self._first is None:
            return None
        distance, contrast, noise = (self._column(name) for name in ("distance", "contrast", "noise"))
        offset = AIRLIGHT_DEVIATION / abs(self._first.panel)
        fit = fit_decay(distance, contrast, noise, REGISTRATION, offset)
        if fit is None:
            return None
        # Noise of the range acts as a relative noise of the contrast, k σ.
        relative = math.hypot(REGISTRATION, fit.extinction * self._range_deviation)
        return fit_decay(distance, contrast, noise, relative, offset)


def _doubt(fit: DecayFit) -> str:
    if fit.misfit > MAX_MISFIT:
        return "the contrast does not fall with the range as Duntley's law has it"
    if fit.extinction < SURE_OF_FOG * fit.deviation and fit.extinction + 2.0 * fit.deviation > CLEAR:
        return "the range has not changed enough yet"
    return ""
