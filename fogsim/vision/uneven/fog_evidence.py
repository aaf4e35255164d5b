"""Evidence of even and of other fog by the same measure, and the prior of how fog varies along the way."""

import functools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.core.linear_algebra import inverse_of
from fogsim.vision.strips.albedo_filter import HIDDEN, HIDDEN_COST, LEFT_OUT_COST, USED, Albedo
from fogsim.vision.strips.joint_fit import ALBEDO_CHANCES, MORE_STEPS, albedo_changes, bins_of
from fogsim.vision.strips.joint_kernels import Bins, JointPrior, Solution, gauss_newton, invert
from fogsim.vision.strips.strip_curves import StripCurves
from fogsim.vision.strips.strip_geometry import StripGeometry
from fogsim.vision.uneven.uneven_kernels import FogNodes

NODES = (0.0, *(12.0 * 1.4**i for i in range(5)), *(60.0 * 1.2**i for i in range(14)))
"""Nodes of the path [m]: nearly two rows apart, in a camera of 800 px·m, where the road is far."""

_MEAN, _BROAD = math.log(0.01), 1.6
"""Mean and standard deviation of ln k of fog before anything is seen [ln 1/m]."""

_ROUGHNESS = 0.03
"""Standard deviation of ln k from node to node next to that [-]."""

UNEVENNESS = ((0.4, 300.0), (0.25, 100.0), (0.7, 30.0), (0.7, 100.0), (2.0, 80.0))
"""Standard deviations of ln k along the way [-], and their correlation lengths [m]: nearly even, patches, banks."""

BANK = 2.0
"""Standard deviation of the rise of ln k into a bank [-]."""


@functools.cache
def fog_nodes(deviation: float, length: float, count: int) -> FogNodes:
    """Nodes of fog of some unevenness (`length` [m])."""
    nodes = np.array(NODES[:count])
    # Where nodes are farther apart than patches are long, a node stands for their mean.
    size = np.maximum(np.diff(nodes, prepend=-NODES[1]) / length, 1e-3)
    share = np.sqrt(2.0 * (size - 1.0 + np.exp(-size))) / size
    apart = math.sqrt(3.0) / length * np.abs(nodes[:, None] - nodes)
    covariance = deviation**2 * (1.0 + apart) * np.exp(-apart) * share[:, None] * share + _BROAD**2
    covariance += _ROUGHNESS**2 * np.eye(count)
    logarithm = invert(covariance, np.empty_like(covariance))
    return FogNodes(nodes, _MEAN, inverse_of(covariance), logarithm)


@functools.cache
def bank_nodes(first: int, count: int) -> FogNodes:
    """Nodes of fog that is even up to a bank, and even in it."""
    nodes = fog_nodes(*UNEVENNESS[0], count).nodes
    inside = (np.arange(count) >= first).astype(np.float64)
    covariance = _BROAD**2 + BANK**2 * inside[:, None] * inside + _ROUGHNESS**2 * np.eye(count)
    logarithm = invert(covariance, np.empty_like(covariance))
    return FogNodes(nodes, _MEAN, inverse_of(covariance), logarithm)


Floats = NDArray[np.float64]

NEAR, _TOGETHER = 30.0, 3
"""Distance up to which bins are taken together [m], and how many."""

UNEVEN_CHANCES = (0.1, 0.05, 0.05, 0.05, 0.05)
"""How likely each unevenness is beforehand; even fog is the rest [-]."""

_OBSTACLE_CHANCE = 0.01
"""How likely it is that an obstacle that no sensor reports begins in a lane at one of its rows [-]."""

_STRANGE = 2.0
"""What an outlier adds to a cost next to its luminance's chance, where even fog is weighed against uneven [-]."""


CHANCES_OF_EVEN = tuple(chance * (1.0 - sum(UNEVEN_CHANCES)) for chance in ALBEDO_CHANCES)
"""How likely even fog over each of the albedos is beforehand [-]."""

_SPREAD, _NARROW = math.log(_BROAD**2), _BROAD**-2
"""Logarithm of the variance of ln k beforehand, and one over it."""


class EvenFog(NamedTuple):
    """Even fog over some albedo and course of the road."""

    cost: float  # Minus twice the logarithm of its evidence with its chance [-]
    # extinction, variance: k [1/m], and its variance
    extinction: float
    variance: float
    left_out: int  # How many bins it leaves unexplained


@kernel
def even_fog_over(
    bins: Bins, albedo: Albedo, prior: JointPrior, start: tuple[float, float, float], chance: float
) -> EvenFog:
    """Even fog over an albedo, with ln k as its parameter and what is known of that.

    Takes `start`, with extinction [1/m], airlight and shift, `chance` [-].
    """
    first = np.array([max(start[0], 1e-5), start[1], start[2], 0.0])
    found = gauss_newton(bins, albedo, prior, first, MORE_STEPS)
    k, variance = max(found.theta[0], 1e-5), found.covariance[0, 0]
    apart = (math.log(k) - _MEAN) / _BROAD
    cost = found.cost + math.log(variance) + math.log(k * k / variance + _NARROW) + _SPREAD + apart * apart
    cost += hidden_cost(found, bins) - 2.0 * math.log(chance)
    return EvenFog(cost, found.theta[0], variance, left_out(found, bins))


@kernel
def left_out(found: Solution, bins: Bins) -> int:
    """How many bins a fit leaves unexplained."""
    count = 0
    for s in range(bins.noise.shape[0]):
        for i in range(bins.noise.shape[1]):
            count += found.used[s, i] != USED and bins.noise[s, i] > 0.0
    return count


@kernel
def hidden_cost(found: Solution, bins: Bins) -> float:
    """What is to be added to a cost for bins behind obstacles and for outliers.

    In the fit of one fog they are cheap and dear, so that what is behind an obstacle is left out whole. Next to an
    obstacle, denser fog is another explanation, and the two are weighed fairly: either's luminance may be any.
    """
    airlight = found.theta[found.theta.size - 3]
    any_luminance, cost, outliers, obstacles = math.log(airlight * airlight / (2.0 * math.pi)), 0.0, 0, 0
    for s in range(bins.noise.shape[0]):
        is_hidden = False
        for i in range(bins.noise.shape[1]):
            if bins.noise[s, i] > 0.0 and found.used[s, i] == HIDDEN:
                cost += any_luminance - HIDDEN_COST - math.log(bins.noise[s, i])
                is_hidden = True
            outliers += bins.noise[s, i] > 0.0 and found.used[s, i] == 0
        obstacles += is_hidden
    return cost - (LEFT_OUT_COST - _STRANGE) * outliers - 2.0 * math.log(_OBSTACLE_CHANCE) * obstacles


@kernel
def thinned_bins(curves: StripCurves, geometry: StripGeometry, prior: JointPrior) -> Bins:
    """Bins under even airlight, those of the near road by threes: there fog varies little from bin to bin."""
    bins = bins_of(curves, geometry, prior, np.zeros(0), np.zeros((0, 0, 0)))
    near = _taken_together(bins.distance)
    if near == 0:
        return bins
    seen = (bins.noise > 0.0).astype(np.float64)
    share, luminance, noise = _means(seen, near), _means(bins.luminance * seen, near), _means(bins.noise, near)
    sizes = np.ones(share.shape[1])
    sizes[: near // _TOGETHER] = _TOGETHER
    for s in range(share.shape[0]):
        for i in range(share.shape[1]):
            of_seen = max(share[s, i], 1e-9)
            luminance[s, i] /= of_seen
            noise[s, i] = noise[s, i] / (of_seen * of_seen) / sizes[i] if share[s, i] > 0.5 else 0.0
    rows = np.empty((5, bins.below.size))
    rows[0], rows[1], rows[2], rows[3], rows[4] = bins.below, bins.half, bins.distance, bins.extent, bins.grazing
    rows = _means(rows, near)
    return Bins(
        luminance,
        noise,
        _means(bins.path, near),
        _means(bins.off_axis, near),
        rows[0],
        rows[1] * sizes,
        rows[2],
        rows[3] * sizes,
        rows[4],
        bins.darker,
        bins.darker_by_row,
        bins.eye,
        albedo_changes(rows[2], rows[3] * sizes, rows[4]),
    )


@kernel
def _means(values: Floats, near: int) -> Floats:
    """Means of the nearest bins by threes, and the others as they are (`values` (m, n))."""
    groups = near // _TOGETHER
    out = np.empty((values.shape[0], groups + values.shape[1] - near))
    out[:, groups:] = values[:, near:]
    for row in range(values.shape[0]):
        for group in range(groups):
            total = 0.0
            for i in range(group * _TOGETHER, (group + 1) * _TOGETHER):
                total += values[row, i]
            out[row, group] = total / _TOGETHER
    return out


def of_each_bin(thinned: NDArray[np.bool_], distance: Floats) -> NDArray[np.bool_]:
    """(strips, n) bool: values of thinned bins, repeated for all.

    Takes `thinned` (strips, thinned) bool, `distance` (n,) [m].
    """
    near = _taken_together(distance)
    groups = near // _TOGETHER
    return np.concatenate([np.repeat(thinned[:, :groups], _TOGETHER, axis=1), thinned[:, groups:]], axis=1)


@kernel
def _taken_together(distance: Floats) -> int:
    """How many of the nearest bins are taken together."""
    return int((distance < NEAR).sum()) // _TOGETHER * _TOGETHER
