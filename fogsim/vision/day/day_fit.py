"""How dense the fog is by the day model: its posterior over visibility, horizon and hypotheses, for one image."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values.camera import Camera
from fogsim.values.observation import LeadMeasurement
from fogsim.vision.day.evidence_kernels import evidence_grid
from fogsim.vision.day.road_end import UNSEEN_END, RoadEnd, road_end
from fogsim.vision.day.row_data import RowBins, chances_of, curves_of, free_depth, near_horizon, read_rows, row_bins
from fogsim.vision.day.row_kernels import (
    AIRLIGHT,
    COLUMNS,
    CUT_CHANCE,
    LIGHTS,
    SURFACES,
    RowData,
    contrast_across,
    fill_columns,
    lights_chances,
)
from fogsim.vision.lines.horizon import Horizon

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_NEAREST, FARTHEST, STEP = math.log(12.0), math.log(60_000.0), 0.2
"""Visibilities between which fog is looked for, in logarithms of metres, and about how far apart [-]."""

_CLEAR_CHANCE = 0.05
"""Chance of air without any fog, which the farthest visibility stands for [-]."""

_HORIZONS, _HORIZON_CHANCES = (-1.2, 0.0, 1.2), (0.22, 0.56, 0.22)
"""Horizons, in deviations of what is known of it, and their chances: normal laws about each, half as wide, make up the
whole."""

_HORIZON_SHARE = 0.6
"""Deviation of each of these laws, over that of the whole [-]."""

_SHARP = 0.03
"""Change of the signal within four rows from which on the horizon is where it is steepest, as one more choice [-]."""

_FIRST_WORTHWHILE, _WORTHWHILE = 14.0, 10.0
"""Logarithms of the evidence below the best at which a visibility is not tried under other horizons and surfaces, and
under other responses [-]."""

_FINE = 0.01
"""Step of the posterior [ln m]."""

_FLOOR, _MOST_OVER = -25.0, 1.5
"""Least logarithm of the chance, over the best cell's, that is interpolated, and greatest [-]."""

_UNLIKELY = -1e4
"""Logarithm of the chance of what was not tried."""


_FEWEST_BINS = 4
"""Fewest bins of road about which anything can be said."""

VEHICLE, _RANGE_MARGIN = 1.8, 0.5
"""Height up to which a vehicle ahead may hide the sky, and by how much its foot may be nearer than its range says
[m]."""


@dataclass(frozen=True, slots=True)
class DayFit:
    """Posterior of the visibility."""

    # log_visibility, chance (n,): logarithms of visibilities [ln m], evenly, and their probabilities
    log_visibility: Floats
    chance: Floats
    fog_over_none: float  # Logarithm of the evidence of a road in air or fog over that of no road
    # responses, surfaces, lights (l,): probabilities of the hypotheses
    responses: Floats
    surfaces: Floats
    lights: Floats
    clipped: float  # Share of the sky's bins that are clipped [-]
    brightest: float  # Light that hardly any bin exceeds, over full scale [-]
    contrast: float  # How much brighter the far road is than the near one, over the sky [-]
    log_means: Floats  # (responses,): Mean of ln k under each response, over that under the stated one [-]
    obstacle: float  # Depth at which something hides the road, if something does [m]
    # How much contrast across the road speaks against the extinction that another method claims, in logarithms of
    # chances [-]
    doubt: float = 0.0
    images: int = 1  # Images of the drive up to this one
    free: float = math.inf  # Depth up to which the road was read, before what stands in the own lane [m]
    farthest: float = math.inf  # Depth of the farthest rows that surely are below the horizon [m]
    end: RoadEnd = UNSEEN_END

    @property
    def response_shift(self) -> float:
        """Mean of ln k under all responses over that under the stated one, as far as that is unlikely [-]."""
        unlikely = max(1.0 - float(self.responses[0]) / _UNLIKELY_STATED, 0.0)
        return unlikely * float((self.responses * self.log_means).sum())

    def response_deviation(self, shift: float) -> float:
        """Deviation of ln k under all responses from what is so far from that under the stated one [-]."""
        return math.sqrt(float((self.responses * (self.log_means - shift) ** 2).sum()))

    def quantile(self, share: float) -> float:
        """Visibility below which the truth lies with a probability [m]."""
        return float(np.exp(np.interp(share, np.cumsum(self.chance), self.log_visibility)))

    def below(self, visibility: float) -> float:
        """Probability that the visibility is less than some [-] (`visibility` [m])."""
        return float(self.chance[self.log_visibility < math.log(visibility)].sum())


def free_road(lead: LeadMeasurement | None) -> float:
    """Depth up to which the own lane is free of the tracked vehicle [m]."""
    if lead is None or not math.isfinite(lead.distance):
        return math.inf
    return max(lead.distance - _RANGE_MARGIN, 1.0)


def fit_day(
    image: NDArray[Any],
    camera: Camera,
    horizon: Horizon,
    free: float = math.inf,
    claimed: float = 0.0,
    earlier: DayFit | None = None,
) -> DayFit:
    """Weigh all hypotheses by their evidence; after an earlier image of the same drive the likely ones and one in turn.

    Takes `image` (rows, cols), `free` [m], `claimed` [1/m].
    """
    pixels = image if image.ndim == 3 else image[:, :, None]
    bins = row_bins(camera, horizon.standard_deviation, round(horizon.row))
    if math.isinf(free):
        free = free_depth(pixels, bins, camera, horizon.row)
    if math.isfinite(free):
        bins = _without_vehicle(bins, camera, horizon.row, free)
        if int((bins.first > horizon.row).sum()) < _FEWEST_BINS:
            return replace(_nothing_seen(camera) if earlier is None else earlier, free=free)
    rows, chances = read_rows(pixels, bins, camera, horizon.row), chances_of(pixels, camera)
    doubt = _contradiction(rows, camera, horizon, claimed)
    fit = replace(_weighed(rows, camera, horizon, chances, earlier), doubt=doubt, free=free)
    farthest = camera.row_distance / near_horizon(horizon.standard_deviation)
    fit = replace(fit, farthest=min(free, farthest), end=road_end(pixels, rows, camera, horizon))
    if earlier is None:
        return fit
    tried = _left(earlier, chances)[0]
    stated = [one.responses / max(float(one.responses[0]), _LEAST_CHANCE) for one in (fit, earlier)]
    ratio, log_means = np.where(tried, *stated), np.where(tried, fit.log_means, earlier.log_means)
    return replace(fit, responses=ratio / ratio.sum(), log_means=log_means, images=earlier.images + 1)


def fit_free_road(image: NDArray[Any], camera: Camera, horizon: Horizon, free: float) -> DayFit:
    """Fit the road before what hides it, where something more likely does: see `fit_day`."""
    fit = fit_day(image, camera, horizon, free)
    is_hidden = float(fit.surfaces[SURFACES.hidden != math.inf].sum()) > 0.5
    return fit_day(image, camera, horizon, fit.obstacle) if is_hidden and fit.obstacle < free else fit


def _weighed(rows: RowData, camera: Camera, horizon: Horizon, chances: Floats, earlier: DayFit | None) -> DayFit:
    """Posterior of the visibility by all rows, or by those above a bonnet, where one is likelier than none.

    Takes `chances` (responses,).
    """
    grid = _Grid(rows, camera, horizon, chances, earlier)
    # A first look, at every second visibility under the middle horizon; where no road begins, there is none.
    whole = grid.evidence(np.concatenate([grid.cells[1, ::2], grid.cells[:, 0]]), _USUAL, _ALL)[:, 0]
    heights = len(grid.cells)
    none = float(np.logaddexp(np.logaddexp.reduce(whole[-heights:, _ALL.size] + grid.of_horizon), rows.none))
    whole = np.delete(whole[:-heights], _ALL.size, axis=1) + grid.lights + grid.likely[::2, None]
    of_light = np.logaddexp.reduce(whole, axis=0)
    if grid.lights.size > _ALL.size and of_light[_ALL.size :].max() > of_light[: _ALL.size].max():
        ended = _ended(rows, 1 + int(np.argmax(of_light[_ALL.size :])))
        return _weighed(ended, camera, horizon, chances, earlier)
    kept = np.flatnonzero(of_light[: _ALL.size] > of_light.max() - _SUITS)
    some, chosen, bent = np.logaddexp.reduce(whole, axis=1), *np.zeros((2, *grid.cells.shape[:2]), np.bool_)
    others = _OTHERS[grid.responses[_OTHERS[:, 0]] & grid.surfaces[_OTHERS[:, 1]]]
    if len(others):
        first = np.logaddexp.reduce(grid.evidence(grid.cells[1, ::2], others, kept) + grid.lights[kept], axis=2)
        some = np.maximum(some, first.max(axis=1) + grid.likely[::2])
        by_response = (first + _UNLIKELY * (others[:, 0] == 0)).max(axis=1) + grid.likely[::2]
        bent[:, ::2] = by_response > some.max() - _SUITS
    chosen[:, ::2] = some > some.max() - _FIRST_WORTHWHILE
    return _posterior(grid, _wider(chosen, 2), bent, kept, none)


def _posterior(grid: "_Grid", chosen: NDArray[np.bool_], bent: NDArray[np.bool_], kept: Ints, none: float) -> DayFit:
    """Posterior over cells and hypotheses.

    Where fog may be, all surfaces are tried under the stated response; where it still may be, or another response makes
    it likely, all responses over the likeliest surface. What other surfaces add is taken to be the same under all.
    """
    prior = grid.of_horizon[:, None] + grid.likely
    tried = np.array([(0, int(s)) for s in np.flatnonzero(grid.surfaces)])
    stated = grid.hypotheses(chosen, tried, kept, prior)
    good = np.full(chosen.shape, _UNLIKELY)
    good[chosen] = np.logaddexp.reduce(stated, axis=(1, 2))
    still = chosen & _wider(bent | (good > good.max() - _WORTHWHILE), 1)
    stated = stated[still[chosen]]
    by_surface = np.logaddexp.reduce(stated, axis=(0, 2))
    best = int(np.argmax(by_surface))
    more = np.array([(r, tried[best, 1]) for r in np.flatnonzero(grid.responses)[1:]])
    others = grid.hypotheses(still, more, kept, prior) + np.logaddexp.reduce(by_surface - by_surface[best])
    each = np.concatenate([stated, others], axis=1)
    response, rows = np.concatenate([tried[:, 0], more[:, 0]]), grid.rows
    chance = np.logaddexp.reduce(each, axis=2)
    fine, posterior, evidence = _interpolated(grid.logs, still, chance)
    weight = np.exp(chance - np.logaddexp.reduce(chance, axis=None))
    sky = rows.noise[0, : rows.cuts[0]]
    return DayFit(
        log_visibility=fine,
        chance=posterior,
        fog_over_none=evidence - none,
        responses=_sums(response, weight.sum(axis=0), grid.responses.size),
        surfaces=_sums(tried[:, 1], np.exp(by_surface - np.logaddexp.reduce(by_surface)), grid.surfaces.size),
        lights=_sums(kept, _shares(each), _ALL.size),
        clipped=float(np.mean(sky <= 0.0)) if sky.size else 0.0,
        brightest=float(rows.level[0]),
        log_means=_log_means(np.log(grid.cells[still][:, 1]), weight, response, grid.responses.size),
        obstacle=grid.obstacle,
        contrast=float(rows.light[0, rows.cuts[0] :].max() - rows.light[0, -1]) / float(rows.level[0]),
    )


def _left(earlier: DayFit | None, chances: Floats) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which responses that have a chance, and which surfaces, are to be tried; the stated response always is."""
    surfaces, possible = SURFACES.chance.size, np.flatnonzero(chances)
    if earlier is None:
        return chances > 0.0, np.ones(surfaces, np.bool_)
    responses, turn = np.zeros(chances.size, np.bool_), earlier.images
    responses[[0, possible[turn % possible.size], *np.argsort(earlier.responses)[-_LIKELY:]]] = True
    return responses & (chances > 0.0), (earlier.surfaces > _HARDLY) | (np.arange(surfaces) == turn % surfaces)


def _wider(cells: NDArray[np.bool_], steps: int) -> NDArray[np.bool_]:
    """(h, v) bool: cells, and those at so many visibilities to either side."""
    wide = cells.copy()
    for step in range(1, steps + 1):
        wide[:, step:] |= cells[:, :-step]
        wide[:, :-step] |= cells[:, step:]
    return wide


def _visibilities() -> tuple[Floats, Floats, Floats]:
    """Logarithms of visibilities, extinctions, and logarithms of their chances."""
    logs = np.linspace(_NEAREST, FARTHEST, math.ceil((FARTHEST - _NEAREST) / STEP) + 1)
    extinctions = OPTICAL_DEPTH_AT_VISIBILITY / np.exp(logs)
    extinctions[-1] = 1e-7
    likely = np.full(logs.size, math.log((1.0 - _CLEAR_CHANCE) / (logs.size - 1)))
    likely[-1] = math.log(_CLEAR_CHANCE)
    return logs, extinctions, likely


_LOG_SURFACES = np.log(SURFACES.chance)
"""Logarithms of the surfaces' chances."""

_USUAL = np.zeros((1, 2), np.int64)
"""The stated response and the usual surface."""

_OTHERS = np.array([(0, 1), (0, 2), (0, 3), (0, 4), (0, 5), (2, 0), (5, 0)])
"""Responses and surfaces of a first look: what the usual ones do not explain may need another visibility."""

_HARDLY, _LIKELY = 0.03, 2
"""Probability below which a surface is not tried in every later image of a drive [-], and how many responses are, in
addition to the stated one: an image hardly separates them, and a camera keeps its own."""

_UNLIKELY_STATED = 0.15
"""Probability of the stated response below which the mean over all counts, the more the less it is; chosen on pool 0 of
`benchmarks/camera_kinds.py` [-]."""

_LEAST_CHANCE = 1e-9
"""Least chance of the stated response that others are compared with [-]."""

_SUITS = 5.0
"""Logarithm of the evidence below the best at which a light is not tried under other surfaces and responses, nor what
only other responses make likely under all [-]."""


_ALL = np.arange(LIGHTS.sky.size)
"""All lights."""

_CLIPPED_AIRLIGHT = 0.7
"""Deviation of the airlight before an image is seen, over the usual one, where the sky is clipped [-]: exposure meters
seldom let it be twice as bright; chosen on pool 0 of `benchmarks/camera_kinds.py`."""


class _Grid:
    """What all evaluations of one image have in common, cells of horizons and visibilities among it."""

    def __init__(
        self, rows: RowData, camera: Camera, horizon: Horizon, chances: Floats, earlier: DayFit | None
    ) -> None:
        self.rows, self._lens = rows, _lens_of(camera)
        self._shift = _HORIZON_SHARE * horizon.standard_deviation
        self._chances = np.log(np.maximum(chances, _LEAST_CHANCE))
        ends = rows.cuts.size - 2
        self.lights = np.log(np.append(lights_chances(ends), [CUT_CHANCE] * ends))
        self.responses, self.surfaces = _left(earlier, chances)
        at, self.of_horizon = _horizons(rows, horizon)
        self.logs, extinctions, self.likely = _visibilities()
        self.cells = np.stack(np.meshgrid(at, extinctions, indexing="ij"), axis=-1)
        self._laws = np.column_stack([SURFACES.albedo, SURFACES.hidden])
        self.obstacle = camera.focal_length * camera.mount_height / max(_step(rows) - horizon.row, 1.0)
        self._laws[np.isnan(self._laws)] = self.obstacle

    def hypotheses(self, chosen: NDArray[np.bool_], tried: Ints, lights: Ints, prior: Floats) -> Floats:
        """(c, t, m) float64: logarithms of the evidence of hypotheses with their chances (`prior` (h, v))."""
        chance = self._chances[tried[:, 0]] + _LOG_SURFACES[tried[:, 1]]
        found = self.evidence(self.cells[chosen], tried, lights) + self.lights[lights]
        return np.asarray(found + (prior[chosen][:, None] + chance)[:, :, None])

    def evidence(self, cells: Floats, tried: Ints, lights: Ints) -> Floats:
        """(c, t, m) float64: see `evidence_grid`; under all lights there also are roads that end sooner."""
        laws = np.stack([LIGHTS.mean[lights], LIGHTS.deviation[lights]])
        laws[1, :, AIRLIGHT] *= _CLIPPED_AIRLIGHT if self.rows.least_airlight.any() else 1.0
        cuts = self.rows.cuts.size - 1 if lights is _ALL else 0
        out = np.empty((len(cells), len(tried), lights.size + cuts))
        places = np.ascontiguousarray(cells)
        evidence_grid(self.rows, self._lens, places, tried, self._laws, laws, self._shift, out)
        return np.where(np.isfinite(out), out, _UNLIKELY)


def _nothing_seen(camera: Camera) -> DayFit:
    """What is known beforehand: a vehicle hides the road."""
    logs, _, likely = _visibilities()
    chances = curves_of(camera).chance, SURFACES.chance, LIGHTS.chance
    return DayFit(
        logs,
        np.exp(likely),
        0.0,
        *chances,
        clipped=0.0,
        brightest=1.0,
        contrast=1.0,
        log_means=np.zeros(chances[0].size),
        obstacle=math.inf,
    )


def _without_vehicle(bins: RowBins, camera: Camera, horizon: float, free: float) -> RowBins:
    """Leave out rows that the vehicle ahead may hide."""
    above = max(VEHICLE - camera.mount_height, 0.0) * camera.focal_length / free
    seen = (bins.last <= horizon - above) | (bins.first >= horizon + camera.row_distance / free)
    return RowBins(*(part[seen] for part in bins))


def _step(rows: RowData) -> float:
    """Row above which something may hide the road: where its light changes most from bin to bin."""
    road = slice(int(rows.cuts[0]) + 2, int(rows.cuts[-1]))
    light = rows.light[0, road]
    if light.size < 3:
        return float(rows.last[-1])
    change = np.abs(np.diff(light)) / (rows.noise[0, road][1:] + 0.01 * rows.level[0])
    return float(rows.first[road][1 + int(np.argmax(change))])


def _ended(rows: RowData, cut: int) -> RowData:
    """Return the rows up to a cut alone."""
    end = int(rows.cuts[cut])
    parts = {name: getattr(rows, name)[..., :end] for name in ("first", "last", "light", "slope", "noise", "by_row")}
    parts = {name: np.ascontiguousarray(values) for name, values in parts.items()}
    return rows._replace(
        **parts,
        contrast=np.ascontiguousarray(rows.contrast[:, :end]),
        cuts=np.array([rows.cuts[0], end]),
        free=np.array([rows.free[0] - rows.free[cut], 0.0]),
    )


def _contradiction(rows: RowData, camera: Camera, horizon: Horizon, extinction: float) -> float:
    """How much contrast across the road speaks against an extinction, at the horizon that suits it best."""
    columns, place = np.empty((rows.first.size, COLUMNS + 1)), np.empty((rows.first.size, 5))
    logs = []
    for row in horizon.row + horizon.standard_deviation * np.array([-1.0, 0.0, 1.0]):
        fill_columns(rows.first, rows.last, float(row), _lens_of(camera), extinction, math.inf, columns, place)
        logs.append(contrast_across(rows.contrast, place, int((rows.last + 0.5 <= row).sum())))
    return -max(logs)


def _lens_of(camera: Camera) -> Floats:
    """(3,) float64: what `fill_columns` takes of a camera."""
    return np.array([camera.focal_length, camera.mount_height, camera.principal_point[1]])


def _horizons(rows: RowData, horizon: Horizon) -> tuple[Floats, Floats]:
    """Rows of the horizon that are tried, and the logarithms of their chances."""
    deviation = horizon.standard_deviation
    at, chance = horizon.row + deviation * np.array(_HORIZONS), np.array(_HORIZON_CHANCES)
    edge = _edge(rows, horizon)
    if edge is not None:
        share = 0.3 * math.exp(-0.5 * ((edge - horizon.row) / deviation) ** 2)
        at, chance = np.append(at, edge), np.append((1.0 - share) * chance, share)
    return at, np.log(chance)


def _edge(rows: RowData, horizon: Horizon) -> float | None:
    """Where brightness changes most from row to row about the horizon, if it does much."""
    middle, light = 0.5 * (rows.first + rows.last), rows.light[0] / rows.level[0]
    near = np.flatnonzero(np.abs(middle - horizon.row) < 3.0 * horizon.standard_deviation + 1.0)
    near = near[(near > 1) & (near < middle.size - 2)]
    if near.size == 0:
        return None
    place = int(near[np.argmax(np.abs(light[near + 1] - light[near - 1]))])
    low, high = light[place - 2], light[place + 2]
    if abs(high - low) < _SHARP:
        return None
    inside = float((high - light[place - 1 : place + 2]).sum() / (high - low))
    step = float(middle[place] - middle[place - 1])
    edge = float(middle[place - 2]) + (0.5 + inside) * step
    return edge if abs(edge - horizon.row) < 3.0 * horizon.standard_deviation else None


def _log_means(logs: Floats, weight: Floats, response: Ints, count: int) -> Floats:
    """(count,) float64: mean logarithm under each response, over that under the first (`weight` (c, pairs))."""
    of_each, total = (_sums(response, part.sum(axis=0), count) for part in (weight, weight * logs[:, None]))
    means = np.divide(total, of_each, out=np.full(count, total.sum() / of_each.sum()), where=of_each > 0.0)
    return np.asarray(means - means[0])


def _sums(which: Ints, weight: Floats, count: int) -> Floats:
    """Sum of weights by number."""
    return np.asarray(np.bincount(which, weight, count), np.float64)


def _shares(each: Floats) -> Floats:
    """Probabilities of the last axis."""
    logs = np.logaddexp.reduce(each, axis=(0, 1))
    return np.asarray(np.exp(logs - np.logaddexp.reduce(logs)))


def _interpolated(logs: Floats, chosen: NDArray[np.bool_], chance: Floats) -> tuple[Floats, Floats, float]:
    """Posterior in finer steps, of cells under pairs of hypotheses, and the logarithm of its sum.

    For each horizon and pair its logarithm is cubic between visibilities (Catmull and Rom), so that parabolas stay.
    """
    best = float(chance.max())
    value = np.full((*chosen.shape, chance.shape[1]), _FLOOR)
    value[chosen] = np.maximum(chance - best, _FLOOR)
    inside = np.flatnonzero(chosen.any(axis=0))
    first, last = max(int(inside[0]) - 1, 0), min(int(inside[-1]) + 1, logs.size - 1)
    step = logs[1] - logs[0]
    place = np.arange(0.0, last - first, _FINE / step)
    low = first + np.minimum(place.astype(np.int64), last - first - 1)
    s = (place - (low - first))[None, :, None]
    a, b, c, d = (value[:, np.clip(low + i, 0, logs.size - 1)] for i in (-1, 0, 1, 2))
    cubic = b + 0.5 * s * (c - a + s * (2.0 * a - 5.0 * b + 4.0 * c - d + s * (3.0 * (b - c) + d - a)))
    weight = np.exp(np.minimum(cubic, _MOST_OVER)).sum(axis=(0, 2))
    total = float(weight.sum())
    return logs[first] + place * step, weight / total, best + math.log(total * _FINE / step)
