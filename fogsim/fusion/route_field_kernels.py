"""Compiled algebra of a normal distribution over ln k at cells along a way."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

Floats = NDArray[np.float64]

_LEAST_EXTINCTION, _MOST_EXTINCTION = 1e-4, 0.5
"""Range of the extinctions that are reckoned with [1/m]."""

_LOG_RANGE = 7.0
"""ln k that a wrong measurement may have any of [-]."""

_WEIGHED = 41
"""Values over which a likelihood is weighed."""


@kernel
def mean_extinction(mean: Floats, weights: Floats) -> tuple[float, Floats]:
    """Logarithm of the mean extinction over a stretch, and its derivative by each cell's ln k (n,)."""
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
    """Learn the value of one linear function `toward` (n,) of the cells: updates `mean` and `covariance` in place."""
    for i in range(mean.size):
        mean[i] += moved * toward[i]
        for j in range(mean.size):
            covariance[i, j] -= narrowed * toward[i] * toward[j]


@kernel
def _spread_with(covariance: Floats, gradient: Floats) -> tuple[Floats, float]:
    """Covariance (n,) of all cells with a linear function of them, and its variance."""
    shared, variance = np.zeros(gradient.size), 0.0
    for j in range(gradient.size):
        if gradient[j] != 0.0:
            for i in range(gradient.size):
                shared[i] += gradient[j] * covariance[j, i]
    for i in range(gradient.size):
        variance += gradient[i] * shared[i]
    return shared, max(variance, 0.0)


@kernel
def marginals(covariance: Floats, rear: float, cell: float) -> tuple[Floats, Floats]:
    """Where the middle of each cell is ahead of the vehicle [m], and the standard deviation of its ln k [-]."""
    middles, deviations = np.empty(len(covariance)), np.empty(len(covariance))
    for i in range(len(covariance)):
        middles[i] = rear + cell * (i + 0.5)
        deviations[i] = math.sqrt(max(covariance[i, i], 0.0))
    return middles, deviations


@kernel
def stretch_weights(count: int, cell: float, rear: float, start: float, end: float) -> Floats:
    """Share of a stretch [m] that lies in each cell; of one beyond all cells or without length, in the nearest."""
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
    """Logarithm of the mean extinction over a stretch: mean, covariance (n,) with all cells, and variance.

    A mean of exponentials is above the exponential of a mean: to second order by half of what the cells differ.
    """
    value, gradient = mean_extinction(mean, weights)
    shared, variance = _spread_with(covariance, gradient)
    differing = -variance
    for i in range(mean.size):
        differing += gradient[i] * covariance[i, i]
    return value + 0.5 * max(differing, 0.0), shared, variance


@kernel
def learn(
    mean: Floats,
    covariance: Floats,
    weights: Floats,
    value: float,
    deviation: float,
    wrong: float,
    floor: float,
    share: float,
) -> float:
    """Update in place with the mean extinction measured over a stretch; return the probability that it is right.

    The deviation is widened by 1 / √`share` for errors that repeat; whether it is wrong is judged without that.
    """
    before, shared, variance = linearised(mean, covariance, weights)
    total, apart = variance + max(deviation, floor) ** 2, value - before
    if variance <= floor**2 and apart**2 < 4.0 * total:
        return 1.0
    alone = variance + max(deviation * math.sqrt(share), floor) ** 2
    density = (1.0 - wrong) * math.exp(-0.5 * apart**2 / alone) / math.sqrt(2.0 * math.pi * alone)
    right = density / (density + wrong / _LOG_RANGE)
    gain = variance / total
    narrowed = right * gain * variance - right * (1.0 - right) * (gain * apart) ** 2
    condition(mean, covariance, shared / variance, right * gain * apart, narrowed)
    return right


@kernel
def learn_curve(
    mean: Floats,
    covariance: Floats,
    cell: float,
    rear: float,
    stretches: Floats,
    least: float,
    floor: float,
    wrong: float,
    share: float,
) -> None:
    """`learn` in turn what each stretch has measured: its start and end [m], ln k and the deviation of that (n, 4).

    Takes `mean` (n,), `covariance` (n, n), `cell`, `rear` [m].
    """
    for i in range(len(stretches)):
        weights = stretch_weights(mean.size, cell, rear, stretches[i, 0], stretches[i, 1])
        deviation = max(stretches[i, 3], least, floor) / math.sqrt(share)
        learn(mean, covariance, weights, stretches[i, 2], deviation, wrong, floor, share)


@kernel
def shares_in_cells(samples: Floats, first: float, step: float, count: int) -> Floats:
    """Probability of each of evenly spaced cells by samples (n,), spread evenly between one and the next."""
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
    """Leave the hindmost cell and enter the next one ahead, in place (`mean`, `covariance` (n, n), `weights` (n,))."""
    count = mean.size
    shared, variance = _spread_with(covariance, weights)
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
def extend_factor(covariance: Floats, upper: Floats, row: int) -> None:
    """Next column of the upper triangular U (n, n) with UᵀU a covariance (Cholesky), in place; below 0 counts as 0."""
    left = covariance[row].copy()
    for j in range(row):
        share = left[j] / upper[j, j]
        upper[j, row] = share
        for k in range(j + 1, row + 1):
            left[k] -= share * upper[j, k]
    upper[row, row] = math.sqrt(max(left[row], 1e-12))


@kernel
def sighted_extinctions(mean: Floats, covariance: Floats, normals: Floats, ends: Floats, depth: float) -> Floats:
    """Samples of ln of the mean extinction from the vehicle to where a depth is reached; `normals` (n, pairs)."""
    pairs = normals.shape[1]
    reached, found, apart = np.zeros(2 * pairs), np.zeros(2 * pairs), np.empty(pairs)
    start, waiting, upper = 0.0, 2 * pairs, np.empty_like(covariance)
    for i in range(mean.size):
        extend_factor(covariance, upper, i)
        apart[:] = 0.0
        for j in range(i + 1):
            for pair in range(pairs):
                apart[pair] += upper[j, i] * normals[j, pair]
        for sample in range(2 * pairs):
            if found[sample] > 0.0:
                continue
            value = mean[i] + (apart[sample] if sample < pairs else -apart[sample - pairs])
            k = min(max(math.exp(value), _LEAST_EXTINCTION), _MOST_EXTINCTION)
            more = k * (ends[i] - start)
            if reached[sample] + more >= depth:
                found[sample] = depth / (start + (depth - reached[sample]) / k)
                waiting -= 1
            reached[sample] += more
        start = ends[i]
        if waiting == 0:
            break
    for sample in range(2 * pairs):
        found[sample] = math.log(found[sample] if found[sample] > 0.0 else reached[sample] / start)
    return found


@kernel
def moments_at_most(
    before: float, variance: float, value: float, softness: float, wrong: float, share: float
) -> tuple[float, float]:
    """Shift of the mean of a normal distribution that is likely below a value, and the variance that it keeps.

    With the probability `wrong` the value says nothing; it counts for a `share` of one that is new [-].
    """
    total = first = second = 0.0
    for i in range(_WEIGHED):
        apart = math.sqrt(variance) * (8.0 * i / (_WEIGHED - 1) - 4.0)
        below = 0.5 * math.erfc((before + apart - value) / (math.sqrt(2.0) * softness))
        weight = math.exp(-0.5 * apart**2 / variance) * (wrong + (1.0 - wrong) * below + 1e-12) ** share
        total += weight
        first += weight * apart
        second += weight * apart**2
    moved = first / total
    return moved, second / total - moved**2
