"""Fog by the own head lamps: veil and road fitted together to what they light."""

import math
from collections import deque
from dataclasses import replace
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.estimators.image_check import ObservationCheck
from fogsim.estimators.night.cells import CellMeans, camera_of_cells, cell_means, cell_size
from fogsim.estimators.night.reference_file import HEAD_LAMPS, References
from fogsim.estimators.night.references import VeilReferences
from fogsim.estimators.night.veil_fit import Parts, VeilFit, fit_veil
from fogsim.estimators.protocol import Calibrations
from fogsim.parameters import Range, checked_parameters
from fogsim.units import extinction_from_visibility
from fogsim.values.camera import Camera
from fogsim.values.estimate import Estimate, ExtinctionBounds
from fogsim.values.light import Lamp
from fogsim.values.observation import Observation
from fogsim.vision.light.daylight import darkens_ahead
from fogsim.vision.light.luminance import linear_pixels
from fogsim.vision.light.pixel_kernels import Pixels
from fogsim.vision.lines.horizon import PITCH_DEVIATION, PitchDeviation, levelled

NEAREST, FARTHEST, HALF_LANE = 5.0, 80.0, 1.4
"""The road is looked at between these distances, and so far to the left and right of the own middle [m]."""

LOW_SKY, HIGH_SKY, HALF_SKY = 0.015, 0.25, 0.5
"""The fog above the road is looked at between these angles above the horizon, and so far aside [rad]."""

LEAST_CELLS = 150
"""Fewer cells show neither veil nor road."""

LEAST_PEAK = 8.0
"""Luminance that something must have for there to be head lamps' light [linear grey levels]."""

LEAST_EXPLAINED = 0.93
"""Share of the cells' variance that veil, road and even light must explain, or other light lights them [-]."""

NOT_BY_OWN_LAMPS = "other light than that of the own head lamps"
"""Why an image is refused."""

MOST_EVEN = 0.5
"""Share of the brightest cells that light may have that is the same everywhere: by day it is most of the light [-]."""

ROAD_DEVIATION = 0.35
"""Deviation of ln of what asphalt returns [-]: 5 to 30 mcd/(lx m²), gallen2014."""

INDEPENDENT = 60.0
"""Number of cells that err independently of one another, of all in use; what the model leaves out is smooth."""

LEAST_MISFIT = 0.05
"""Mean squared deviation below which a picture only by chance fits better [-]."""

MODEL_DEVIATION = 0.03
"""Deviation of ln k by what no picture shows: aim and pattern of the lamps, mount of the camera [-]."""

LEAST_DEVIATION = 1e-3
"""Deviation of k by what else is lit: verges, trees, signs [1/m]."""

LEAST_WEIGHT = 0.85
"""Mean weight of the cells below which others' lamps shine over too much of the picture [-]."""

OUTSHONE = 1.0
"""Deviation of ln k by lamps of others, over the weight that the cells have lost to them [-]."""

BETWEEN = 9
"""References that are interpolated about the likeliest one."""

UNLIKELY = 4.0
"""By how much ln of the likelihood of droplets is below the largest where they no longer count [-]."""

MOST_UNSURE = 0.5
"""Deviation of ln k from which on no fog is seen rather than some [-]."""

CLEAR_BUT_FOR = 2.0
"""By how much ln of the likelihood of some fog must exceed that of none for it to be seen [-]."""

LEAD_HALF_WIDTH, LEAD_HEIGHT, CLOSEST_LEAD = 1.5, 4.0, 8.0
"""What a vehicle ahead covers at most, and how near it leaves too little [m]."""

NORMAL_95_PERCENT = 1.645


class _Cells(NamedTuple):
    """Where cells look: angle below the horizon and to the right of the axis [rad]; which see sky, which are of use."""

    below: NDArray[np.float64]
    aside: NDArray[np.float64]
    sky: NDArray[np.bool_]
    used: NDArray[np.bool_]


class _Seen(NamedTuple):
    """The cells that tell: their luminance, where they are, and the deviation of dark ones [grey levels]."""

    luminance: NDArray[np.float64]
    used: NDArray[np.bool_]
    floor: float


@checked_parameters
class NightRoad:
    """Extinction by night from the light of the own head lamps: in the fog, and on the road behind it.

    The linear picture is taken by cells as a veil(V) + b road(V) + c: what the fog returns of the lamps' light, what
    the road returns of what gets there and back, and even light of anything else. Pictures of veil and road for many
    visibilities come from the night model, for the told camera and the own lamps that are lit; a, b, c ≥ 0 and a small
    error of the told pitch are fitted for each, so neither the camera's exposure nor the road's albedo needs be known,
    though b / a must be that of some asphalt; and so for four kinds of droplets. Where others' lamps shine, cells are
    brighter than the model, and count less. About the likeliest reference more of them are interpolated; the visibility
    is the likeliest of these, over the droplets that are likely.

    Own method. gallen2014 compares shapes alone, by correlation, which in thin fog hardly depend on the visibility, and
    amplitude alone is that of two visibilities; together they tell both.

    Parameters
    ----------
    camera : Camera
        The assumed calibration.
    references : str or None
        File of ``fogsim calibrate veil``; None for a car's usual lamps, whose references are computed
        once for each camera and set of lamps.
    pitch_deviation : float
        Standard deviation of the true pitch about the assumed one [rad].
    frames : int
        How many of the last frames are averaged: noise and lane marks go, and a change of fog is seen later.

    Raises
    ------
    InputError
        If a parameter is out of range, or the file cannot be read or is of another camera.
    """

    method = "night_road"

    def __init__(
        self,
        camera: Camera,
        *,
        references: str | None = None,
        pitch_deviation: PitchDeviation = PITCH_DEVIATION,
        frames: Annotated[int, Range(1, 1000)] = 3,
    ) -> None:
        self._camera, self._check = camera, ObservationCheck(camera)
        self._references = References(camera, references)
        self._shift = pitch_deviation * camera_of_cells(camera).focal_length
        self._cells = _cells(camera)
        self._frames = int(frames)
        self.reset()

    def take_calibrations(self, source: Calibrations) -> None:
        """Take references from a source where no file was named."""
        self._references.source = source.veil_references

    def reset(self) -> None:
        """Forget all earlier frames."""
        self._check.reset()
        self._earlier: deque[CellMeans] = deque(maxlen=self._frames)
        self._lit: Lamp | None = None

    def update(self, observation: Observation) -> Estimate:
        """Estimate the fog from one image, the lamps that are lit, and the range of the lead vehicle if it is tracked.

        Parameters
        ----------
        observation : Observation
            Its image, lead, lamps and the camera's place are used; if it does not tell lamps, low beams are assumed.

        Returns
        -------
        Estimate
            Diagnostics: ``veil`` and ``road`` [linear grey levels per cd/m²], ``even`` [linear grey levels],
            ``explained`` [-] and ``droplets``; or ``reason``.

        Raises
        ------
        InputError
            If camera, image or time do not fit (see `fogsim.estimators.image_check`).
        """
        image = self._check.kernel_image(observation)
        lit = HEAD_LAMPS & (Lamp.LOW_BEAM if observation.lamps is None else observation.lamps)
        if not lit:
            return Estimate.invalid(self.method, "no head lamp is lit: this is a method for the night")
        if lit != self._lit:
            self._earlier.clear()
            self._lit = lit
        if observation.lead is not None and observation.lead.distance < CLOSEST_LEAD:
            return Estimate.invalid(self.method, "a vehicle close ahead hides the road")
        self._earlier.append(cell_means(linear_pixels(_green(image), self._camera), cell_size(self._camera)))
        means = _mean(self._earlier)
        used = self._cells.used & ~means.clipped & ~self._hidden(observation)
        if why := _too_little(means, used, self._cells.sky):
            return Estimate.invalid(self.method, why)
        references = self._references.find(lit, observation.camera_setback)
        if not references:
            return Estimate.invalid(self.method, "it has no references; fogsim calibrate veil makes them")
        floor = max(1.0, float(np.quantile(means.luminance, 0.05)))
        found = self._estimate(_Seen(means.luminance[used], used, floor), references)
        high = bool(lit & Lamp.HIGH_BEAM)
        if found.valid and not high and not darkens_ahead(levelled(image, self._camera), self._camera):
            return Estimate.invalid(self.method, NOT_BY_OWN_LAMPS, **found.diagnostics)
        return found

    def _hidden(self, observation: Observation) -> NDArray[np.bool_]:
        """Cells that the vehicle ahead may cover."""
        if observation.lead is None:
            return np.zeros(self._cells.used.shape, np.bool_)
        height, depth = self._camera.mount_height, observation.lead.distance + observation.camera_setback
        below, aside = self._cells.below * depth, np.abs(self._cells.aside) * depth
        hidden: NDArray[np.bool_] = (below < height) & (below > height - LEAD_HEIGHT) & (aside < LEAD_HALF_WIDTH)
        return hidden

    def _fit(self, seen: _Seen, references: VeilReferences) -> VeilFit:
        # By rows, as those are of which one reference is made of three: one kernel is compiled for both.
        kinds = (references.veil, references.road, *references.slopes)
        parts = Parts(*(np.ascontiguousarray(part[:, seen.used]) for part in kinds))
        return fit_veil(seen.luminance, seen.floor, parts, self._shift)

    def _estimate(self, seen: _Seen, references: tuple[VeilReferences, ...]) -> Estimate:
        fits = [self._fit(seen, one) for one in references]
        least = max(min(float(fit.misfit.min()) for fit in fits), LEAST_MISFIT)
        likelihoods = np.array([_log_likelihood(fit, least) for fit in fits])
        kind, best = np.unravel_index(int(np.argmax(likelihoods)), likelihoods.shape)
        fit = fits[kind]
        veil, road, even, _ = fit.amplitude[best].tolist()
        found: dict[str, object] = {"veil": veil, "road": road, "even": even, "explained": fit.explained}
        found["droplets"] = references[kind].droplets
        if fit.explained < LEAST_EXPLAINED or even > MOST_EVEN * float(seen.luminance.max()):
            return Estimate.invalid(self.method, NOT_BY_OWN_LAMPS, **found)
        outshone = 1.0 - float(fit.weight.mean())
        if outshone > 1.0 - LEAST_WEIGHT:
            return Estimate.invalid(self.method, "lamps of others outshine what the own ones light", **found)
        extinction = np.array([extinction_from_visibility(one) for one in references[0].visibility.tolist()])
        if best == 0:
            reason = "fog so dense that only the densest reference is like it"
            bounds = ExtinctionBounds(least=float(extinction[1]))
            return replace(Estimate.invalid(self.method, reason, **found), bounds=bounds)
        likely = np.flatnonzero(likelihoods.max(axis=1) > likelihoods.max() - UNLIKELY)
        peaks = [self._refined(seen, references[one], likelihoods[one], least) for one in likely.tolist()]
        log_extinction, deviation = _together(peaks)
        some, none = likelihoods[:, :-1].max(), likelihoods[:, -1].max()
        if none > some - CLEAR_BUT_FOR or deviation > MOST_UNSURE:
            most = _most(extinction, np.logaddexp.reduce(likelihoods, axis=0))
            return Estimate(self.method, 0.0, most / NORMAL_95_PERCENT, diagnostics=found)
        value = math.exp(log_extinction)
        relative = math.hypot(deviation, MODEL_DEVIATION, OUTSHONE * outshone)
        deviation = math.hypot(value * relative, LEAST_DEVIATION)
        return Estimate(self.method, value, deviation, diagnostics=found)

    def _refined(
        self, seen: _Seen, references: VeilReferences, likelihood: NDArray[np.float64], least: float
    ) -> tuple[float, float, float]:
        """Where the likelihood of a kind of droplets is largest in ln k, its deviation, and how large it is there."""
        place = np.log([extinction_from_visibility(one) for one in references.visibility[:-1].tolist()])
        best = min(max(int(np.argmax(likelihood[:-1])), 1), len(place) - 2)
        # Lagrange's polynomials through three references.
        at = np.linspace(-1.0, 1.0, BETWEEN)[:, None]
        shares = np.concatenate((0.5 * at * (at - 1.0), 1.0 - at**2, 0.5 * at * (at + 1.0)), axis=1)
        parts = (references.veil, references.road, *references.slopes)
        near = Parts(*((shares[:, :, None] * part[None, best - 1 : best + 2, seen.used]).sum(axis=1) for part in parts))
        finer = _log_likelihood(fit_veil(seen.luminance, seen.floor, near, self._shift), least)
        places = (shares * place[best - 1 : best + 2]).sum(axis=1)
        return (*_peak(places, finer), float(finer.max()))


def _cells(camera: Camera) -> _Cells:
    cells = camera_of_cells(camera)
    row, col = np.mgrid[: cells.height, : cells.width].astype(np.float64)
    below = (row - cells.horizon_row) / cells.focal_length
    aside = (col - cells.principal_point[0]) / cells.focal_length
    distance = camera.mount_height / np.maximum(below, 1e-6)
    road = (distance > NEAREST) & (distance < FARTHEST) & (np.abs(aside * distance) < HALF_LANE)
    sky = (below < -LOW_SKY) & (below > -HIGH_SKY) & (np.abs(aside) < HALF_SKY)
    return _Cells(below, aside, sky, road | sky)


def _green(image: Pixels) -> Pixels:
    """The image in green light: tail lamps are red, and so is their glow."""
    if image.ndim == 2:
        return image
    green: NDArray[Any] = np.ascontiguousarray(image[:, :, 1])
    return green


def _mean(frames: deque[CellMeans]) -> CellMeans:
    luminance = np.mean([frame.luminance for frame in frames], axis=0)
    return CellMeans(luminance, np.logical_or.reduce([frame.clipped for frame in frames]))


def _too_little(means: CellMeans, used: NDArray[np.bool_], sky: NDArray[np.bool_]) -> str:
    """Why nothing can be told from the cells of use; empty if something may."""
    if np.count_nonzero(used) < LEAST_CELLS or not sky.any():
        return "too little is seen that is neither too bright nor too dark"
    bright = float(np.quantile(means.luminance[used], 0.99))
    if bright < LEAST_PEAK:
        return "too dark: the head lamps light nothing"
    if float(np.median(means.luminance[sky])) > MOST_EVEN * bright:
        return "light of the day, or of lamps all around"
    return ""


def _log_likelihood(fit: VeilFit, least: float) -> NDArray[np.float64]:
    """Of each reference, with what is known of roads, where the best one of all has the given misfit."""
    veil, road = np.maximum(fit.amplitude[:, 0], 1e-9), np.maximum(fit.amplitude[:, 1], 1e-9)
    unusual = np.minimum(np.abs(np.log(road / veil)) / ROAD_DEVIATION, 4.0)
    # Where there is no veil nothing is known of its amplitude.
    return -0.5 * (INDEPENDENT * fit.misfit / least + np.where(fit.amplitude[:, 0] > 0.0, unusual**2, 0.0))


def _together(peaks: list[tuple[float, float, float]]) -> tuple[float, float]:
    """Mean and deviation over kinds of droplets, each with mean, deviation and ln of its likelihood."""
    mean, deviation, likelihood = np.array(peaks).T
    weight = np.exp(likelihood - likelihood.max())
    weight /= weight.sum()
    middle = float((weight * mean).sum())
    return middle, math.sqrt(float((weight * (deviation**2 + (mean - middle) ** 2)).sum()))


def _peak(place: NDArray[np.float64], likelihood: NDArray[np.float64]) -> tuple[float, float]:
    """Place of the largest likelihood by a parabola through its neighbours, and the deviation that it has there."""
    best = min(max(int(np.argmax(likelihood)), 1), len(place) - 2)
    before, here, after = likelihood[best - 1 : best + 2].tolist()
    left, right = place[best] - place[best - 1], place[best + 1] - place[best]
    rise, fall = (here - before) / left, (after - here) / right
    curvature = 2.0 * (fall - rise) / (left + right)
    if curvature >= 0.0:
        return float(place[int(np.argmax(likelihood))]), math.inf
    slope = (rise * right + fall * left) / (left + right)
    step = -slope / curvature
    farthest = min(abs(left), abs(right))
    return float(place[best] + min(max(step, -farthest), farthest)), 1.0 / math.sqrt(-curvature)


def _most(extinction: NDArray[np.float64], likelihood: NDArray[np.float64]) -> float:
    """Extinction coefficient below which 95 % of the likelihood are, that of the thinnest fog at least [1/m]."""
    order = np.argsort(extinction)
    weight = np.exp(likelihood[order] - likelihood.max())
    most = float(np.interp(0.95, np.cumsum(weight) / weight.sum(), extinction[order]))
    return max(most, float(extinction[order[1]]))
