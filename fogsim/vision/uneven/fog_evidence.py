"""Evidence of even and of other fog by the same measure, and the prior of how fog varies along the way."""

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import inverse_of
from fogsim.vision.strips import joint_fit, joint_kernels
from fogsim.vision.strips.albedo_filter import HIDDEN, HIDDEN_COST, LEFT_OUT_COST, USED
from fogsim.vision.strips.joint_fit import ALBEDO_CHANCES, ALBEDOS, JointFit
from fogsim.vision.strips.joint_kernels import Bins, JointPrior, Solution
from fogsim.vision.uneven.uneven_kernels import FogNodes

NODES = (0.0, *(12.0 * 1.4**i for i in range(5)), *(60.0 * 1.2**i for i in range(14)))
"""Nodes of the path [m]: nearly two rows apart, in a camera of 800 px·m, where the road is far."""

MEAN, BROAD = math.log(0.01), 1.6
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
    covariance = deviation**2 * (1.0 + apart) * np.exp(-apart) * share[:, None] * share + BROAD**2
    covariance += _ROUGHNESS**2 * np.eye(count)
    logarithm = joint_kernels.invert(covariance, np.empty_like(covariance))
    return FogNodes(nodes, MEAN, inverse_of(covariance), logarithm)


@functools.cache
def bank_nodes(first: int, count: int) -> FogNodes:
    """Nodes of fog that is even up to a bank, and even in it."""
    nodes = fog_nodes(*UNEVENNESS[0], count).nodes
    inside = (np.arange(count) >= first).astype(np.float64)
    covariance = BROAD**2 + BANK**2 * inside[:, None] * inside + _ROUGHNESS**2 * np.eye(count)
    logarithm = joint_kernels.invert(covariance, np.empty_like(covariance))
    return FogNodes(nodes, MEAN, inverse_of(covariance), logarithm)


Floats = NDArray[np.float64]

NEAR, _TOGETHER = 30.0, 3
"""Distance up to which bins are taken together [m], and how many."""

UNEVEN_CHANCES = (0.1, 0.05, 0.05, 0.05, 0.05)
"""How likely each unevenness is beforehand; even fog is the rest [-]."""

_OBSTACLE_CHANCE = 0.01
"""How likely it is that an obstacle that no sensor reports begins in a lane at one of its rows [-]."""

_STRANGE = 2.0
"""What an outlier adds to a cost next to its luminance's chance, where even fog is weighed against uneven [-]."""


@dataclass(frozen=True, slots=True)
class EvenFog:
    """Even fog over some albedo and course of the road."""

    cost: float  # Minus twice the logarithm of its evidence with its chance [-]
    # extinction, variance: k [1/m], and its variance
    extinction: float
    variance: float
    left_out: int  # How many bins it leaves unexplained


def even_fog_over(bins: Bins, albedo: int, prior: JointPrior, start: JointFit) -> EvenFog:
    """Even fog over one of the albedos, with ln k as its parameter and what is known of that."""
    albedos = joint_fit.under_sky(ALBEDOS[albedo], prior)
    first = np.array([max(start.extinction, 1e-5), start.airlight, start.shift, 0.0])
    found = joint_kernels.gauss_newton(bins, albedos, prior, first, joint_fit.MORE_STEPS)
    k, variance = max(float(found.theta[0]), 1e-5), float(found.covariance[0, 0])
    apart = (math.log(k) - MEAN) / BROAD
    cost = found.cost + math.log(variance) + math.log(k * k / variance + BROAD**-2) + math.log(BROAD**2) + apart**2
    chance = ALBEDO_CHANCES[albedo] * (1.0 - sum(UNEVEN_CHANCES))
    cost += hidden_cost(found, bins) - 2.0 * math.log(chance)
    return EvenFog(cost, float(found.theta[0]), variance, left_out(found, bins))


def left_out(found: Solution, bins: Bins) -> int:
    """How many bins a fit leaves unexplained."""
    return int(((found.used != USED) & (bins.noise > 0)).sum())


def hidden_cost(found: Solution, bins: Bins) -> float:
    """What is to be added to a cost for bins behind obstacles and for outliers.

    In the fit of one fog they are cheap and dear, so that what is behind an obstacle is left out whole. Next to an
    obstacle, denser fog is another explanation, and the two are weighed fairly: either's luminance may be any.
    """
    hidden = (found.used == HIDDEN) & (bins.noise > 0)
    outliers = int(((found.used == 0) & (bins.noise > 0)).sum())
    any_luminance = math.log(float(found.theta[-3]) ** 2 / (2.0 * math.pi))
    cost = float((any_luminance - HIDDEN_COST - np.log(bins.noise[hidden])).sum())
    obstacles = int(hidden.any(axis=1).sum())
    return cost - (LEFT_OUT_COST - _STRANGE) * outliers - 2.0 * math.log(_OBSTACLE_CHANCE) * obstacles


def thinned_bins(bins: Bins) -> Bins:
    """Bins of the near road taken together by threes: there fog varies little from bin to bin."""
    near = _taken_together(bins.distance)
    if near == 0:
        return bins

    def mean(values: Floats) -> Floats:
        grouped = values[..., :near].reshape(*values.shape[:-1], -1, _TOGETHER).mean(axis=-1)
        return np.ascontiguousarray(np.concatenate([grouped, values[..., near:]], axis=-1))

    seen = (bins.noise > 0).astype(np.float64)
    share = mean(seen)
    of_seen = np.maximum(share, 1e-9)
    sizes = np.where(np.arange(bins.below.size) < near, _TOGETHER, 1).astype(np.float64)
    sizes = mean(sizes)
    return Bins(
        luminance=mean(bins.luminance * seen) / of_seen,
        noise=np.where(share > 0.5, mean(bins.noise) / of_seen**2 / sizes, 0.0),
        path=mean(bins.path),
        off_axis=mean(bins.off_axis),
        below=mean(bins.below),
        half=mean(bins.half) * sizes,
        distance=mean(bins.distance),
        extent=mean(bins.extent) * sizes,
        grazing=mean(bins.grazing),
        darker=bins.darker,
        darker_by_row=bins.darker_by_row,
        eye=bins.eye,
    )


def of_each_bin(thinned: NDArray[np.bool_], distance: Floats) -> NDArray[np.bool_]:
    """(strips, n) bool: values of thinned bins, repeated for all.

    Takes `thinned` (strips, thinned) bool, `distance` (n,) [m].
    """
    near = _taken_together(distance)
    groups = near // _TOGETHER
    return np.concatenate([np.repeat(thinned[:, :groups], _TOGETHER, axis=1), thinned[:, groups:]], axis=1)


def _taken_together(distance: Floats) -> int:
    """How many of the nearest bins are taken together."""
    return int((distance < NEAR).sum()) // _TOGETHER * _TOGETHER
