"""Fog that is denser in places: optical depth over the path ahead, weighed against even fog by evidence."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.values.camera import Camera
from fogsim.vision.light.pixel_kernels import LinearPixels
from fogsim.vision.strips import joint_fit
from fogsim.vision.strips.albedo_filter import HIDDEN, USED
from fogsim.vision.strips.joint_fit import ALBEDO_CHANCES, ALBEDOS, JointFit
from fogsim.vision.strips.joint_kernels import Bins, JointPrior, Solution
from fogsim.vision.strips.sky import Sky
from fogsim.vision.strips.strip_curves import StripCurves, airlight_shares
from fogsim.vision.strips.strip_geometry import StripGeometry
from fogsim.vision.uneven.fog_evidence import (
    CHANCES_OF_EVEN,
    NODES,
    UNEVEN_CHANCES,
    UNEVENNESS,
    EvenFog,
    bank_nodes,
    even_fog_over,
    fog_nodes,
    hidden_cost,
    left_out,
    of_each_bin,
    thinned_bins,
)
from fogsim.vision.uneven.hidden_course import HiddenCourse
from fogsim.vision.uneven.uneven_kernels import OTHERS, FogNodes, denser_part, first_profile, path_depths
from fogsim.vision.uneven.uneven_kernels import fit_uneven as fit_over_nodes

Floats = NDArray[np.float64]

_BANK_CHANCE = 0.01
"""How likely it is that a bank begins at a node [-]."""

_FIRST_BANK, _LEAST_RISE = 5, 0.3
"""Node from which on a bank may begin, and least rise of ln k in a first fit for one to be tried [-]."""

_GENTLE, _FIRST_UNEVEN = 0, 4
"""Which unevenness is tried first, and which then to see whether any other is to be."""

_SURELY_EVEN = 0.0
"""By how much the cost of the first uneven fits must lie above that of the even one for no other to be tried [-]."""

_SAME_DEPTH, _TOLD = 0.04, 2.0
"""Relative difference of optical depths up to which strips agree on the fog, and depth up to which they are compared
[-]."""

_UNLIKELY = 30.0
"""By how much the cost of even fog over an albedo must lie above the best for that albedo to be left out [-]."""

_BENT = 30.0
"""How much more evidence uneven fog needs on a road that bends, which strips may leave far away [-]."""

_HIDDEN_COURSE, _MOSTLY = 20.0, 0.5
"""How much more evidence uneven fog needs where a sag or crest that lines do not show explains most of what it does,
and how much that is [-]: a course is tried in pieces, and so fits less well than it would."""

_NEAREST = 12.0
"""Least reach of a curve of optical depths [m]."""

_FREE = 0.9
"""Share of bins in use from which on even fog needs no obstacles [-]."""

_SURELY_EVEN_SHARE = 0.99
"""Chance of even fog beyond which only that counts [-]."""

_UNSURE = -2.0 * math.log(1.0 - _SURELY_EVEN_SHARE)
"""By how much the cost of uneven fog may lie above that of even fog for the road's course to be doubted [-]."""

_STEPS, _MORE_STEPS = 12, 8
"""Most Gauss–Newton steps of a first fit, and from one answer to the next."""

_LEAST_ROAD = 0.3
"""Share of bins that even fog must explain for there to be a road that other fog may lie on [-]."""

_EXPLAINS, _FEW = 0.5, 3
"""Share of the bins that even fog leaves out, and number of them, that uneven fog may leave out and be believed: else
what is there is an obstacle to both [-]."""


@dataclass(frozen=True, slots=True)
class UnevenFit:
    """What road and sky say of the fog along the way."""

    # The fit; its extinction is the mean up to the meteorological visibility, or to `reach` if that is nearer
    fit: JointFit
    reach: float  # Path up to which the road was seen [m]
    # distance, depth, deviation (n,): path [m], optical depth up to there [-] and its standard deviation [-]
    distance: Floats
    depth: Floats
    deviation: Floats
    even: float = 1.0  # How likely it is that the fog is even [-]
    # Where much denser fog begins [m], the standard deviation of that [m], and its extinction [1/m]
    denser: tuple[float, float, float] | None = None


@dataclass(frozen=True, slots=True)
class _Candidate:
    """One fit with its cost, the fog that it is of, and how likely that is beforehand."""

    cost: float
    solution: Solution
    fog: FogNodes
    chance: float


def fit_uneven(
    curves: StripCurves,
    geometry: StripGeometry,
    prior: JointPrior,
    own: JointFit,
    even: JointFit,
    hidden: HiddenCourse,
) -> UnevenFit:
    """Fit strips with fog that may be uneven, weighed against even fog.

    All strips count, unless even fog has left out much of them and the own lane disagrees with all together.
    """
    if even.used.mean() < _LEAST_ROAD:
        return even_fog(even, geometry)
    found = _fitted(curves, geometry, prior, even, hidden)
    if found is not None and not _fits_all(even, curves):
        lane = _fitted(curves.only([0]), geometry.only([0]), prior, own, hidden)
        if not _agree(even_fog(own, geometry) if lane is None else lane, found):
            found = lane
    return even_fog(even, geometry) if found is None else found


def _fits_all(even: JointFit, curves: StripCurves) -> bool:
    """Whether even fog has left out no strip, and not much of any."""
    if len(even.used) < len(curves.variance):
        return False
    seen = curves.variance > 0
    return bool((even.used.sum(axis=1) >= _FREE * seen.sum(axis=1)).all())


def _agree(own: UnevenFit, more: UnevenFit) -> bool:
    """Whether more strips agree on the optical depth as far as the own lane does."""
    last = max(int((own.depth < _TOLD).sum()) - 1, 0)
    depth, deviation = float(own.depth[last]), float(own.deviation[last])
    apart = abs(depth - float(np.interp(own.distance[last], more.distance, more.depth)))
    return apart <= math.hypot(deviation, _SAME_DEPTH * depth)


def _fitted(
    curves: StripCurves, geometry: StripGeometry, prior: JointPrior, even: JointFit, hidden: HiddenCourse
) -> UnevenFit | None:
    """Fit of uneven fog, or None if even fog suffices."""
    bins = thinned_bins(curves, geometry, prior)
    farthest = float((bins.path / bins.below)[bins.noise > 0].max())
    count = min(sum(node < farthest for node in NODES) + 1, len(NODES))
    first = (even.extinction, even.airlight, even.shift)
    flat = [
        even_fog_over(bins, albedo, prior, first, chance)
        for albedo, chance in zip(ALBEDOS, CHANCES_OF_EVEN, strict=True)
    ]
    evens = [one.cost - _BENT * hidden.is_bent for one in flat]
    likely = int(np.argmin(evens))
    guess = first_profile(bins, fog_nodes(*UNEVENNESS[0], count).nodes, prior)
    begin = np.concatenate([guess, [prior.airlight, prior.shift, 0.0]])
    tried = [_uneven(bins, likely, prior, _GENTLE, begin, _STEPS)]
    tried.append(_uneven(bins, likely, prior, _FIRST_UNEVEN, begin, _STEPS))
    tried += _banks(bins, likely, prior, begin)
    if min(t.cost for t in tried) > min(evens) + _SURELY_EVEN and _is_free(even, curves):
        return None
    begin = tried[1].solution.theta
    for unevenness in range(len(UNEVENNESS)):
        if unevenness not in (_GENTLE, _FIRST_UNEVEN):
            tried.append(_uneven(bins, likely, prior, unevenness, begin, _MORE_STEPS))
    best = min(tried, key=lambda t: t.cost)
    if left_out(best.solution, bins) > max(_EXPLAINS * flat[likely].left_out, _FEW):
        return None
    for albedo, cost in enumerate(evens):
        if albedo != likely and cost < evens[likely] + _UNLIKELY:
            tried.append(_candidate(bins, albedo, prior, best.fog, best.chance, best.solution.theta, _MORE_STEPS))
    fogs = [
        EvenFog(cost, even.extinction, even.extinction_deviation**2, one.left_out)
        for one, cost in zip(flat, evens, strict=True)
    ]
    gain = min(evens) - min(t.cost for t in tried)
    if gain > -_UNSURE:
        courses = hidden.even_fogs(curves, prior, even, likely, gain)
        explained = min(evens) - min((one.cost for one in courses), default=math.inf)
        doubt = _HIDDEN_COURSE if explained > _MOSTLY * gain else 0.0
        fogs += [EvenFog(one.cost - doubt, *one[1:]) for one in courses]
    return _weighed(even, fogs, tried, bins, geometry)


def _is_free(even: JointFit, curves: StripCurves) -> bool:
    """Whether even fog explains nearly all bins of its strips, rather than taking them for obstacles."""
    strips = min(len(even.used), len(curves.variance))
    return bool(even.used[:strips][curves.variance[:strips] > 0].mean() > _FREE)


def even_fog(even: JointFit, geometry: StripGeometry) -> UnevenFit:
    """Fog that is the same all along the way."""
    reach = _reach(even.used, geometry.path, geometry.below)
    k = max(even.extinction, 0.0)
    distance = _distances(reach)
    return UnevenFit(even, reach, distance, k * distance, even.extinction_deviation * distance)


@kernel
def _distances(reach: float) -> Floats:
    """Distances of a curve up to a reach [m]."""
    farthest = max(reach, _NEAREST)
    count = max(math.ceil(math.log(farthest / 10.0) / math.log(1.15)), 1)
    out = 10.0 * (farthest / 10.0) ** (np.arange(count + 1) / count)
    out[count] = farthest
    return out


@kernel
def _reach(used: NDArray[np.bool_], path: Floats, below: Floats) -> float:
    """Path to the farthest bin in use [m]."""
    farthest = 0.0
    for s in range(used.shape[0]):
        for i in range(used.shape[1]):
            if used[s, i]:
                farthest = max(farthest, path[s, i] / below[i])
    return farthest


def _uneven(bins: Bins, albedo: int, prior: JointPrior, unevenness: int, start: Floats, steps: int) -> _Candidate:
    """Fit of fog of some unevenness."""
    fog = fog_nodes(*UNEVENNESS[unevenness], start.size - OTHERS)
    return _candidate(bins, albedo, prior, fog, UNEVEN_CHANCES[unevenness], start, steps)


def _banks(bins: Bins, albedo: int, prior: JointPrior, start: Floats) -> list[_Candidate]:
    """Fits of banks that begin where a first fit has the fog become denser, or one node on."""
    count = start.size - OTHERS
    if count <= _FIRST_BANK + 1:
        return []
    rises = np.diff(start[:count])
    first = int(np.argmax(rises[_FIRST_BANK:])) + _FIRST_BANK + 1
    if rises[first - 1] < _LEAST_RISE:
        return []
    nodes = range(first, min(first + 2, count))
    return [
        _candidate(bins, albedo, prior, bank_nodes(node, count), _BANK_CHANCE, start, _MORE_STEPS) for node in nodes
    ]


def _candidate(
    bins: Bins, albedo: int, prior: JointPrior, fog: FogNodes, chance: float, start: Floats, steps: int
) -> _Candidate:
    found = fit_over_nodes(bins, ALBEDOS[albedo], prior, fog, start, steps)
    if int((found.used[0] == USED).sum()) < joint_fit.LEAST_BINS:
        return _Candidate(math.inf, found, fog, chance)
    likelihood = found.cost + hidden_cost(found, bins)
    return _Candidate(likelihood - 2.0 * math.log(ALBEDO_CHANCES[albedo] * chance), found, fog, chance)


def _weighed(
    even: JointFit, evens: list[EvenFog], tried: list[_Candidate], bins: Bins, geometry: StripGeometry
) -> UnevenFit | None:
    """Average over even fog and uneven fits by their evidence; None if even fog suffices, or explains no road."""
    costs = np.array([*(one.cost for one in evens), *(t.cost for t in tried)])
    weights = np.exp(-0.5 * (costs - costs.min()))
    weights /= weights.sum()
    of_even, of_tried = weights[: len(evens)], weights[len(evens) :]
    share = float(of_even.sum())
    if float(of_even[: len(ALBEDOS)].sum()) > _SURELY_EVEN_SHARE:
        return None
    best = tried[int(np.argmax(of_tried))]
    used = even.used if share > 0.5 else best.solution.used == USED
    seen = geometry if share > 0.5 else bins
    reach = _reach(used, seen.path, seen.below)
    if reach <= 0.0:
        return None
    distance = _distances(reach)
    k = sum(weight * max(one.extinction, 0.0) for weight, one in zip(of_even, evens, strict=True))
    k2 = sum(weight * (one.extinction**2 + one.variance) for weight, one in zip(of_even, evens, strict=True))
    depth, depth2 = k * distance, k2 * distance**2
    for weight, candidate in zip(of_tried, tried, strict=True):
        if weight < 1e-3:
            continue
        seen_fog = path_depths(*_solved(candidate), distance, reach)
        k, k2 = k + weight * seen_fog.mean, k2 + weight * (seen_fog.mean**2 + seen_fog.mean_variance)
        depth += weight * seen_fog.depth
        depth2 += weight * (seen_fog.depth**2 + seen_fog.variance)
    sd = math.sqrt(max(k2 - k * k, 0.0))
    deviation = np.sqrt(np.maximum(depth2 - depth**2, 0.0))
    if share > 0.5:
        return UnevenFit(replace(even, extinction=k, extinction_deviation=sd), reach, distance, depth, deviation, share)
    fit = JointFit(
        extinction=k,
        extinction_deviation=sd,
        airlight=float(best.solution.theta[-3]),
        shift=float(best.solution.theta[-2]),
        road=best.solution.road,
        misfit=best.solution.misfit,
        used=of_each_bin(best.solution.used == USED, geometry.distance),
        hidden=of_each_bin(best.solution.used == HIDDEN, geometry.distance)[0],
    )
    denser = denser_part(*_solved(best), reach)
    return UnevenFit(fit, reach, distance, depth, deviation, share, None if math.isnan(denser[0]) else denser)


def _solved(candidate: _Candidate) -> tuple[Floats, Floats, Floats]:
    """Nodes, parameters and their covariance."""
    return candidate.fog.nodes, candidate.solution.theta, candidate.solution.covariance


_ASIDE = 0.3
"""How far to either side rows are looked at [rad]."""

_ALIKE, _NOISE = 0.07, 3.0
"""Difference to the sky's luminance up to which nothing else is seen, relative to it and in its pixels' deviations."""

_LEAST_SHARE, _KEPT, STEP = 0.25, 0.7, 0.35
"""Least share of a row that is airlight beyond the front, least of that which all rows above keep, and most of it that
the ground two rows below has [-]: trees and vehicles that stand nearer hide the rest."""

_NEAR_FOG = 40.0
"""Up to where fog counts as near, and fronts are the joint fit's [m]."""

_MOST_DEPTH = 1.5
"""Most optical depth of the fog before the front [-]: denser fog hides much of the ground itself."""

_LEAST_ROWS, _UNSURE_ROW = 1.0, 0.15
"""Least rows of a front below the horizon [px], and most of the horizon's standard deviation over them [-]."""

_DENSER = 2.5
"""Least extinction at the front over that of the near fog [-]."""


def airlight_edge(
    image: LinearPixels, geometry: StripGeometry, camera: Camera, sky: Sky, uneven: UnevenFit, horizon_deviation: float
) -> tuple[float, float, float] | None:
    """Find the front of a bank as the row from which on ground is airlight.

    A crest whose far side falls away looks the same where nothing stands out beyond it; one that the lane marks show is
    in `geometry`.

    Returns where it begins [m], the standard deviation of that [m], and the least extinction there [1/m]. Takes
    `horizon_deviation` [px].
    """
    if sky.is_clipped:
        return None
    reach, middle = _ASIDE * camera.focal_length, camera.principal_point[0]
    columns = max(round(middle - reach), 0), min(round(middle + reach), camera.width)
    alike = max(_ALIKE, _NOISE * sky.noise / sky.luminance)
    least = max(_LEAST_ROWS, horizon_deviation / _UNSURE_ROW)
    flat, shift = camera.horizon_row, uneven.fit.shift
    upper, lower = _front(image, geometry, flat, shift, least, columns, sky.luminance, alike)
    if math.isnan(upper):
        return None
    before, behind = camera.row_distance / lower, camera.row_distance / upper
    depth, near = _depth(uneven, before), _depth(uneven, _NEAR_FOG)
    if depth > _MOST_DEPTH:
        return None
    # What is left of the ground's contrast two rows below it is gone.
    contrast = max(1.0 - uneven.fit.road / uneven.fit.airlight, alike) * math.exp(-depth)
    extinction = math.log(max(contrast / alike, 1.0)) / (behind - before)
    if extinction < _DENSER * near / _NEAR_FOG:
        return None
    edge = upper + 0.5
    place = camera.row_distance / edge
    return place, place / edge * math.hypot(0.5, horizon_deviation), extinction


def _depth(uneven: UnevenFit, distance: float) -> float:
    """Optical depth up to a distance, beyond the road that was seen with the mean extinction up to its end [-]."""
    beyond = max(distance / float(uneven.distance[-1]), 1.0)
    return max(float(np.interp(distance, uneven.distance, uneven.depth)), 0.0) * beyond


@kernel
def _front(
    image: LinearPixels,
    geometry: StripGeometry,
    flat: float,
    shift: float,
    least: float,
    columns: tuple[int, int],
    airlight: float,
    alike: float,
) -> tuple[float, float]:
    """Nearest row, of those from near to far, from which on airlight is seen, and that of ground before it.

    Both below the horizon [px]; NaN if there is no step. Takes `flat` (a flat road's horizon), `shift`, `least` [px].
    """
    below, far, count = geometry.below - shift, np.empty(geometry.below.size, np.int64), 0
    for i in range(below.size):
        # Behind a crest no row is farther than the one below it.
        farther = i == 0 or below[i] < below[i - 1]
        # Where a course that is a little wrong has the road rise, the horizon's own row would be a front.
        whole = geometry.first[i] == geometry.last[i] and min(below[i], geometry.first[i] - flat - shift) > least
        if farther and whole and geometry.distance[i] > _NEAR_FOG:
            far[count] = i
            count += 1
    far = far[:count]
    shares = airlight_shares(image, geometry.first[far], columns, airlight, alike)
    for row in range(2, count):
        if shares[row] >= _LEAST_SHARE:
            step = shares[row - 2] <= STEP * shares[row] and shares[row:].min() >= _KEPT * shares[row]
            return (below[far[row]], below[far[row - 2]]) if step else (np.nan, np.nan)
    return np.nan, np.nan
