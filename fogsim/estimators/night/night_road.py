"""Fog by the own head lamps: one model of veil, lit road, daylight and dark offset, averaged over its unknowns."""

import math
from collections import deque
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from fogsim.core.parameters import Range, checked_parameters
from fogsim.errors import InputError, shown
from fogsim.estimators.image_check import ObservationCheck
from fogsim.estimators.night.light_fit import Fit, Measured, Templates, log_likelihoods, robust_weights
from fogsim.estimators.night.own_light import (
    FORGOTTEN,
    KNOWN_HEAD_LAMPS,
    SKY,
    VISIBILITIES,
    HeadLamps,
    OwnLight,
    Seen,
    calibrated_view,
    cell_luminance,
    cells_of,
    lit_head_lamps,
    setback_of,
    without_cut_noise,
)
from fogsim.estimators.protocol import Calibrations
from fogsim.units import extinction_from_visibility
from fogsim.values.camera import Camera
from fogsim.values.estimate import NORMAL_90_PERCENT, Estimate, ExtinctionBounds
from fogsim.values.light import Lamp
from fogsim.values.observation import Observation
from fogsim.vision.light.luminance import linear_table
from fogsim.vision.light.pixel_kernels import Pixels

DAYLIGHT, _NIGHT = 100.0, 0.003
"""Illuminance of the sky from which methods of the day take over, and below which it lights nothing [lx]."""

_LEAST_CELLS, _LEAST_ROAD = 40, 6
"""Fewer cells, and fewer of the road, show neither veil nor road."""

_LEAST_PEAK = 0.02
"""Luminance that something must have for there to be head lamps' light, full scale being 1 [-]."""

_MOST_CLIPPED = 0.02
"""Share of a cell's pixels that may be clipped [-]."""

_ROAD_TEXTURE, _SKY_TEXTURE, _LEVEL, _FLOOR = 0.1, 0.2, 0.02, 2e-4
"""Deviations of the model: over what is seen of road and sky, over the mean of all cells, and of full scale [-]."""

_INDEPENDENT = {True: 24.0, False: 6.0}
"""Number of cells that err independently, where all of the road is seen, by whether the beam is known [-]."""

MOST_MISFIT, _LEAST_WEIGHT = {True: 2.0, False: 2.5}, 0.6
"""Mean squared deviation above which other light is seen, by whether the beam is known, and mean weight of the cells
below which lamps of others shine over too much of the image [-]."""

_PEDESTAL = 6e-4
"""Standard deviation of the sensor's dark offset and of light that the lens scatters evenly, of full scale [-]."""

LEAST_LAMPLIGHT = 0.5
"""Share of the light that the own lamps must give by night, and where no sensor reports the daylight [-]."""

_OUTSHONE = "lamps of others outshine what the own ones light"

_ROUNDS, _SETTLED = 4, 0.05
"""How often weights of the cells are found again, and changes of them that change nothing [-]."""

_CLEAR, _MAY_BE_CLEAR = 2000.0, {True: 0.15, False: 0.05}
"""Visibility above which own lamps show no fog [m], and its probability from which on there is no upper bound [-], by
whether the beam is known."""

_GLOW_POWERS, _GLOW_FLATNESS = (1.2, 1.4, 1.6, 1.8, 2.0), (1.0, 2.0**0.25, 2.0**0.5)
_GLOW_DISTANCES = (20.0, 36.3, 66.0, 120.0)
"""Shapes of the glow of others' lamps: power of the angle by which it falls, how much faster it falls upward and
downward than sideways, for head lamps shine little above the horizon, and distance of the lamps [m]."""

_GLOWS_KEPT, _GLOW_SAMPLE, _SAMPLE = 6, (15, 6), (5, 2)
"""How many shapes that are like an image are used; and the steps between the draws and visibilities that find
these, and the weights of the cells."""

_LAMPS_FROM, HALO = 40.0, 0.03
"""Distance on the road beyond which what is clipped may be a lamp [m], and how far from it cells are left out [rad]:
chosen by `benchmarks/night_lamps.py --choose`."""

_HIGH_LAMPS, _STREET_LIGHT = 0.07, 10.0
"""Slope upward beyond which lamps are those of a street [-], and daylight that is about as much as theirs [lx]."""

_MAY_BE_DENSER = 0.25
"""Probability of the densest fog of the model from which on there may be denser fog [-]."""

_LEAD_HALF_WIDTH, _LIT_HALF_WIDTH, _LEAD_HEIGHT, _LEAD_MARGIN, _CLOSEST_LEAD = 1.5, 1.2, 4.0, 0.4, 8.0
"""What a vehicle ahead covers at most, and half the width of its rear, below its wheels too, for they and the pitch are
not known, and how near it leaves too little [m]."""

COMMON, _MOST_COMMON = 0.95, 0.5
"""Part of the deviation of ln V that is of own lamps, droplets and pavement, the same in all frames of a drive, and the
most that it is where lamps of others shine, whose glow is another in each frame [-]."""

_MOSTLY_DAYLIGHT, _BY_DAYLIGHT = 0.5, (4.0, 0.7)
"""Share of lamplight below which daylight outshines the own lamps; there, the power whose mean of the likelihood over
draws is taken, for fog that hides what the lamps light fits with any lamps, which is no evidence for it; and what the
result is raised to, for pavement and sky by day err in ways of their own: chosen on pool 0 of
`benchmarks/night_estimators.py` and on rural_night_alone while night falls."""

_BOUND_SOFTNESS = 0.1
"""Standard deviation of bounds in ln k [-]."""

Floats = NDArray[np.float64]
_Sample = tuple[Floats, Templates, Templates, Templates]


@checked_parameters
class NightRoad:
    """Extinction by night from the light of the own head lamps: in the fog, and on the road behind it.

    Linear luminance of some rectangles of sky and road is explained as veil, lit road, daylight that is left, and an
    even dark offset. What a vehicle does not know is drawn, once for each camera and set of lamps: aim and intensity of
    the beam, pitch, height of the lamps, where the veil begins, droplets, how light that is scattered more than once
    spreads, how the pavement returns it, and crest or sag. The posterior is the mean over the draws, with amplitudes of
    the light fitted in each. Where it leaves clear air possible the estimate is not valid and has a bound.

    Own method: both the shape and the amplitude of the light count.

    Parameters
    ----------
    camera : Camera
        The assumed calibration.
    head_lamps : str
        "usual" for a car's, "unknown" for low beams of any pattern, or a file of lamps (docs/explanation/night.md).
    frames : int
        How many of the last frames are averaged: noise and lane marks go, and a change of fog is seen later.

    Raises
    ------
    InputError
        If a parameter is out of range, or there is no such file.
    """

    method = "night_road"

    def __init__(
        self,
        camera: Camera,
        *,
        head_lamps: HeadLamps = "usual",
        frames: Annotated[int, Range(1, 1000)] = 3,
    ) -> None:
        if head_lamps not in KNOWN_HEAD_LAMPS and not Path(head_lamps).is_file():
            raise InputError(f"head_lamps must be usual, unknown or a file, got {shown(head_lamps)}")
        self._camera, self._check = camera, ObservationCheck(camera)
        self._lamps, self._frames = head_lamps, int(frames)
        self._source: Calibrations | None = None
        self._own: tuple[tuple[Lamp, float], OwnLight] | None = None
        self._view = calibrated_view(camera)
        self._cells = cells_of(self._view)
        rays = self._cells.rays.mean(axis=1)
        self._depth = np.where(self._cells.is_sky, np.inf, camera.mount_height / np.maximum(-rays[:, 2], 1e-3))
        self._up = np.where(self._cells.is_sky, np.arcsin(rays[:, 2]) / SKY[0][-1], 0.0)
        self._aside = rays[:, 1] / rays[:, 0]
        self._below = -rays[:, 2] / rays[:, 0]
        self.reset()

    def take_calibrations(self, source: Calibrations) -> None:
        """Take what the lamps light from a source."""
        self._source = source

    def reset(self) -> None:
        """Forget all earlier frames."""
        self._check.reset()
        self._earlier: deque[tuple[Seen, NDArray[np.bool_], Floats, bool]] = deque(maxlen=self._frames)
        self._in_street = False
        self._lit: Lamp | None = None
        self._time = 0.0

    def update(self, observation: Observation) -> Estimate:
        """Estimate the fog from one image, the lamps that are lit, and the range of the lead vehicle if it is tracked.

        Parameters
        ----------
        observation : Observation
            Its image, lead, lamps, light and the camera's place are used; without lamps, low beams are assumed.

        Returns
        -------
        Estimate
            Diagnostics: ``visibility_quantiles``, of 5, 50 and 95 % [m], ``misfit``, mean squared deviation [-],
            ``lamplight``, share of the light that is the lamps' [-], and ``weight``, mean of the cells; or ``reason``.

        Raises
        ------
        InputError
            If camera, image or time do not fit (see `fogsim.estimators.image_check`).
        """
        image = self._check.kernel_image(observation)
        lit = lit_head_lamps(observation)
        light = math.nan if observation.light is None else observation.light.illuminance
        if why := _why_not(observation, lit, light):
            return Estimate.invalid(self.method, why)
        if lit != self._lit or observation.time - self._time > FORGOTTEN:
            self._earlier.clear()
        self._lit, self._time = lit, observation.time
        seen, beside, others = self._look(image, observation)
        hidden = self._hidden(observation, self._below, self._aside, _LEAD_HALF_WIDTH)
        used = (seen.clipped < _MOST_CLIPPED) & ~hidden & ~beside
        if why := _too_little(seen, used, self._cells.is_sky):
            return Estimate.invalid(self.method, why)
        if self._source is None:
            return Estimate.invalid(self.method, "it has no calibration; fogsim.estimators.make supplies one")
        wanted = lit, setback_of(observation)
        if self._own is None or self._own[0] != wanted:
            self._own = wanted, self._source.own_light(self._view, *wanted, self._lamps)
        return self._estimate(
            self._measured(seen, used, light, np.ascontiguousarray(others[:, used])),
            _of_cells(self._own[1], used),
            used,
        )

    def _look(self, image: Pixels, observation: Observation) -> tuple[Seen, NDArray[np.bool_], Floats]:
        """Means of the last frames in green light, for tail lamps are red; cells near others' lamps, and their glow."""
        green: NDArray[Any] = image if image.ndim == 2 else np.ascontiguousarray(image[:, :, 1])
        table = linear_table(self._camera.response, self._camera.bits, self._camera.black_level).copy()
        self._earlier.append(
            (cell_luminance(green, table, self._cells.box), *self._lamps_of_others(green, observation))
        )
        frames, beside, glows, high = zip(*self._earlier, strict=True)
        glow, self._in_street = np.mean(glows, axis=0), any(high)
        seen = Seen(*(np.mean(part, axis=0) for part in zip(*frames, strict=True)))
        return without_cut_noise(seen), np.any(beside, axis=0), glow if glow.any() else glow[:0]

    def _hidden(self, observation: Observation, below: Floats, aside: Floats, half_width: float) -> NDArray[np.bool_]:
        """Which directions, as slopes downward and aside, the vehicle ahead may cover (`half_width` [m])."""
        if observation.lead is None:
            return np.zeros(len(below), np.bool_)
        height, depth = self._camera.mount_height, observation.lead.distance + observation.camera_setback
        upright = (below * depth < height + _LEAD_MARGIN) & (below * depth > height - _LEAD_HEIGHT)
        return np.asarray(upright & (np.abs(aside) * depth < half_width))

    def _lamps_of_others(self, green: NDArray[Any], observation: Observation) -> tuple[NDArray[np.bool_], Floats, bool]:
        """Cells near lamps of others, which are clipped, shapes that their glow may have, and whether some are high."""
        camera = self._camera
        end = max(min(round(camera.horizon_row + camera.row_distance / _LAMPS_FROM), camera.height), 0)
        v, u = np.nonzero(green[:end] >= 2**camera.bits - 1)
        # Squares of some pixels are fine enough.
        step = max(camera.width // 80, 1)
        square, count = np.unique((v // step) * 4096 + u // step, return_counts=True)
        below = (step * (square // 4096 + 0.5) - camera.horizon_row) / camera.focal_length
        aside = (camera.principal_point[0] - step * (square % 4096 + 0.5)) / camera.focal_length
        high = bool((below < -_HIGH_LAMPS).any())
        near = (np.hypot(self._below[:, None] - below, self._aside[:, None] - aside) < HALO).any(axis=1)
        # What the own lamps light of the vehicle ahead is clipped, but does not glow.
        others = ~self._hidden(observation, below, aside, _LIT_HALF_WIDTH)
        below, aside, count = below[others], aside[others], count[others]
        below, aside = self._below[:, None] - below, self._aside[:, None] - aside
        edge = np.sqrt(count / math.pi) / camera.focal_length
        before = np.minimum(1.0, self._depth / np.array(_GLOW_DISTANCES)[:, None])
        glow = []
        for flatness in _GLOW_FLATNESS:
            fall = np.log(edge / np.maximum(np.hypot(flatness * below, aside), edge))
            glow += [before * np.exp(power * fall).sum(axis=1) for power in _GLOW_POWERS]
        return near, np.concatenate(glow), high

    def _measured(self, seen: Seen, used: NDArray[np.bool_], light: float, others: Floats) -> Measured:
        luminance, is_sky = seen.luminance[used], self._cells.is_sky[used]
        # The light of a street's lamps is alike that of the day, but no sensor reports it.
        reported = light >= _STREET_LIGHT if self._in_street else not math.isnan(light)
        lamp_scale = light / math.pi if reported and light > _NIGHT else 0.0
        sky = float(luminance[is_sky].mean()) if is_sky.any() else float(luminance.min())
        sky_scale = 0.0 if reported else sky
        seen_road = np.count_nonzero(~is_sky) / np.count_nonzero(~self._cells.is_sky)
        scales = sky_scale, lamp_scale, _PEDESTAL, _INDEPENDENT[self._lamps != "unknown"] * seen_road
        return Measured(luminance, self._up[used], others, *scales)

    def _estimate(self, measured: Measured, own: OwnLight, used: NDArray[np.bool_]) -> Estimate:
        extinction = np.array([extinction_from_visibility(one) for one in VISIBILITIES.tolist()])
        is_sky, seen = self._cells.is_sky[used], measured.seen
        variance = (np.where(is_sky, _SKY_TEXTURE, _ROAD_TEXTURE) * seen) ** 2 + _FLOOR**2 + (_LEVEL * seen.mean()) ** 2
        weight, best = np.ones(len(seen)), Fit(np.empty(len(seen)), np.empty(2))
        sample = _sample(own, extinction, *_SAMPLE)
        if len(measured.others) > _GLOWS_KEPT:
            measured = _with_likely_glows(measured, _sample(own, extinction, *_GLOW_SAMPLE), variance)
        for _ in range(_ROUNDS):
            log_likelihoods(measured, *sample, variance, weight, best, 1)
            earlier, weight = weight, robust_weights(seen, best.luminance, variance)
            if np.abs(weight - earlier).max() < _SETTLED:
                break
        found = log_likelihoods(measured, extinction, own.veil, own.road, own.depth, variance, weight, best, 1)
        misfit, lamplight = best.summary.tolist()
        power, doubt = _BY_DAYLIGHT if lamplight < _MOSTLY_DAYLIGHT else (1.0, 1.0)
        likelihood = np.exp(power * (found[0] - found.max())).mean(axis=0) ** (doubt / power)
        share = likelihood / likelihood.sum()
        low, middle, high = _quantiles(share)
        diagnostics: dict[str, object] = {"visibility_quantiles": (low, middle, high), "misfit": misfit}
        diagnostics |= {"lamplight": lamplight, "weight": float(weight.mean())}
        if misfit > MOST_MISFIT[self._lamps != "unknown"]:
            return Estimate.invalid(self.method, "other light than that of the own head lamps", **diagnostics)
        if measured.lamp_scale == 0.0 and lamplight < LEAST_LAMPLIGHT:
            others = "light of the day, or of lamps all around" if measured.sky_scale > 0.0 else _OUTSHONE
            return Estimate.invalid(self.method, others, **diagnostics)
        if weight.mean() < _LEAST_WEIGHT:
            return Estimate.invalid(self.method, _OUTSHONE, **diagnostics)
        widened = math.exp(NORMAL_90_PERCENT * _BOUND_SOFTNESS)
        if share[VISIBILITIES > _CLEAR].sum() > _MAY_BE_CLEAR[self._lamps != "unknown"]:
            bounds = ExtinctionBounds(most=extinction_from_visibility(low) / widened, softness=_BOUND_SOFTNESS)
            reason = f"own lamps show no fog for certain, and visibility is at least {low:.0f} m"
            return replace(Estimate.invalid(self.method, reason, **diagnostics), bounds=bounds)
        if share[0] > _MAY_BE_DENSER:
            reason = "fog so dense that only the densest of the model is like it"
            bounds = ExtinctionBounds(least=extinction_from_visibility(high) * widened, softness=_BOUND_SOFTNESS)
            return replace(Estimate.invalid(self.method, reason, **diagnostics), bounds=bounds)
        value = extinction_from_visibility(middle)
        deviation = (extinction_from_visibility(low) - value) / NORMAL_90_PERCENT
        common = COMMON * 0.5 * math.log(high / low) / NORMAL_90_PERCENT
        if len(measured.others) > 0:
            common = min(common, _MOST_COMMON)
        return Estimate(self.method, value, deviation, diagnostics=diagnostics, common_deviation=common)


def _why_not(observation: Observation, lit: Lamp, light: float) -> str:
    """Why an image is not looked at, by the lamps that are lit and the light [lx]; empty if it is."""
    if not lit:
        return "no head lamp is lit: this is a method for the night"
    if light > DAYLIGHT:
        return f"{light:.0f} lx of daylight: this is a method for the night"
    if observation.lead is not None and observation.lead.distance < _CLOSEST_LEAD:
        return "a vehicle close ahead hides the road"
    return ""


def _sample(own: OwnLight, extinction: Floats, *every: int) -> _Sample:
    """Extinctions, veil, road and depth of some draws and visibilities."""
    draws, places = (slice(None, None, step) for step in every)
    chosen = extinction[places], own.veil[draws, places], own.road[draws, places], own.depth[draws]
    extinctions, veil, road, depth = map(np.ascontiguousarray, chosen)
    return extinctions, veil, road, depth


def _with_likely_glows(measured: Measured, sample: _Sample, variance: Floats) -> Measured:
    """The image with the shapes of others' glow that are most like it: too few draws would have each of all."""
    weight, unused = np.ones(len(variance)), Fit(np.empty(len(variance)), np.empty(2))
    found = log_likelihoods(measured, *sample, variance, weight, unused, len(measured.others))
    likeliest = np.argsort([np.exp(of_shape).mean() for of_shape in found])
    return measured._replace(others=measured.others[likeliest[-_GLOWS_KEPT:]])


def _quantiles(share: Floats) -> tuple[float, float, float]:
    """Visibilities below which 5, 50 and 95 % of the posterior are [m]; within a step of the grid ln V is even."""
    step = math.log(VISIBILITIES[1] / VISIBILITIES[0])
    edges = np.concatenate((np.log(VISIBILITIES) - 0.5 * step, [math.log(VISIBILITIES[-1]) + 0.5 * step]))
    below = np.concatenate(([0.0], np.cumsum(share)))
    low, middle, high = np.exp(np.interp((0.05, 0.5, 0.95), below, edges)).tolist()
    return low, middle, high


def _of_cells(own: OwnLight, used: NDArray[np.bool_]) -> OwnLight:
    if used.all():
        return own
    return OwnLight(*(np.ascontiguousarray(one[..., used]) for one in (own.veil, own.road, own.depth)))


def _too_little(seen: Seen, used: NDArray[np.bool_], is_sky: NDArray[np.bool_]) -> str:
    """Why the usable cells give no estimate; empty if they may."""
    if np.count_nonzero(used) < _LEAST_CELLS or np.count_nonzero(used & ~is_sky) < _LEAST_ROAD:
        return "too little is seen that is neither too bright nor too dark"
    if float(seen.luminance[used].max()) < _LEAST_PEAK:
        return "too dark: the head lamps light nothing"
    return ""
