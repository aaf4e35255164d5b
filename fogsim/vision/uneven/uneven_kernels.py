"""Compiled fit of fog whose extinction varies along the road: ln k at nodes of the path, with a prior covariance.

Where `joint_kernels` has e^(−k d), here is e^(−τ(d)), τ = ∫ k, with k straight between the nodes.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.core.linear_algebra import times
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.vision.light.medians import median_among
from fogsim.vision.strips.albedo_filter import (
    Albedo,
    Residuals,
    hide_behind_obstacles,
    whiten,
)
from fogsim.vision.strips.joint_kernels import (
    Bins,
    JointPrior,
    Solution,
    add_bins,
    allocated,
    invert,
    near_road,
    under_sky,
)

OTHERS = 3
"""Parameters next to the cells: airlight, rows by which the horizon is lower, vignetting that is left."""

_LONGEST_STEP = 1.2
"""Longest step of ln k of a cell [-]."""

_THINNEST, _DENSEST = math.log(1e-5), math.log(0.5)
"""Least and greatest ln k of a cell [ln 1/m]."""

_CONVERGED = 0.03
"""Longest step of ln k below which only one more is made [-]."""

_HALVINGS = 4
"""How often a step that leads uphill is halved."""

_DEEPEST = 3.5
"""Optical depth beyond which a bin's luminance is ignored in the first guess [-]."""

_TOLERANCE, _TOLERANT = 0.06, 4
"""Deviation of the first guess's luminance, relative to the airlight [-], and steps over which it is halved each time
before bins count as sharp as they are: else a guess that is a little off would take far fog for an obstacle."""

_SWALLOWED = 1.0
"""Least optical depth of what is seen for fog ahead to be called denser [-]: it swallows most of the road there. Over
crests and in sags road seems to fade a little."""

_DENSER, _SURELY_DENSER = math.log(2.5), 2.5
"""Rise of ln k from the near road on, beyond which fog ahead is denser, and its least in standard deviations [-]."""

NEAR = 30.0
"""Path over which the first guess takes the fog for even [m]."""


class FogNodes(NamedTuple):
    """Nodes of the path ahead, and what is known of their ln k beforehand."""

    nodes: NDArray[np.float64]  # (m,): Where they are along the path [m], the first at 0; beyond the last k is as there
    mean: float  # Mean of ln k [ln 1/m]
    precision: NDArray[np.float64]  # (m, m): Inverse of its covariance
    log_determinant: float  # Logarithm of the determinant of its covariance


@kernel
def _depths_at_nodes(nodes: NDArray[np.float64], extinctions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Optical depth up to each node [-] (`nodes` (m,) [m], `extinctions` (m,) [1/m])."""
    depths = np.zeros(nodes.size)
    for j in range(1, nodes.size):
        depths[j] = depths[j - 1] + 0.5 * (extinctions[j - 1] + extinctions[j]) * (nodes[j] - nodes[j - 1])
    return depths


@kernel
def _before(nodes: NDArray[np.float64], distance: float) -> int:
    """Last node before a distance."""
    node = nodes.size - 1
    while node > 0 and nodes[node] > distance:
        node -= 1
    return node


@kernel
def _beyond(nodes: NDArray[np.float64], node: int, distance: float) -> tuple[float, float]:
    """Weights of a node's extinction, and of the next one's, in the optical depth from the one to a distance [m]."""
    rest = distance - nodes[node]
    if node + 1 == nodes.size:
        return rest, 0.0
    second = 0.5 * rest * rest / (nodes[node + 1] - nodes[node])
    return rest - second, second


@kernel
def _extinction_at(nodes: NDArray[np.float64], extinctions: NDArray[np.float64], node: int, distance: float) -> float:
    """Extinction at a distance beyond a node [1/m]."""
    if node + 1 == nodes.size:
        return float(extinctions[node])
    share = (distance - nodes[node]) / (nodes[node + 1] - nodes[node])
    return float(extinctions[node] + share * (extinctions[node + 1] - extinctions[node]))


@kernel
def _node_weights(nodes: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m, m): weight of each node's extinction (column) in the optical depth up to each node (row) [m]."""
    weights = np.zeros((nodes.size, nodes.size))
    for j in range(1, nodes.size):
        half = 0.5 * (nodes[j] - nodes[j - 1])
        weights[j] = weights[j - 1]
        weights[j, j - 1] += half
        weights[j, j] += half
    return weights


@kernel
def _linearise(
    bins: Bins, strip: int, theta: NDArray[np.float64], road: float, nodes: NDArray[np.float64], out: Residuals
) -> None:
    """Residual and derivatives by cells, airlight, horizon and vignetting of one strip."""
    cells = nodes.size
    extinctions, weights = np.exp(theta[:cells]), _node_weights(nodes)
    depths = _depths_at_nodes(nodes, extinctions)
    airlight, shift, vignetting = theta[cells], theta[cells + 1], theta[cells + 2]
    drop = road - airlight
    columns, scale, veil = out.columns[strip], out.scale[strip], out.veil[strip]
    by_node = np.empty(cells)
    for i in range(bins.below.size):
        value, by_shift = 0.0, 0.0
        by_node[:] = 0.0
        for j in range(3):
            rows = bins.below[i] - shift + (j - 1) * bins.half[i]
            if rows <= 0.0:
                continue
            distance = bins.path[strip, i] / rows
            node = _before(nodes, distance)
            first, second = _beyond(nodes, node, distance)
            depth = depths[node] + first * extinctions[node]
            if second > 0.0:
                depth += second * extinctions[node + 1]
            part = (4.0 if j == 1 else 1.0) / 6.0 * math.exp(-depth)
            value += part
            by_shift -= _extinction_at(nodes, extinctions, node, distance) * distance / rows * part
            for c in range(node + 1):
                by_node[c] -= part * extinctions[c] * weights[node, c]
            by_node[node] -= part * extinctions[node] * first
            if second > 0.0:
                by_node[node + 1] -= part * extinctions[node + 1] * second
        off_axis = bins.off_axis[strip, i]
        bright, open_part = airlight + drop * value, 1.0 - vignetting * off_axis
        columns[i, 0] = bins.luminance[strip, i] - bright * open_part
        for c in range(cells):
            columns[i, 1 + c] = drop * by_node[c] * open_part
        columns[i, cells + 1] = (1.0 - value) * open_part
        columns[i, cells + 2] = drop * by_shift * open_part
        columns[i, cells + 3] = -bright * off_axis
        scale[i], veil[i] = road * value, airlight * (1.0 - value)


@kernel
def _add_prior(
    theta: NDArray[np.float64],
    prior: JointPrior,
    fog: FogNodes,
    normal: NDArray[np.float64],
    gradient: NDArray[np.float64],
) -> float:
    """Add what is known beforehand to the normal equations; returns what it adds to the cost."""
    cells, cost = fog.nodes.size, fog.log_determinant
    for a in range(cells):
        pull = 0.0
        for b in range(cells):
            normal[a, b] += fog.precision[a, b]
            pull += fog.precision[a, b] * (theta[b] - fog.mean)
        gradient[a] -= pull
        cost += pull * (theta[a] - fog.mean)
    off, lower, left = theta[cells] - prior.airlight, theta[cells + 1] - prior.shift, theta[cells + 2]
    weights = (
        1.0 / (prior.below if off < 0.0 else prior.above) ** 2,
        1.0 / prior.shift_deviation**2,
        1.0 / prior.vignetting_deviation**2,
    )
    for j, apart in enumerate((off, lower, left)):
        normal[cells + j, cells + j] += weights[j]
        gradient[cells + j] -= weights[j] * apart
        cost += weights[j] * apart * apart
    return cost


@kernel
def _blur(noise: NDArray[np.float64], airlight: float, iteration: int, out: NDArray[np.float64]) -> None:
    """Variances of the bins, in the first steps with what a first guess may be off."""
    tolerance = (_TOLERANCE * 0.4**iteration * airlight) ** 2 if iteration < _TOLERANT else 0.0
    for s in range(noise.shape[0]):
        for i in range(noise.shape[1]):
            out[s, i] = noise[s, i] + tolerance if noise[s, i] > 0.0 else 0.0


@kernel
def _move(
    theta: NDArray[np.float64],
    step: NDArray[np.float64],
    road: NDArray[np.float64],
    constants: NDArray[np.float64],
    shift_deviation: float,
) -> float:
    """Take a step, damped where it is long, and let each strip's luminance follow; returns the longest of ln k."""
    nodes, longest = theta.size - OTHERS, 0.0
    for c in range(nodes):
        longest = max(longest, abs(step[c]))
    damped = min(1.0, _LONGEST_STEP / max(longest, 1e-9))
    step *= min(damped, 1.5 * shift_deviation / max(abs(step[nodes + 1]), 1e-12))
    for strip in range(road.size):
        change = constants[strip, 0]
        for a in range(theta.size):
            change -= step[a] * constants[strip, a + 1]
        road[strip] *= min(max(1.0 + change, 0.5), 1.5)
    for c in range(nodes):
        step[c] = min(max(theta[c] + step[c], _THINNEST), _DENSEST) - theta[c]
    theta += step
    return longest


@kernel
def fit_uneven(
    bins: Bins, on_road: Albedo, prior: JointPrior, fog: FogNodes, start: NDArray[np.float64], iterations: int
) -> Solution:
    """Gauss–Newton from a start, a step that leads uphill halved.

    Returns Its ``theta`` as the start. Takes `start` (m + 3,).
    """
    albedo = under_sky(on_road, prior)
    strips, count = bins.luminance.shape
    cells = fog.nodes.size
    size = cells + OTHERS
    theta, road = start.copy(), np.empty(strips)
    for s in range(strips):
        guess = near_road(bins, s, math.exp(theta[0]), theta[cells], theta[cells + 1], 0.0)
        road[s] = min(max(guess, 0.01 * theta[cells]), theta[cells])
    residuals, whitened = allocated(strips, count, size + 1, bins.noise.copy())
    covariance: NDArray[np.float64] = np.eye(size)
    step, last, least, halvings = np.zeros(size), theta.copy(), np.inf, 0
    cost, squares, number = 0.0, 0.0, 0
    for iteration in range(iterations + 1):
        _blur(bins.noise, prior.airlight, iteration, residuals.noise)
        for s in range(strips):
            _linearise(bins, s, theta, road[s], fog.nodes, residuals)
        # What is an outlier is settled before the last steps, so that they converge.
        reject = iteration < max(iterations - 3, 1)
        cost = whiten(residuals, bins.changes, albedo, prior.airlight, reject, whitened)
        if reject and iteration >= _TOLERANT and hide_behind_obstacles(bins.noise, whitened.used):
            cost = whiten(residuals, bins.changes, albedo, prior.airlight, False, whitened)
        normal, gradient = np.zeros((size, size)), np.zeros(size)
        squares, number = add_bins(whitened, normal, gradient)
        cost += squares + _add_prior(theta, prior, fog, normal, gradient)
        cost += invert(normal, covariance)
        if iteration >= iterations:
            break
        if iteration > _TOLERANT and cost > least + 1.0 and halvings < _HALVINGS:
            halvings += 1
            step *= 0.5
            theta[:] = last + step
            continue
        least, halvings = cost, 0
        last[:] = theta
        step = times(covariance, gradient)
        longest = _move(theta, step, road, whitened.constants, prior.shift_deviation)
        if iteration > _TOLERANT and longest < _CONVERGED:
            iterations = min(iterations, iteration + 1)
    return Solution(theta, covariance, cost, squares / max(number, 1), road[0], whitened.used)


@kernel
def first_profile(bins: Bins, nodes: NDArray[np.float64], prior: JointPrior) -> NDArray[np.float64]:
    """First guess of ln k of each cell, from the contrast that each bin has left (`nodes` (m,) [m])."""
    strips, count = bins.luminance.shape
    sums, counts = np.zeros((nodes.size, 2)), np.zeros(nodes.size)
    depth, near = np.empty(strips), 0.0
    top = 0.0
    for _ in range(2):
        road = np.empty(strips)
        for s in range(strips):
            road[s] = min(near_road(bins, s, near, prior.airlight, prior.shift, 0.0), 0.98 * prior.airlight)
        sums[:], counts[:], top = 0.0, 0.0, 0.0
        for i in range(count):
            seen = 0
            for s in range(strips):
                if bins.noise[s, i] > 0.0:
                    left = (prior.airlight - bins.luminance[s, i]) / (prior.airlight - road[s])
                    depth[seen] = -math.log(min(max(left, math.exp(-_DEEPEST)), 2.0))
                    seen += 1
            rows = bins.below[i] - prior.shift
            if seen == 0 or rows <= 0.5:
                continue
            # Optical depth never falls with distance.
            top = max(top, min(median_among(depth[:seen]), _DEEPEST))
            cell = _before(nodes, bins.path[0, i] / rows)
            sums[cell, 0] += bins.path[0, i] / rows
            sums[cell, 1] += top
            counts[cell] += 1.0
        distance, before, known = 0.0, 0.0, False
        logs = np.full(nodes.size, _THINNEST)
        for c in range(nodes.size):
            if counts[c] > 0.0:
                middle, reached = sums[c, 0] / counts[c], sums[c, 1] / counts[c]
                if middle > distance + 1.0:
                    logs[c] = math.log(max((reached - before) / (middle - distance), 3e-4))
                    distance, before, known = middle, reached, True
                    continue
            logs[c] = logs[c - 1] if c > 0 and known else math.log(3e-3)
        near = math.exp(logs[_before(nodes, NEAR)])
    return logs


@kernel
def distance_at_depth(nodes: NDArray[np.float64], logs: NDArray[np.float64], depth: float) -> float:
    """Distance at which an optical depth is reached [m] (`nodes` (m,) [m], `logs` (m,))."""
    extinctions = np.exp(logs)
    depths, node = _depths_at_nodes(nodes, extinctions), nodes.size - 1
    while node > 0 and depths[node] > depth:
        node -= 1
    here, rest = extinctions[node], depth - depths[node]
    if node + 1 == nodes.size:
        return float(nodes[node] + rest / here)
    slope = (extinctions[node + 1] - here) / (nodes[node + 1] - nodes[node])
    # Root of slope x² / 2 + here x = rest, in the form that does not cancel.
    return float(nodes[node] + 2.0 * rest / (here + math.sqrt(max(here * here + 2.0 * slope * rest, 0.0))))


@kernel
def depth_at(
    nodes: NDArray[np.float64], logs: NDArray[np.float64], distance: float
) -> tuple[float, NDArray[np.float64]]:
    """Optical depth up to a distance [-], and its derivatives by ln k of each node.

    Takes `nodes` (m,) [m], `logs` (m,), `distance` [m].
    """
    extinctions, node = np.exp(logs), _before(nodes, distance)
    gradient: NDArray[np.float64] = _node_weights(nodes)[node] * extinctions
    first, second = _beyond(nodes, node, distance)
    gradient[node] += first * extinctions[node]
    if second > 0.0:
        gradient[node + 1] += second * extinctions[node + 1]
    return float(gradient.sum()), gradient


@kernel
def extinction_at(nodes: NDArray[np.float64], logs: NDArray[np.float64], distance: float) -> float:
    """Extinction at a distance [1/m] (`nodes` (m,) [m], `logs` (m,), `distance` [m])."""
    return _extinction_at(nodes, np.exp(logs), _before(nodes, distance), distance)


class _PathDepths(NamedTuple):
    """Optical depths along a path with the variance of each, and the mean extinction."""

    depth: NDArray[np.float64]  # (n,) [-]
    variance: NDArray[np.float64]  # (n,) [-]
    # mean, mean_variance: extinction up to the meteorological visibility, or to a reach that is nearer [1/m]
    mean: float
    mean_variance: float


@kernel
def path_depths(
    nodes: NDArray[np.float64],
    theta: NDArray[np.float64],
    covariance: NDArray[np.float64],
    distance: NDArray[np.float64],
    reach: float,
) -> _PathDepths:
    """Fog of a solution along the path (`nodes` (m,), `distance` (n,), `reach` [m])."""
    logs, depth, variance = theta[: nodes.size], np.empty(distance.size), np.empty(distance.size)
    for i in range(distance.size):
        depth[i], variance[i] = _depth_with_variance(nodes, logs, covariance, distance[i])
    visible = distance_at_depth(nodes, logs, OPTICAL_DEPTH_AT_VISIBILITY)
    whole, unsure = _depth_with_variance(nodes, logs, covariance, min(visible, reach))
    if visible > reach:
        return _PathDepths(depth, variance, whole / reach, unsure / (reach * reach))
    # A depth that is greater by dτ is reached dτ / k sooner.
    slope = whole / (visible * visible) / extinction_at(nodes, logs, visible)
    return _PathDepths(depth, variance, whole / visible, slope * slope * unsure)


@kernel
def _depth_with_variance(
    nodes: NDArray[np.float64], logs: NDArray[np.float64], covariance: NDArray[np.float64], distance: float
) -> tuple[float, float]:
    depth, gradient = depth_at(nodes, logs, distance)
    return depth, _variance(gradient, covariance)


@kernel
def _variance(weights: NDArray[np.float64], covariance: NDArray[np.float64]) -> float:
    """Variance of a weighted sum of the first parameters."""
    total = 0.0
    for a in range(weights.size):
        for b in range(weights.size):
            total += weights[a] * covariance[a, b] * weights[b]
    return total


@kernel
def denser_part(
    nodes: NDArray[np.float64],
    theta: NDArray[np.float64],
    covariance: NDArray[np.float64],
    reach: float,
) -> tuple[float, float, float]:
    """Where extinction reaches half of that of surely much denser fog, how surely [m], and that extinction [1/m].

    NaN without any up to a reach [m].
    """
    logs, weight, seen = theta[: nodes.size], np.empty(nodes.size), 0
    if depth_at(nodes, logs, reach)[0] < _SWALLOWED:
        return np.nan, np.nan, np.nan
    while seen < nodes.size and nodes[seen] <= reach:
        seen += 1
    for node in range(2, seen):
        rise = logs[node]
        # The near road is all before the node, each stretch weighed by its length.
        for a in range(node):
            weight[a] = -(nodes[a + 1] - nodes[a]) / (nodes[node] - nodes[0])
            rise += weight[a] * logs[a]
        weight[node] = 1.0
        if rise > _DENSER and rise > _SURELY_DENSER * math.sqrt(_variance(weight[: node + 1], covariance)):
            return _half_density(nodes, logs, node, node + int(np.argmax(logs[node:seen])))
    return np.nan, np.nan, np.nan


@kernel
def _half_density(
    nodes: NDArray[np.float64], logs: NDArray[np.float64], node: int, densest: int
) -> tuple[float, float, float]:
    """Where extinction reaches half of that of the densest node, how surely [m], and that extinction [1/m]."""
    half = logs[densest] - math.log(2.0)
    while logs[node] < half:
        node += 1
    before, after = float(nodes[node - 1]), float(nodes[node])
    share = (half - logs[node - 1]) / max(logs[node] - logs[node - 1], 1e-9)
    return before + min(max(share, 0.0), 1.0) * (after - before), 0.5 * (after - before), math.exp(logs[densest])
