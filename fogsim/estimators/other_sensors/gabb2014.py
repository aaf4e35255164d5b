"""Gabb et al. (2014): the radar follows the vehicle ahead through any fog; the camera's range limit gives k."""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from fogsim.core.parameters import Range, checked_parameters
from fogsim.estimators.image_check import ObservationCheck
from fogsim.units import extinction_from_visibility
from fogsim.values.camera import Camera
from fogsim.values.estimate import Estimate, ExtinctionBounds
from fogsim.values.observation import LeadMeasurement, Observation
from fogsim.vision.light.daylight import lit_by_lamps
from fogsim.vision.light.luminance import linear_luminance
from fogsim.vision.lines.horizon import PITCH_DEVIATION, CannotTellError, PitchDeviation, levelled
from fogsim.vision.vehicle.rear_localisation import ASIDE, BODY, WIDTHS, search_window, upright_steps
from fogsim.vision.vehicle.vehicle_crop import VehicleCrop, daytime_crop

Floats = NDArray[np.float64]

_PLACED = (-0.5, 0.0, 0.5)
"""How much higher than where the calibration has the road a vehicle is looked for [m]: pitch, sag and crest."""

_EDGE_GAIN = 0.41
"""Step from pixel to pixel over that across the edge of something: by its blur and the smoothing [-]."""


@dataclass(frozen=True, slots=True)
class Presence:
    """What came of looking for a vehicle."""

    # Lesser step of luminance across the sides of what is most like a vehicle, over the airlight; 0 for nothing [-]
    step: float
    threshold: float  # What it must be for a vehicle to be found: by noise and clutter; over the airlight [-]
    aside: float = 0.0  # How far to the right of the own axis the middle is [m]

    @property
    def found(self) -> bool:
        """Whether it stands out."""
        return self.step > self.threshold


def _vehicle_presence(
    luminance: NDArray[np.float32],
    origin: tuple[int, int],
    camera: Camera,
    depth: float,
    aside: float,
    light: tuple[float, float],
) -> Presence:
    """Look for two upright edges, one up and one down, as far apart as a vehicle's sides.

    What is brighter than the airlight, as lamps are, counts as bright as that: so no contrast exceeds e^(−kd), by what
    light ever it comes.

    Takes `luminance` (rows, cols) [linear grey levels], `depth` [m], `aside` [m], `light` [linear grey levels].
    """
    airlight, noise = light
    scale = camera.focal_length / depth
    foot = camera.horizon_row + camera.row_distance / depth - origin[1]
    found = []
    for higher in _PLACED:
        top, bottom = (foot - (height + higher) * scale for height in (BODY[1], BODY[0]))
        rows = slice(max(math.floor(top), 0), max(math.ceil(bottom) + 1, 0))
        body = np.minimum(luminance[rows], np.float32(airlight))
        if body.shape[0] >= 2 and body.shape[1] >= 8:
            step, floor = upright_steps(body, noise)
            best, middle = _strongest_pair(step, scale, camera.principal_point[0] - origin[0], aside)
            found.append(Presence(best / _EDGE_GAIN / airlight, floor / _EDGE_GAIN / airlight, middle / scale))
    return max(found, key=lambda one: one.step / one.threshold) if found else Presence(0.0, 1.0)


def _strongest_pair(step: Floats, scale: float, axis: float, aside: float) -> tuple[float, float]:
    """The weaker step of the strongest pair at a width that vehicles have, and its middle from the axis [px]."""
    strongest = 0.0, 0.0
    for width in range(max(math.floor(WIDTHS[0] * scale), 3), min(math.ceil(WIDTHS[1] * scale) + 1, step.size - 1)):
        first, second = step[:-width], step[width:]
        strength = np.where(first * second < 0.0, np.minimum(np.abs(first), np.abs(second)), 0.0)
        middle = np.arange(strength.size) + 0.5 * width - axis
        strength[np.abs(middle) > aside * scale] = 0.0
        best = int(strength.argmax())
        strongest = max(strongest, (float(strength[best]), float(middle[best])))
    return strongest


CELLS, _NEAREST, FARTHEST = 141, 10.0, 10_000.0
"""Cells of ln k, and visibilities at the ends of the grid [m]."""

_USUAL_CONTRAST, _CONTRAST_DEVIATION = -0.45, 0.35
"""Mean and standard deviation of the ln of a vehicle's contrast to its surroundings, over the airlight."""

_LIGHT_SHARE, _LEAST_CONTRAST = 0.1, 0.05
"""Share of vehicles with an unknown contrast, since light paint in front of light airlight may vanish at any range [-],
and its least value then [-]."""

_SLOPE = 0.25
"""Deviation, in ln of the contrast, of the threshold at which a vehicle is found [-]."""

_ASTRAY = 0.03
"""Share of looks that go astray either way: clutter that looks like a vehicle, something that hides it [-]."""

_SUREST = 4.0
"""Largest logarithm of a ratio of likelihoods that is kept [-]: fog changes, and then what contradicts counts."""

_END = 0.25
"""Likelihood at both ends of the grid, over the largest, up to which there is an estimate [-]."""

KNOWN = 0.35
"""The same at one end up to which there is a bound [-]."""

_WIDEST, _LEAST_DEVIATION = 0.5, 0.1
"""Largest and least standard deviation of an estimate, and of a bound, in ln k [-]."""

EXTINCTION = np.geomspace(extinction_from_visibility(FARTHEST), extinction_from_visibility(_NEAREST), CELLS)
_LOG_EXTINCTION, _LOG_CONTRAST = np.log(EXTINCTION), np.linspace(math.log(_LEAST_CONTRAST), 0.0, 16)


def _contrast_prior() -> Floats:
    usual = np.exp(-0.5 * ((_LOG_CONTRAST - _USUAL_CONTRAST) / _CONTRAST_DEVIATION) ** 2)
    return np.asarray((1.0 - _LIGHT_SHARE) * usual / usual.sum() + _LIGHT_SHARE / _LOG_CONTRAST.size)


class LossLikelihood:
    """Evidence on k from looks at vehicles at known ranges; each vehicle has an unknown contrast C0 in all looks.

    A look finds the vehicle with the probability that C0 e^(−kd) exceeds a threshold.
    """

    def __init__(self) -> None:
        self._prior = np.log(_contrast_prior())
        self._past = np.zeros(CELLS)
        self._present = np.zeros((CELLS, _LOG_CONTRAST.size))
        self._reach = 0.0

    def fade(self, ages: float) -> None:
        """Let what was learnt count for less."""
        kept = math.exp(-ages)
        self._past *= kept
        self._present *= kept

    def meet_another(self) -> None:
        """Look at another vehicle from now on."""
        learnt = self._learnt()
        self._past = np.maximum(learnt - learnt.max(), -_SUREST)
        self._present = np.zeros_like(self._present)

    def learn(self, distance: float, threshold: float, weight: float, *, found: bool) -> None:
        """Take in a look (`distance` [m])."""
        contrast = _LOG_CONTRAST - distance * EXTINCTION[:, None]
        above = np.clip((contrast - math.log(threshold)) / _SLOPE, -40.0, 40.0)
        # A logistic curve is a normal distribution's within 0.01.
        share = _ASTRAY + (1.0 - 2.0 * _ASTRAY) / (1.0 + np.exp(-1.702 * above))
        self._present += weight * np.log(share if found else 1.0 - share)
        self._present = np.maximum(self._present - self._present.max(), -_SUREST)
        self._reach = distance

    def _learnt(self) -> Floats:
        """Logarithm of the likelihood of each ln k."""
        joint = self._present + self._prior
        most = joint.max()
        return np.asarray(self._past + most + np.log(np.exp(joint - most).sum(axis=1)))

    def result(self) -> tuple[float, float, float] | ExtinctionBounds | None:
        """k, its standard deviation and how far all looks reached [1/m, 1/m, m]; bounds; or nothing."""
        learnt = self._learnt()
        likelihood = np.exp(learnt - learnt.max())
        if max(likelihood[0], likelihood[-1]) < _END:
            # Tails are by looks that go astray: a normal distribution has e^(−½) of its height one deviation aside.
            near = _LOG_EXTINCTION[likelihood >= math.exp(-0.5)]
            mean, deviation = 0.5 * float(near[0] + near[-1]), 0.5 * float(near[-1] - near[0])
            deviation = math.hypot(deviation, _LEAST_DEVIATION)
            if deviation <= _WIDEST:
                return math.exp(mean), deviation * math.exp(mean), self._reach
        most, above = _fall(likelihood, _LOG_EXTINCTION)
        least, below = _fall(likelihood[::-1], -_LOG_EXTINCTION[::-1])
        if math.isinf(most) and math.isinf(least):
            return None
        softness = min(max(above, below, _LEAST_DEVIATION), _WIDEST)
        return ExtinctionBounds(math.exp(most), math.exp(-least), softness)


def _fall(likelihood: Floats, place: Floats) -> tuple[float, float]:
    """Where a likelihood falls below a half for good, and the deviation of that; inf and 0 where it does not."""
    if likelihood[-1] > KNOWN:
        return math.inf, 0.0
    half = int(np.flatnonzero(likelihood > 0.5)[-1])
    tail = int(np.flatnonzero(likelihood > max(0.16, 1.1 * float(likelihood[-1])))[-1])
    return float(place[half]), float(place[max(tail, half)] - place[half])


_LARGE_ENOUGH = 5.0
"""Width of the narrowest vehicle from which on it would be found in clear air [px]."""

_SHARPEST_BEND = 600.0
"""Radius of a bend on which a vehicle that is not found may be [m]: none must be found up to that far aside."""

_SEEN_BEFORE, _NEARLY_AHEAD = 10.0, 2.0
"""Time [s] since it was found so near to the own axis [m] within which a vehicle has not gone next to it."""

_DENSEST, _ABRUPT = 0.1, 3.0
"""Extinction of the densest fog in which a vehicle fades [1/m], and what must then be left of its contrast for it to be
hidden and not lost, over the threshold [-]."""

_JUMP, _SURPRISE = 15.0, 5.0
"""Changes of range, as such and against what the relative speed says, that together mean another vehicle [m]."""

_LOST_AFTER = 2.0
"""Time without a range after which the next one is another vehicle's [s]."""

_NEW_RANGE, _NEW_TIME = 5.0, 3.0
"""Change of range [m], and time [s], after which a look is as good as another one: texture and clutter stay before."""


@checked_parameters
class Gabb2014:
    """Track a vehicle by radar and look for it in the image; the range at which it is lost gives the visibility.

    The range and the calibration say where in the picture the vehicle must be and how wide it is. There two upright
    edges stand out of noise and clutter, or not. The contrast C0 of a vehicle fades as e^(−kd) (Duntley's law), and it
    is found while that exceeds the picture's threshold C_t: where it is lost, k d = ln(C0 / C_t). Neither C0 nor that
    range is known well, so what all looks say is taken together by Bayes' rule over k and C0. A vehicle that is found
    at every range gives only `bounds` of k from above, one that is found at none from below, and one that is beyond the
    radar's reach, or too small in the picture, none. One that was lost, or has come out of the fog, gives an estimate.
    What was learnt fades with way and time.

    M. Gabb, S. Krebs, O. Löhlein, M. Fritzsche, "Probabilistic inference of visibility conditions by means of sensor
    fusion", IEEE Intelligent Vehicles Symposium 2014, 1211-1216. The paper's constants are not known here: the idea is
    its, the likelihood and its constants are this project's own. Daytime only: lamps are seen farther.

    Parameters
    ----------
    camera : Camera
        The assumed calibration.
    setback : float or None
        Distance of the camera behind the front bumper, from which the range counts [m]; None to use what observations
        report.
    pitch_deviation : float
        Standard deviation of the true pitch about the assumed one [rad].
    fading_way, fading_time : float
        Way [m] and time [s] after which what was learnt counts 1/e of what it did.

    Raises
    ------
    InputError
        If a parameter is out of range.
    """

    method = "gabb2014"

    def __init__(
        self,
        camera: Camera,
        *,
        setback: Annotated[float, Range(0.0, 10.0, "m")] | None = None,
        pitch_deviation: PitchDeviation = PITCH_DEVIATION,
        fading_way: Annotated[float, Range(1.0, 1e6, "m")] = 1000.0,
        fading_time: Annotated[float, Range(0.1, 1e6, "s")] = 60.0,
    ) -> None:
        self._camera, self._setback = camera, setback
        self._check = ObservationCheck(camera)
        self._pitch_deviation = pitch_deviation
        self._fading_way, self._fading_time = fading_way, fading_time
        self.reset()

    def reset(self) -> None:
        """Forget all vehicles and their measurements."""
        self._check.reset()
        self._learnt = LossLikelihood()
        self._time: float | None = None
        self._lead: tuple[float, LeadMeasurement] | None = None
        self._looked: tuple[float, float] | None = None
        self._ahead_until = -math.inf
        self._last: tuple[float, float, float] | None = None

    def update(self, observation: Observation) -> Estimate:
        """Look for the vehicle ahead, and estimate from all looks.

        Parameters
        ----------
        observation : Observation
            Its image, time, speed, lead and, if no setback was given, camera_setback are used.

        Returns
        -------
        Estimate
            Diagnostics: ``found``, whether the vehicle was found in this image, absent if that is unknown;
            ``threshold``, the least contrast that is found [-]; ``distance`` of the vehicle [m]; ``note``, why nothing
            was looked for; or ``reason``.

        Raises
        ------
        InputError
            If camera, image or time do not fit (see `fogsim.estimators.image_check`).
        """
        image = self._check.kernel_image(observation)
        self._fade(observation)
        found: dict[str, object] = {"horizon_row": self._camera.horizon_row}
        note, lead = "no vehicle ahead is tracked", observation.lead
        if lead is not None and math.isfinite(lead.distance) and lead.distance >= 0.0:
            self._follow(lead, observation.time)
            setback = observation.camera_setback if self._setback is None else self._setback
            depth = lead.distance + setback
            try:
                note = self._look(image, depth, observation, found)
            except CannotTellError as error:
                return Estimate.invalid(self.method, str(error), **found)
        return self._estimate(note, found)

    def _fade(self, observation: Observation) -> None:
        time, speed = observation.time, observation.speed
        elapsed = 0.0 if self._time is None else max(time - self._time, 0.0)
        way = speed * elapsed if math.isfinite(speed) and speed > 0.0 else 0.0
        self._learnt.fade(way / self._fading_way + elapsed / self._fading_time)
        self._time = time

    def _follow(self, lead: LeadMeasurement, time: float) -> None:
        """Begin again with another vehicle, whose contrast is another."""
        if self._lead is not None:
            before, earlier = self._lead
            expected = earlier.distance + earlier.relative_speed * (time - before)
            jumped = abs(lead.distance - earlier.distance) > _JUMP and not abs(lead.distance - expected) <= _SURPRISE
            if jumped or time - before > _LOST_AFTER:
                self._learnt.meet_another()
                self._looked, self._ahead_until, self._last = None, -math.inf, None
        self._lead = time, lead

    def _look(
        self,
        image: NDArray[np.uint8] | NDArray[np.uint16],
        depth: float,
        observation: Observation,
        found: dict[str, object],
    ) -> str:
        """Learn from one picture; why nothing was learnt, or nothing."""
        if depth > 1.0 and search_window(self._camera, depth) is None:
            return "the vehicle ahead is too small in the image, or outside it"
        crop = daytime_crop(image, self._camera, depth, self._pitch_deviation)
        level = levelled(image, self._camera)
        if why := lit_by_lamps(level, self._camera, observation.lead):
            raise CannotTellError(why)
        light = crop.sky.luminance, crop.noise
        seen = _vehicle_presence(crop.luminance, crop.origin, self._camera, depth, ASIDE, light)
        found |= {"distance": depth, "threshold": seen.threshold}
        if seen.found and abs(seen.aside) <= _NEARLY_AHEAD:
            self._ahead_until = observation.time + _SEEN_BEFORE
        if not seen.found and not self._is_lost(level, crop, observation.time):
            return "the vehicle ahead may be outside the searched area, or too small"
        left = self._left(depth, observation.time)
        if seen.found and seen.step >= left:
            self._last = observation.time, depth, seen.step
        if not seen.found and left > _ABRUPT * seen.threshold:
            return "the vehicle ahead went out of sight faster than fog hides it"
        found["found"] = seen.found
        self._learn(seen, depth, observation.time)
        return ""

    def _is_lost(self, level: NDArray[np.uint8] | NDArray[np.uint16], crop: VehicleCrop, time: float) -> bool:
        """Whether a vehicle that was not found would be in clear air, and none is aside on what may be a bend."""
        if WIDTHS[0] * crop.scale < _LARGE_ENOUGH:
            return False
        if time <= self._ahead_until:
            return True
        aside = ASIDE + 0.5 * crop.depth**2 / _SHARPEST_BEND
        middle, half = self._camera.principal_point[0], (aside + WIDTHS[1]) * crop.scale
        columns = slice(max(math.floor(middle - half), 0), min(math.ceil(middle + half), self._camera.width))
        rows = slice(crop.origin[1], crop.origin[1] + crop.luminance.shape[0])
        camera = self._camera
        wide = linear_luminance(level[rows, columns], camera.response, camera.bits, camera.black_level)
        light = crop.sky.luminance, crop.noise
        return not _vehicle_presence(wide, (columns.start, rows.start), camera, crop.depth, aside, light).found

    def _left(self, depth: float, time: float) -> float:
        """What even the densest fog must have left of the contrast that the vehicle had a moment ago [-]."""
        if self._last is None or time - self._last[0] > _SEEN_BEFORE:
            return 0.0
        return self._last[2] * math.exp(-_DENSEST * max(depth - self._last[1], 0.0))

    def _learn(self, seen: Presence, depth: float, time: float) -> None:
        weight = 1.0
        if self._looked is not None:
            before, earlier = self._looked
            weight = min(abs(depth - earlier) / _NEW_RANGE + (time - before) / _NEW_TIME, 1.0)
        self._looked = time, depth
        self._learnt.learn(depth, seen.threshold, weight, found=seen.found)

    def _estimate(self, note: str, found: dict[str, object]) -> Estimate:
        result = self._learnt.result()
        if isinstance(result, tuple):
            if note:
                found["note"] = note
            extinction, deviation, reach = result
            return Estimate(self.method, extinction, deviation, diagnostics=found, reach=reach)
        reason = note or "the vehicle ahead has not been seen to disappear or to come out of the fog"
        return Estimate(self.method, 0.0, math.inf, valid=False, diagnostics={"reason": reason, **found}, bounds=result)
