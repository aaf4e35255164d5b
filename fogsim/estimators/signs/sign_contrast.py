"""Fog from how the light of signs' faces changes with the distance that the map says."""

import math
from collections import deque
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from fogsim.core.parameters import Range, checked_parameters
from fogsim.estimators.image_check import ObservationCheck
from fogsim.estimators.signs.approach_fit import (
    MAX_MISFIT,
    ApproachFit,
    FaceLook,
    extinction_of,
    fit_approach,
)
from fogsim.estimators.signs.face_light import MARGIN, face_light
from fogsim.estimators.signs.layout import layout_of
from fogsim.estimators.signs.regions import PoseDeviation
from fogsim.estimators.signs.registration import Registration
from fogsim.estimators.signs.watch import SignWatch, sign_looks
from fogsim.values.camera import Camera
from fogsim.values.estimate import Estimate
from fogsim.values.observation import Observation
from fogsim.vision.light.luminance import linear_luminance
from fogsim.vision.lines.horizon import PITCH_DEVIATION, PitchDeviation
from fogsim.vision.strips.sky import Sky

_MIN_LOOKS = 4
"""Fewest looks at a sign."""

_LEAST_SPAN = 12.0
"""Least change of the distance over them [m]."""

_SPACING = 0.025
"""Least change of distance between two looks, relative to it [-]."""

_MOST_LOOKS, _MOST_SIGNS = 60, 30
"""Looks at one sign, and signs, that are remembered."""

_LEAST_RADIUS, _LARGEST_RADIUS = 3.0, 45.0
"""Radii of faces whose light is measured [px]."""

_SYSTEMATIC = 0.015
"""Relative deviation of k that all signs share [-]."""

_WORST = 0.15
"""Largest deviation of k relative to itself for an estimate [-]."""


@dataclass(slots=True)
class _Approach:
    """Looks at one sign, the nearest last, and what they say once they are enough."""

    time: float
    looks: deque[FaceLook] = field(default_factory=lambda: deque(maxlen=_MOST_LOOKS))
    fit: ApproachFit | None = None

    def is_news(self, distance: float) -> bool:
        """Whether a look from this distance would add to those before."""
        return not self.looks or abs(distance - self.looks[-1].distance) > _SPACING * distance

    @property
    def span(self) -> float:
        """Change of the distance [m]."""
        distances = [one.distance for one in self.looks]
        return max(distances) - min(distances)


@checked_parameters
class SignContrast:
    """Light of the faces of signs against the distance by the map, while they come nearer (Koschmieder's law).

    Where the map has a sign ahead the picture is searched for it; its face, of the kind's known layout, is fitted to
    the picture at each look, before whatever stands behind it: which luminance its black has, and how much its white
    sends more. Black gives the airlight between, A (1 − e^(−kd)), and white over black fades as e^(−kd). A sign's own
    brightness and a wrong distance of the map change no rate. Signs are weighed together, and each may be wrong:
    missing, moved, turned or another.

    Own method, after the road signs of Belaroussi & Gruyer (2015) and Duntley's law. Daytime only.

    Parameters
    ----------
    camera : Camera
        The assumed calibration.
    setback : float or None
        Distance of the camera behind the front bumper [m]; None to use what observations report.
    position_deviation : float
        Standard deviation of a sign's place by map and own position [m].
    heading_deviation : float
        Standard deviation of the own heading [rad].
    pitch_deviation : float
        Standard deviation of the true pitch about the assumed one [rad].
    wrong_share : float
        Share of signs that are not what the map says [-].
    window : float
        How long a sign counts [s].
    hold : float
        How long after the last look an estimate is still given [s]; what is known does not change any more.
    """

    method = "sign_contrast"

    def __init__(
        self,
        camera: Camera,
        *,
        setback: Annotated[float, Range(0.0, 10.0, "m")] | None = None,
        position_deviation: Annotated[float, Range(0.0, 100.0, "m")] = 0.5,
        heading_deviation: Annotated[float, Range(0.0, 1.0, "rad")] = math.radians(0.2),
        pitch_deviation: PitchDeviation = PITCH_DEVIATION,
        wrong_share: Annotated[float, Range(0.001, 0.9)] = 0.1,
        window: Annotated[float, Range(0.01, 1e6, "s")] = 60.0,
        hold: Annotated[float, Range(0.0, 1e6, "s")] = 1.0,
    ) -> None:
        self._camera, self._check = camera, ObservationCheck(camera)
        deviation = PoseDeviation(position_deviation, heading=heading_deviation, pitch=pitch_deviation)
        self._watch = SignWatch(camera, setback, deviation)
        # What errs of a place differs little from look to look of one sign, but the fix's noise does.
        self._range_deviation = 0.5 * position_deviation
        self._wrong_share, self._window, self._hold = wrong_share, window, hold
        self.reset()

    def reset(self) -> None:
        """Forget all signs."""
        self._check.reset()
        self._watch.reset()
        self._approaches: dict[str, _Approach] = {}

    def update(self, observation: Observation) -> Estimate:
        """Look at the signs ahead and estimate the fog from all that count.

        Parameters
        ----------
        observation : Observation
            Its image, time and signs are used.

        Returns
        -------
        Estimate
            Diagnostics: ``sign_looks``, the `SignLook` of each that was looked for, ``approaches``, how many count, and
            ``looks``, how many at these; or ``reason``.

        Raises
        ------
        InputError
            If camera, image or time do not fit (see `fogsim.estimators.image_check`), or two signs have one id.
        """
        image = self._check.kernel_image(observation)
        watched = self._watch.look(observation)
        found: dict[str, object] = {"horizon_row": self._camera.horizon_row}
        found["sign_looks"] = sign_looks(watched, self._watch.tracks)
        why = watched.night or self._add(image, watched.found, watched.sky, observation.time)
        if why:
            return Estimate.invalid(self.method, why, **found)
        return self._estimate(observation.time, found)

    def _add(
        self,
        image: NDArray[np.uint8] | NDArray[np.uint16],
        found: tuple[Registration, ...],
        sky: Sky | None,
        time: float,
    ) -> str:
        """Measure what was found; why the picture does not serve, or nothing."""
        wanted = [one for one in found if self._is_wanted(one, time)]
        if not wanted:
            return ""
        if sky is None:
            return "no sky is seen above the horizon"
        for one in wanted:
            look = self._look(image, one, sky)
            if look is None:
                continue
            approach = self._approaches.setdefault(one.sign.sighting.sign_id, _Approach(time))
            approach.looks.append(look)
            approach.time = time
            if len(approach.looks) >= _MIN_LOOKS and approach.span >= _LEAST_SPAN:
                approach.fit = fit_approach(approach.looks, self._range_deviation)
        return ""

    def _is_wanted(self, one: Registration, time: float) -> bool:
        known = self._approaches.get(one.sign.sighting.sign_id)
        if known is not None and time - known.time > self._hold + 5.0:
            # The same sign, driven past again.
            del self._approaches[one.sign.sighting.sign_id]
            known = None
        fits = _LEAST_RADIUS <= one.sign.radius <= _LARGEST_RADIUS
        return fits and (known is None or known.is_news(one.sign.distance))

    def _look(self, image: NDArray[np.uint8] | NDArray[np.uint16], one: Registration, sky: Sky) -> FaceLook | None:
        radius, (u, v) = one.sign.radius, (one.detection.u, one.detection.v)
        half = math.ceil(MARGIN * radius + 3.0)
        top, left = max(round(v) - half, 0), max(round(u) - half, 0)
        crop: NDArray[Any] = np.ascontiguousarray(image[top : round(v) + half + 1, left : round(u) + half + 1])
        if crop.size == 0:
            return None
        light = linear_luminance(crop, self._camera.response, self._camera.bits)
        sighting = one.sign.sighting
        aside = math.atan2(sighting.lateral, max(one.sign.distance, 1.0))
        narrowed = max(abs(math.cos(sighting.facing + aside)), 0.3)
        face = face_light(light, (u - left, v - top), radius, layout_of(sighting.kind), narrowed)
        return None if face is None else FaceLook(one.sign.distance, face, sky.luminance, sky.is_clipped)

    def _estimate(self, time: float, found: dict[str, object]) -> Estimate:
        self._approaches = {name: one for name, one in self._approaches.items() if time - one.time <= self._window}
        counted = [one for one in self._approaches.values() if one.fit is not None and one.fit.misfit <= MAX_MISFIT]
        counted = sorted(counted, key=lambda one: one.time)[-_MOST_SIGNS:]
        found |= {"approaches": len(counted), "looks": sum(len(one.looks) for one in counted)}
        if not counted:
            return Estimate.invalid(self.method, self._watch.trouble or "no sign has come near enough yet", **found)
        if time - counted[-1].time > self._hold:
            return Estimate.invalid(self.method, "no sign is being looked at", **found)
        fits = [one.fit for one in counted if one.fit is not None]
        k, deviation = extinction_of(fits, self._wrong_share)
        if deviation > _WORST * k:
            return Estimate.invalid(self.method, "the signs' light has not changed enough yet", **found)
        return Estimate(self.method, k, math.hypot(deviation, _SYSTEMATIC * k), diagnostics=found)
