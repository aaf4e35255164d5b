"""Fog from the luminance of the road and the sky, fitted jointly with the horizon and an albedo that may wander."""

import math
from collections import deque
from typing import Annotated

import numpy as np

from fogsim.core.parameters import Range, checked_parameters
from fogsim.estimators.image_check import ObservationCheck
from fogsim.values.camera import Camera
from fogsim.values.estimate import DenserFog, Estimate, OpticalDepths
from fogsim.values.observation import Observation
from fogsim.vision.day.day_fit import free_road
from fogsim.vision.day.recent_change import RecentChange
from fogsim.vision.day.second_opinion import GLARES, SecondOpinion
from fogsim.vision.light.daylight import TOO_DARK, CannotTellError, lit_by_lamps
from fogsim.vision.light.luminance import linear_pixels
from fogsim.vision.light.pixel_kernels import LinearPixels
from fogsim.vision.lines.horizon import (
    MIN_ROWS,
    PITCH_DEVIATION,
    SCALE_DEVIATION,
    Horizon,
    PitchDeviation,
    ScaleDeviation,
    calibrated_horizon,
    levelled,
    weighted_mean,
    why_no_road,
)
from fogsim.vision.lines.road_course import RoadCourse, road_course, unseen_course
from fogsim.vision.lines.road_lines import refuse_misplaced, seen_lines, vanishing_point_of
from fogsim.vision.strips.airlight_slopes import DropletMemory, darkening_priors, joint_prior
from fogsim.vision.strips.course_geometry import course_deviation, course_geometry
from fogsim.vision.strips.joint_checks import CLEAR, LEAST_CONTRAST, MAX_MISFIT, Left, is_ramp, left_by, no_road
from fogsim.vision.strips.joint_fit import ALIKE, MODEL_DEVIATION, JointFit, Priors, fit_own, with_neighbours
from fogsim.vision.strips.shade import divided_road, is_sure
from fogsim.vision.strips.sky import Sky, sky_above
from fogsim.vision.strips.strip_curves import (
    StripCurves,
    lowest_road_row,
    mean_curves,
    strip_curves,
    without_clipped,
    without_rows_below,
)
from fogsim.vision.strips.strip_geometry import StripGeometry, strip_geometry
from fogsim.vision.uneven.hidden_course import HiddenCourse
from fogsim.vision.uneven.uneven_fit import UnevenFit, airlight_edge, even_fog, fit_uneven

_MIN_AIRLIGHT = 6.0
"""Sky darker than this is no day [linear grey levels]."""

_MIN_USED = 0.4
"""Least share of the own lane's bins, as far as it is free, that must fit [-]."""

_SURE_OF_FOG = 4.0
"""Least k in its standard deviations for an estimate of dense fog [-]."""

_OVERCONFIDENCE = 1.6
"""By how much the fit's deviation is too small where roads and cameras are not what its model knows: verges, tracks and
repairs in the strips, compression, soiled windscreens; measured on pictures that FogSim did not draw [-]."""

_HARDLY_UNEVEN, _UNEVEN_DEVIATION = 0.05, 0.13
"""Relative deviations of the mean extinction by unevenness that the road does not show, and, where the fog is surely
uneven, by what nodes along the way leave out [-]."""

_MOST_CHANGE = 0.15
"""Largest relative deviation by how the extinction changed over the last images [-]."""

_VEILED = 0.25
"""Relative deviation of the extinction by the veil of glass in which the sun shines [-]."""

_LEAST_DEPTH = 1.0
"""Least optical depth through which road is seen, where no tracked vehicle says why not [-]: what looks like an
obstacle across all lanes may be the edge of a shadow, and what is before it too little to distinguish fog from sun and
shade."""

_LEAST_DEVIATION = 1e-4
"""Deviation of k that what the model leaves out makes in clear air [1/m]."""

_DARKENS = 0.5
"""Chance of an airlight that darkens toward the road from which on the fog counts as even [-]: its law is that of a
layer."""

_MOST_OBSTACLES = 2
"""How often what stands in the own lane is looked for again, each time nearer."""


@checked_parameters
class JointRoad:
    """Joint fit of extinction, airlight, horizon and wandering albedo to strips of road and rows of sky.

    The mean luminance of each row of three strips of road (the own lane's middle and those of both neighbours) follows
    Koschmieder's law L = A − (A − R(d)) e^(−kd) along the slant path d = λ √(1 + x² + y²) / (v − v_h). Fitted are k, A
    (prior: the sky), v_h (prior: the calibration) and R(d), which is a constant of each strip plus patches of its own
    plus a smooth drift that the strips share. Patches and drift correlate the rows, so the fit is generalised least
    squares by a Kalman filter along the road; how strong they are is averaged over by evidence. Rows that do not fit
    are left out, and what lies behind an obstacle on the road with them; a tracked lead vehicle hides its lane. Where
    lane marks show that the road bends, sags or crests, strips and distances follow it; what they leave open of that
    widens the interval (`fogsim.vision.lines.road_course`).

    Fog need not be even: ln k at nodes along the way, smooth to some degree or other, is weighed against one k by
    evidence. Then the extinction is the mean up to where 95 % of the light is lost, or to the farthest road that is
    seen; `Estimate.optical_depths` has how it varies, `Estimate.denser` says where it becomes much denser.

    Where the own lane's fit is not sure, sun and shade on the road are looked for. If it has two luminances, whose
    pixels lie next to one another, strips are divided into what is lit and what is shaded, and even fog is fitted to
    both (`fogsim.vision.strips.shade`); with one picture at a time only.

    Nor need the airlight be: over dark land it brightens upward from the horizon and darkens toward the road, in a
    shape that radiative transfer has, for small and large droplets, and by one factor, which goes by the albedo of the
    land and is fitted too (prior: the sky's own brightening in the picture). That is weighed against even airlight by
    evidence; fog that it is found in counts as even (`fogsim.vision.strips.airlight_slopes`,
    docs/explanation/airlight.md).

    Where response, sky or light may be others than this fit knows, a second model of the image decides, or widens the
    interval (`fogsim.vision.day`).

    Own method: no paper describes it. It stands on Hautière et al. 2006 and negru2013 for the geometry of fog on a
    flat road. Daytime only; the road must be darker than the airlight.

    Parameters
    ----------
    camera : Camera
        The assumed calibration.
    pitch_deviation : float
        Standard deviation of the true pitch about the assumed one [rad].
    scale_deviation : float
        Relative standard deviation of focal length × mount height, with which distances on the road go [-].
    frames : int
        How many of the last frames' curves are averaged; 1 lets every frame stand alone. More average patches out,
        and lag behind a change of fog by half as many frames.
    even_airlight : bool
        Take the airlight for one number in any case, as Koschmieder's law has it.

    Raises
    ------
    InputError
        If a parameter is out of range.
    """

    method = "joint_road"

    def __init__(
        self,
        camera: Camera,
        *,
        pitch_deviation: PitchDeviation = PITCH_DEVIATION,
        scale_deviation: ScaleDeviation = SCALE_DEVIATION,
        frames: Annotated[int, Range(1, 10_000)] = 1,
        even_airlight: bool = False,
    ) -> None:
        self._camera, self._check, self._even_airlight = camera, ObservationCheck(camera), even_airlight
        self._horizon = calibrated_horizon(camera, pitch_deviation)
        self._impossible, self._unseen = why_no_road(camera), unseen_course(camera, self._horizon)
        self._straight = strip_geometry(camera, max(1.0, self._horizon.standard_deviation))
        self._geometry, self._shaded = self._straight, 0.0
        self._earlier: deque[tuple[StripCurves, Sky]] = deque(maxlen=int(frames) - 1)
        self._change = RecentChange(_MOST_CHANGE)
        self._droplets, self._left = DropletMemory(), Left()
        self._second = SecondOpinion(camera, scale_deviation)

    def reset(self) -> None:
        """Forget all earlier frames."""
        self._check.reset()
        self._earlier.clear()
        self._change.reset()
        self._droplets, self._left = DropletMemory(), Left()
        self._second.reset()

    def update(self, observation: Observation) -> Estimate:
        """Estimate the fog from one image, and the range of the lead vehicle if it is tracked.

        Parameters
        ----------
        observation : Observation
            Its image and its lead are used.

        Returns
        -------
        Estimate
            Diagnostics: ``horizon_row`` and ``told_horizon_row`` [px], ``inflection_row`` [px], ``airlight`` and
            ``road`` [linear grey levels, 0 … 255], ``misfit`` [-], ``band`` (left, right, top, bottom) of the own
            lane's rows in use [px], ``evenness``, how likely the fog is even, ``darkening``, how likely the airlight
            darkens toward the road, and ``shaded``, the part of the road that lies in shade [-]; or ``reason``.

        Raises
        ------
        InputError
            If camera, image or time do not fit (see `fogsim.estimators.image_check`).
        """
        image = self._check.kernel_image(observation)
        row = self._camera.horizon_row
        found: dict[str, object] = {"horizon_row": row, "told_horizon_row": row}
        if self._impossible:
            return Estimate.invalid(self.method, self._impossible, **found)
        level = levelled(image, self._camera)
        pixels = linear_pixels(level, self._camera)
        margin = 3.0 * self._horizon.standard_deviation + 2.0
        sky = sky_above(pixels, self._camera, margin)
        if sky is not None and sky.luminance < _MIN_AIRLIGHT:
            return Estimate.invalid(self.method, TOO_DARK, **found)
        if why := lit_by_lamps(level, self._camera, observation.lead):
            return Estimate.invalid(self.method, why, **found)
        try:
            horizon, course, lines = self._seen_course(pixels)
        except CannotTellError as reason:
            return Estimate.invalid(self.method, str(reason), **found)
        free = free_road(observation.lead)
        if sky is None:
            own = Estimate.invalid(self.method, "no sky is seen above the road", **found)
        else:
            own, free = self._joint(observation, pixels, sky, horizon, course, free, found)
        found_by_both = self._second.on(own, level, horizon, free, observation.time, lines)
        if sky is not None and sky.has_sun and not found_by_both.valid:
            return Estimate.invalid(self.method, GLARES, **found)
        return found_by_both

    def _joint(
        self,
        observation: Observation,
        pixels: LinearPixels,
        sky: Sky,
        horizon: Horizon,
        course: RoadCourse,
        free: float,
        found: dict[str, object],
    ) -> tuple[Estimate, float]:
        """Estimate of the joint fit alone, and the depth up to which it finds the own lane free [m]."""
        self._geometry, self._shaded = self._straight, 0.0
        if not course.is_straight:
            self._geometry = course_geometry(self._straight, self._camera, course)
        prior = joint_prior(sky, self._camera, horizon)
        priors = (prior,) if self._even_airlight else (prior, *darkening_priors(prior, sky, self._droplets.chances))
        fit = self._fitted(pixels, sky, priors, free, course, observation.time)
        if isinstance(fit, str):
            return Estimate.invalid(self.method, fit, **found), free
        self._droplets.learn(fit.fit.droplets, observation.time, observation.speed)
        unsure = course_deviation(fit.fit, self._geometry, self._camera, course, prior, sky.noise)
        front = fit.denser or airlight_edge(pixels, self._geometry, self._camera, sky, fit, prior.shift_deviation)
        changing = self._change.of(observation.time, fit.fit.extinction)
        veiled = _VEILED * fit.fit.extinction if sky.has_sun else 0.0
        own = self._estimate(fit, front, found, math.hypot(unsure, veiled, fit.fit.bright_deviation), changing)
        return own, min(free, _obstacle(fit.fit, self._geometry))

    def _fitted(
        self, pixels: LinearPixels, sky: Sky, priors: Priors, free: float, course: RoadCourse, time: float
    ) -> UnevenFit | str:
        """Fit of the road that is free up to a depth, or why there is none that is to be believed."""
        curves = self._curves(pixels, sky, free)
        whole, tracked = curves, free
        if is_full := self._left.is_due(time):
            self._left = Left()
        left = self._left
        own = fit_own(self._averaged(curves, sky), self._geometry, priors, left.albedos)
        if is_full and (shaded := self._in_shade(own, pixels, curves, sky, priors, free)):
            return shaded
        if own is None:
            self._earlier.append((curves, sky))
            return "too little road is seen"
        fit, curves, free = self._with_other_lanes(own, pixels, curves, sky, priors, free)
        self._earlier.append((curves, sky))
        # What even fog takes for an obstacle behind a tracked vehicle may be denser fog: it is not left out here.
        curves = whole if math.isfinite(tracked) else curves
        # Where a sag or crest is not quite followed, the road fades as in fog that changes along the way.
        uneven = even_fog(fit, self._geometry)
        is_full = is_full or not left.suffices(fit)
        if is_full and not course.sag.any() and fit.darkening_chance < _DARKENS:
            seen = self._averaged(curves, sky)
            hidden = HiddenCourse(self._straight, self._camera, course)
            uneven = fit_uneven(seen, self._geometry, priors[0], own, fit, hidden)
        why = self._rejection_reason(uneven, sky, curves, free, tracked)
        if is_full:
            self._left = Left() if why or uneven.even < 1.0 else left_by(time, fit)
        return why or uneven

    def _in_shade(
        self,
        own: JointFit | None,
        pixels: LinearPixels,
        curves: StripCurves,
        sky: Sky,
        priors: Priors,
        free: float,
    ) -> UnevenFit | str:
        """Fit of a road in sun and shade, where the own lane's does not explain it, or why it is not to be believed.

        Empty where there is no shade, where a supposed shade is rejected, or where it adds little to the own lane.
        """
        if self._earlier.maxlen or is_sure(own, curves) or is_ramp(curves, self._geometry, self._camera):
            return ""
        whole, stated, camera = self._geometry, self._horizon, self._camera
        divided = divided_road(pixels, curves, whole, camera, priors, stated, sky.noise, free)
        if divided is None:
            return ""
        self._geometry, self._shaded = divided.geometry, divided.share
        uneven = even_fog(divided.fit, divided.geometry)
        why, k = self._rejection_reason(uneven, sky, divided.curves, free, free), uneven.fit.extinction
        if not why:
            return uneven
        self._geometry, self._shaded = whole, 0.0
        alike = own is not None and own.extinction > 0.0 and abs(math.log(own.extinction / k)) < ALIKE
        return "" if alike or uneven.reach * k < _LEAST_DEPTH else why

    def _with_other_lanes(
        self, own: JointFit, pixels: LinearPixels, curves: StripCurves, sky: Sky, priors: Priors, free: float
    ) -> tuple[JointFit, StripCurves, float]:
        """Fit of all lanes that agree, their curves, and the depth up to which they are free [m].

        What stands in the own lane hides, further on, the neighbours' lanes too: they are read again without it.
        """
        fit = own
        for _ in range(_MOST_OBSTACLES):
            obstacle = _obstacle(fit, self._geometry)
            if obstacle < free:
                if self._is_hidden(fit, curves, free):
                    break
                free = obstacle
                curves = self._curves(pixels, sky, free, curves)
            elif fit is not own:
                break
            fit = with_neighbours(own, self._averaged(curves, sky), self._geometry, priors, self._left.albedos)
            if fit is own:
                break
        return fit, curves, free

    def _curves(self, pixels: LinearPixels, sky: Sky, free: float, before: StripCurves | None = None) -> StripCurves:
        """Strips of road up to a depth [m], without the own bonnet and what is clipped."""
        curves = strip_curves(pixels, self._geometry, sky.noise, self._camera, free, before)
        curves = without_rows_below(curves, self._geometry, lowest_road_row(pixels, self._camera, sky.luminance))
        return without_clipped(curves) if sky.is_clipped else curves

    def _averaged(self, curves: StripCurves, sky: Sky) -> StripCurves:
        """Average with the earlier frames' curves."""
        return mean_curves((*self._earlier, (curves, sky)))

    def _seen_course(self, pixels: LinearPixels) -> tuple[Horizon, RoadCourse, int | None]:
        """Horizon and course of the road, and how many lines meet where it vanishes; None if it bends.

        A straight road's horizon is weighed with the point in which its lines meet; CannotTellError if that is far.
        """
        seen = seen_lines(pixels, self._camera, self._horizon)
        if seen is None:
            return self._horizon, self._unseen, 0
        course = road_course(seen, pixels, self._camera, self._horizon) or self._unseen
        if not course.is_straight:
            return course.horizon, course, None
        point = vanishing_point_of(seen, self._camera, self._horizon)
        if point is None:
            refuse_misplaced(seen, self._camera, self._horizon)
            return self._horizon, course, 0
        return weighted_mean(self._horizon, point.horizon), course, point.lines

    def _rejection_reason(self, uneven: UnevenFit, sky: Sky, curves: StripCurves, free: float, tracked: float) -> str:
        """Say why a fit is not to be believed; empty if it is."""
        fit = uneven.fit
        if fit.road >= (1.0 - LEAST_CONTRAST) * fit.airlight or fit.road >= 0.98 * sky.luminance:
            return "the road is nearly as bright as the airlight, or brighter"
        if fit.misfit > MAX_MISFIT:
            return "the road fades, but not as Koschmieder's law has it"
        if self._is_hidden(fit, curves, free):
            return "the road ahead is hidden, or is none"
        if why := no_road(fit, curves, self._geometry, self._camera):
            return why
        return _too_little_seen(uneven, tracked)

    def _is_hidden(self, fit: JointFit, curves: StripCurves, free: float) -> bool:
        """Whether too little of the own lane, as far as it is free, fits a road."""
        near = (curves.variance[0] > 0) & (self._geometry.distance < min(free, 1.5 / max(fit.extinction, 0.01)))
        rows = np.count_nonzero(near)
        return bool(rows < MIN_ROWS // 2 or np.count_nonzero(fit.used[0] & near) / rows < _MIN_USED)

    def _estimate(
        self,
        uneven: UnevenFit,
        front: tuple[float, float, float] | None,
        found: dict[str, object],
        unsure: float,
        changing: float,
    ) -> Estimate:
        fit = uneven.fit
        unevenness = math.hypot(_unevenness(uneven), changing)
        horizon = self._camera.horizon_row + fit.shift
        used, geometry = fit.used[0], self._geometry
        rows, left = geometry.first[used].tolist(), geometry.left[0][used].tolist()
        right = geometry.right[0][used].tolist()
        found |= {"horizon_row": horizon, "airlight": fit.airlight, "road": fit.road, "misfit": fit.misfit}
        found["band"] = (int(min(left)), int(max(right)), min(rows), int(geometry.last[0]))
        extinction = max(fit.extinction, 0.0)
        if extinction > 0:
            found["inflection_row"] = horizon + 0.5 * extinction * self._camera.row_distance
        found["evenness"], found["darkening"], found["shaded"] = uneven.even, fit.darkening_chance, self._shaded
        return Estimate(
            self.method,
            extinction,
            math.hypot(_deviation(fit), unevenness * extinction, unsure),
            diagnostics=found,
            reach=uneven.reach,
            optical_depths=_optical_depths(uneven, unevenness),
            denser=None if front is None else DenserFog(*front),
            # Fog that changes along the way is read with the same error until it has been passed.
            common_deviation=math.sqrt(max(unevenness**2 - _HARDLY_UNEVEN**2, 0.0)),
        )


def _too_little_seen(uneven: UnevenFit, tracked: float) -> str:
    """Why too little is seen of a road that should be free up to a depth; empty if it is enough."""
    fit = uneven.fit
    if math.isinf(tracked) and fit.extinction > CLEAR and uneven.reach * fit.extinction < _LEAST_DEPTH:
        return "something hides all lanes, or shade lies on them"
    deviation = math.hypot(_deviation(fit), _unevenness(uneven) * fit.extinction)
    if fit.extinction < _SURE_OF_FOG * deviation and fit.extinction + 2.0 * deviation > CLEAR:
        return "the extinction is not observable: too little road is seen"
    return ""


def _deviation(fit: JointFit) -> float:
    """Standard deviation of the extinction, what the model leaves out included [1/m]."""
    model = MODEL_DEVIATION * fit.extinction
    return math.hypot(_OVERCONFIDENCE * fit.extinction_deviation, model, _LEAST_DEVIATION)


def _unevenness(uneven: UnevenFit) -> float:
    """Relative deviation of a mean extinction by unevenness of the fog that the fit leaves out [-]."""
    return math.hypot(_HARDLY_UNEVEN, _UNEVEN_DEVIATION * (1.0 - uneven.even))


def _optical_depths(uneven: UnevenFit, unevenness: float) -> OpticalDepths:
    """How the fog varies, what the model leaves out included in its deviations."""
    model = math.hypot(MODEL_DEVIATION, unevenness)
    deviation = np.hypot(_OVERCONFIDENCE * uneven.deviation, model * uneven.depth)
    deviation = np.hypot(deviation, _LEAST_DEVIATION * uneven.distance)
    return OpticalDepths(tuple(uneven.distance.tolist()), tuple(uneven.depth.tolist()), tuple(deviation.tolist()))


def _obstacle(fit: JointFit, geometry: StripGeometry) -> float:
    """Depth at which something stands in the own lane that the fit has found to hide what is behind [m]."""
    if not fit.hidden.any():
        return math.inf
    road = fit.used[0] & (geometry.distance < float(geometry.distance[np.argmax(fit.hidden)]))
    return float(geometry.distance[road].max()) if road.any() else math.inf
