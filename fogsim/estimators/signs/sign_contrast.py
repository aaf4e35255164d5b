"""Fog from how the light of signs' faces changes with the distance that the map says."""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import convolution
from fogsim.core.parameters import Range, checked_parameters
from fogsim.estimators.image_check import ObservationCheck
from fogsim.estimators.signs.face_light import MARGIN, FaceLight, face_light, layout_of
from fogsim.estimators.signs.regions import PoseDeviation, Registration
from fogsim.estimators.signs.watch import SignWatch, sign_looks
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values.camera import Camera
from fogsim.values.estimate import Estimate
from fogsim.values.observation import Observation
from fogsim.vision.light.luminance import linear_luminance
from fogsim.vision.lines.horizon import PITCH_DEVIATION, PitchDeviation
from fogsim.vision.strips.sky import Sky

Floats = NDArray[np.float64]

GRID = OPTICAL_DEPTH_AT_VISIBILITY / np.geomspace(8000.0, 10.0, 900)
"""Extinction coefficients to weigh [1/m], evenly spaced in ln k, more finely than any sign can resolve."""

SIGN_DEVIATION = 0.015
"""Relative deviation of k that a sign has to itself, whatever its looks agree on [-]."""

_AIRLIGHT, _CLIPPED_AIRLIGHT = 0.008, 0.05
"""Relative deviation of the airlight at the sign from the sky's, and where the sky is clipped [-]."""

_DARKNESS = 0.02
"""Deviation of what a sign's black sends, over the airlight [-]: gloss, dirt, and red that is not as red."""

_REGISTRATION = 0.012
"""Relative deviation of a single look's contrast by what is not noise: its layout, its place within the pixels [-]."""

_SMALL_FACE = 0.05
"""Relative deviation of the contrast of faces too small for their areas to be distinguished, which the looks at a sign
share: how far their light spreads, how large they are taken to be [-]."""

_BRIGHTNESS, _BRIGHTNESS_DEVIATION = 1.0, 0.5
"""What a white face would send without fog over the airlight, divided by its reflectance, and its deviation [-]: a
vertical surface gets about half of a level one's light, the airlight has 0.37 over woods and 0.87 over snow."""

_HUBER, _ROUNDS, _COARSE = 2.0, 2, 6
"""Standard deviations from which on a look counts less [-], rounds of weighing, and every how manieth k they need."""

MAX_MISFIT = 2.5
"""Mean square of the standardised residuals beyond which it is not the sign that the map has [-]."""


@dataclass(frozen=True, slots=True)
class FaceLook:
    """One look at a sign."""

    distance: float  # From the camera by the map [m]
    face: FaceLight  # What its face sends
    airlight: float  # Luminance of the sky [linear grey levels]
    clipped: bool = False  # Whether the sky is clipped


@dataclass(frozen=True, slots=True)
class ApproachFit:
    """What the approach to one sign says."""

    log_likelihood: Floats  # (300,): For each k of `GRID`, the largest 0 [-]
    misfit: float  # Mean square of the standardised residuals at the likeliest k [-]


def _fit_approach(looks: Sequence[FaceLook], range_deviation: float) -> ApproachFit:
    """Weigh every extinction coefficient by the looks at one sign.

    By Koschmieder's law the face's black has the contrast −(1 − g) e^(−kd) + ε to the airlight, and its slope over
    reflectance is Q e^(−kd): the brightness Q, the black's own light g and the airlight's error ε are the sign's own,
    and are fitted for each k. A constant error of the map's distance changes Q and g alone.

    Takes `range_deviation` [m].
    """
    distance = np.array([one.distance for one in looks])
    airlight = np.array([one.airlight for one in looks])
    seen = np.array([(one.face.black, one.face.slope) for one in looks]) / airlight[:, None]
    seen[:, 0] -= 1.0
    small = np.array([float(one.face.is_mean) for one in looks])
    noise = np.array([one.face.variance for one in looks]) / airlight[:, None] ** 2
    unsure = _CLIPPED_AIRLIGHT if any(one.clipped for one in looks) else _AIRLIGHT
    measured = _Measured(distance, seen, noise, small, unsure, range_deviation)
    weight = np.ones(len(looks))
    for _ in range(_ROUNDS):
        squares, residuals = _profile(GRID[::_COARSE], measured, weight)
        square = residuals[int(np.argmin(squares))]
        weight = np.minimum(1.0, _HUBER / np.sqrt(np.maximum(square, 1e-9)))
    squares, residuals = _profile(GRID, measured, weight)
    at = int(np.argmin(squares))
    misfit = float((weight * residuals[at]).sum() / max(2 * len(looks) - 3, 1))
    scaled = -0.5 * (squares - squares[at]) / max(misfit, 1.0)
    return ApproachFit(_widened(scaled), misfit)


def _widened(log_likelihood: Floats) -> Floats:
    """Log-likelihood of `GRID` after `SIGN_DEVIATION` has been added, the largest 0."""
    step = math.log(GRID[1] / GRID[0])
    reach = math.ceil(3.5 * SIGN_DEVIATION / step)
    share = np.exp(-0.5 * (np.arange(-reach, reach + 1) * step / SIGN_DEVIATION) ** 2)
    padded = np.pad(np.exp(np.maximum(log_likelihood, -700.0)), reach, mode="edge")
    wider = np.log(convolution(padded, share)[2 * reach : -2 * reach])
    return np.asarray(wider - wider.max())


class _Measured(NamedTuple):
    """Looks at one sign, relative to the airlight.

    Distances [m]; contrast of black and slope (looks, 2), variances and covariance of these (looks, 3); 1 where only
    the mean counts; deviations of the airlight [-] and of a distance [m].
    """

    distance: Floats
    seen: Floats
    noise: Floats
    small: Floats
    unsure: float
    range_deviation: float


def _profile(grid: Floats, measured: _Measured, weight: Floats) -> tuple[Floats, Floats]:
    """Least sum of squares for each k of the grid, and each look's own (k, looks)."""
    distance, seen, noise, small, unsure, range_deviation = measured
    k = grid[:, None]
    fall = np.exp(-k * distance)
    # What is not noise scales a contrast; taken along the usual face, so that what was seen decides no weights.
    relative = (_REGISTRATION**2 + (k * range_deviation) ** 2) * fall**2
    a = noise[:, 0] + relative
    b = noise[:, 1] + _BRIGHTNESS**2 * relative
    c = noise[:, 2] - _BRIGHTNESS * relative * 0.5
    determinant = np.maximum(a * b - c * c, 1e-30)
    aa, bb, ab = b / determinant, a / determinant, -c / determinant
    first, second = seen[:, 0] + fall, np.broadcast_to(seen[:, 1], fall.shape) - _BRIGHTNESS * fall
    # Linear unknowns: g, ε and what small faces share in the first, the brightness beyond the usual in the second.
    none = np.zeros_like(fall)
    rows = ((fall, none), (np.ones_like(fall), none), (small * fall, none), (none, fall))
    priors = (_DARKNESS**-2.0, unsure**-2.0, _SMALL_FACE**-2.0, _BRIGHTNESS_DEVIATION**-2.0)
    matrix, right = np.zeros((len(grid), 4, 4)), np.zeros((len(grid), 4))
    for i, (p, q) in enumerate(rows):
        left_p, left_q = weight * (aa * p + ab * q), weight * (ab * p + bb * q)
        right[:, i] = (left_p * first + left_q * second).sum(axis=1)
        for j, (r, s) in enumerate(rows):
            matrix[:, i, j] = (left_p * r + left_q * s).sum(axis=1)
        matrix[:, i, i] += priors[i]
    solved = _solved(matrix, right)
    g, offset, shared, brighter = (solved[:, i, None] for i in range(4))
    first, second = first - (g + shared * small) * fall - offset, second - brighter * fall
    own = aa * first**2 + bb * second**2 + 2.0 * ab * first * second
    # The logarithm of the determinant: variances depend on k.
    whole = (weight * (own + np.log(determinant))).sum(axis=1)
    return whole + (solved**2 * np.array(priors)).sum(axis=1), own


def _solved(matrix: Floats, right: Floats) -> Floats:
    """Solutions of many small positive definite systems, by Gauss's elimination."""
    matrix, right = matrix.copy(), right.copy()
    count = right.shape[1]
    for i in range(count):
        for j in range(i + 1, count):
            share = matrix[:, j, i] / matrix[:, i, i]
            matrix[:, j] -= share[:, None] * matrix[:, i]
            right[:, j] -= share * right[:, i]
    for i in reversed(range(count)):
        right[:, i] = (right[:, i] - (matrix[:, i, i + 1 :] * right[:, i + 1 :]).sum(axis=1)) / matrix[:, i, i]
    return right


def extinction_of(fits: Sequence[ApproachFit], wrong_share: float) -> tuple[float, float]:
    """Mean and standard deviation of k [1/m] after several signs; some may be wrong."""
    likelihoods = [np.exp(np.maximum(fit.log_likelihood, -700.0)) for fit in fits]
    likelihoods = [one / one.mean() for one in likelihoods]
    shares = [np.log((1.0 - wrong_share) * one + wrong_share) for one in likelihoods]
    likeliest = int(np.argmax(np.sum(shares, axis=0)))
    # A sign counts for the probability that it is right, there where most of them agree.
    right = [(1.0 - wrong_share) * one[likeliest] for one in likelihoods]
    total = np.sum([r / (r + wrong_share) * fit.log_likelihood for r, fit in zip(right, fits, strict=True)], axis=0)
    probability = np.exp(total - total.max())
    probability /= probability.sum()
    mean = float((probability * GRID).sum())
    deviation = math.sqrt(float((probability * (GRID - mean) ** 2).sum()))
    return mean, deviation


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
                approach.fit = _fit_approach(approach.looks, self._range_deviation)
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
        face = face_light(light, (u - left, v - top), radius, layout_of(sighting.kind), narrowed, sky.noise)
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
