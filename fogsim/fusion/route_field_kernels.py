"""Compiled algebra of a normal distribution over ln k at cells along a way."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel
from fogsim.linear_algebra import times

Floats = NDArray[np.float64]

LEAST_EXTINCTION, MOST_EXTINCTION = 1e-4, 0.5
"""Range of the extinctions that are reckoned with [1/m]."""


@kernel
def mean_extinction(mean: Floats, weights: Floats) -> tuple[float, Floats]:
    """Logarithm of the mean extinction over a stretch, and its derivative by each cell's ln k.

    Parameters
    ----------
    mean : (n,) float64
        ln k of the cells.
    weights : (n,) float64
        Share of the stretch that lies in each; their sum is 1.
    """
    largest, total = mean[0], 0.0
    for i in range(mean.size):
        if weights[i] > 0.0:
            largest = max(largest, mean[i])
    gradient = np.zeros(mean.size)
    for i in range(mean.size):
        if weights[i] > 0.0:
            gradient[i] = weights[i] * math.exp(mean[i] - largest)
            total += gradient[i]
    return largest + math.log(total), gradient / total


@kernel
def condition(mean: Floats, covariance: Floats, toward: Floats, moved: float, narrowed: float) -> None:
    """Take in what is learnt of one linear function of the cells, in place.

    Parameters
    ----------
    mean, covariance : (n,) and (n, n) float64
        Of the cells; written to.
    toward : (n,) float64
        Covariance of the cells with that function, over its variance.
    moved, narrowed : float
        By how much its mean grows, and by how much its variance falls.
    """
    for i in range(mean.size):
        mean[i] += moved * toward[i]
        for j in range(mean.size):
            covariance[i, j] -= narrowed * toward[i] * toward[j]


@kernel
def spread_with(covariance: Floats, gradient: Floats) -> tuple[Floats, float]:
    """Covariance of all cells with a linear function of them, and its variance.

    Parameters
    ----------
    covariance : (n, n) float64
        Of the cells.
    gradient : (n,) float64
        The function.
    """
    shared, variance = times(covariance, gradient), 0.0
    for i in range(gradient.size):
        variance += gradient[i] * shared[i]
    return shared, max(variance, 0.0)


@kernel
def stretch_weights(count: int, cell: float, rear: float, start: float, end: float) -> Floats:
    """Share of a stretch that lies in each cell; of one beyond all cells or without length, in the nearest.

    Parameters
    ----------
    count : int
        How many cells.
    cell, rear : float
        Length of one [m], and where the hindmost begins ahead of the vehicle [m], below 0.
    start, end : float
        Ends of the stretch ahead of the vehicle [m].
    """
    weights, total = np.zeros(count), 0.0
    for i in range(count):
        inside = min(rear + (i + 1) * cell, end) - max(rear + i * cell, start)
        if inside > 0.0:
            weights[i] = inside
            total += inside
    if total > 0.0:
        return weights / total
    weights[min(max(math.floor((start - rear) / cell), 0), count - 1)] = 1.0
    return weights


@kernel
def linearised(mean: Floats, covariance: Floats, weights: Floats) -> tuple[float, Floats, float]:
    """Logarithm of the mean extinction over a stretch: mean, covariance with all cells, and variance.

    A mean of exponentials is above the exponential of a mean: to second order by half of what the cells differ.

    Parameters
    ----------
    mean, covariance : (n,) and (n, n) float64
        Of the cells.
    weights : (n,) float64
        Share of the stretch that lies in each.
    """
    value, gradient = mean_extinction(mean, weights)
    shared, variance = spread_with(covariance, gradient)
    differing = -variance
    for i in range(mean.size):
        differing += gradient[i] * covariance[i, i]
    return value + 0.5 * max(differing, 0.0), shared, variance


@kernel
def shares_in_cells(samples: Floats, first: float, step: float, count: int) -> Floats:
    """Probability of each of evenly spaced cells by samples, spread evenly between one and the next.

    Parameters
    ----------
    samples : (n,) float64
        Ascending.
    first, step : float
        Middle of the first cell, and from one to the next.
    count : int
        How many; what lies beyond either end counts to the cell there.
    """
    out, before, j = np.zeros(count), 0.0, 0
    for i in range(count):
        edge = first + (i + 0.5) * step
        while j < samples.size and samples[j] <= edge:
            j += 1
        if j == samples.size or i == count - 1:
            below = 1.0
        elif j == 0:
            below = 0.0
        else:
            apart = samples[j] - samples[j - 1]
            below = (j - 0.5 + (edge - samples[j - 1]) / apart) / samples.size
        out[i] = below - before
        before = below
    return out


@kernel
def roll(mean: Floats, covariance: Floats, weights: Floats, level: float, rest: float) -> None:
    """Leave the hindmost cell and enter the next one ahead, in place.

    Parameters
    ----------
    mean, covariance : (n,) and (n, n) float64
        Of the cells; written to.
    weights : (n,) float64
        How the next cell's ln k goes by those of the cells before it, beforehand.
    level, rest : float
        Its mean beforehand, and its variance when those are known.
    """
    count = mean.size
    shared, variance = spread_with(covariance, weights)
    value = level
    for i in range(count):
        value += weights[i] * (mean[i] - level)
    for i in range(count - 1):
        mean[i] = mean[i + 1]
        for j in range(count - 1):
            covariance[i, j] = covariance[i + 1, j + 1]
    mean[count - 1] = value
    for i in range(count - 1):
        covariance[i, count - 1] = covariance[count - 1, i] = shared[i + 1]
    covariance[count - 1, count - 1] = variance + rest


@kernel
def factor(covariance: Floats) -> Floats:
    """Lower triangular matrix whose square is a covariance (Cholesky); what rounding makes negative counts as 0.

    Parameters
    ----------
    covariance : (n, n) float64
        Positive semidefinite.
    """
    count = len(covariance)
    lower = np.zeros((count, count))
    for j in range(count):
        square = covariance[j, j]
        for k in range(j):
            square -= lower[j, k] ** 2
        diagonal = math.sqrt(max(square, 1e-12))
        lower[j, j] = diagonal
        for i in range(j + 1, count):
            value = covariance[i, j]
            for k in range(j):
                value -= lower[i, k] * lower[j, k]
            lower[i, j] = value / diagonal
    return lower


@kernel
def sighted_extinctions(mean: Floats, lower: Floats, normals: Floats, ends: Floats, depth: float) -> Floats:
    """Samples of the mean extinction from the vehicle to where a depth is reached, as logarithms.

    Parameters
    ----------
    mean : (n,) float64
        ln k of the cells ahead.
    lower : (n, n) float64
        Triangular factor of their covariance.
    normals : (samples, n) float64
        Standard normal numbers.
    ends : (n,) float64
        Where each cell ends ahead of the vehicle [m].
    depth : float
        The optical depth [-].
    """
    out = np.empty(len(normals))
    for sample in range(len(normals)):
        reached, start, found = 0.0, 0.0, -1.0
        for i in range(mean.size):
            value = mean[i]
            for j in range(i + 1):
                value += lower[i, j] * normals[sample, j]
            k = min(max(math.exp(value), LEAST_EXTINCTION), MOST_EXTINCTION)
            if reached + k * (ends[i] - start) >= depth:
                found = depth / (start + (depth - reached) / k)
                break
            reached += k * (ends[i] - start)
            start = ends[i]
        out[sample] = math.log(found if found > 0.0 else reached / start)
    return out
