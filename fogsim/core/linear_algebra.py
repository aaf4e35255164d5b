"""Products and inverses of small matrices that are the same on every processor.

BLAS and LAPACK, which numpy's ``@`` and most of `numpy.linalg` call, round as it suits the processor that they find.
Here every operation is one of IEEE 754, in an order that only the shapes decide.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

_CLUSTERS = 3
"""Too large, too small, and right (section 4.3)."""

_ROUNDS = 50


def majority(values: Sequence[float], weights: Sequence[float], clusters: int = _CLUSTERS) -> NDArray[np.bool_]:
    """Which values (n,) are in the weightiest of some clusters, by weighted k-means on a line; all of a few values."""
    x, w = np.asarray(values, dtype=np.float64), np.asarray(weights, dtype=np.float64)
    if len(x) <= clusters:
        return np.ones(len(x), dtype=bool)
    order = np.argsort(x, kind="stable")
    share = (np.cumsum(w[order]) - 0.5 * w[order]) / w.sum()
    middles = np.interp((np.arange(clusters) + 0.5) / clusters, share, x[order])
    nearest = np.zeros(len(x), dtype=np.intp)
    for _ in range(_ROUNDS):
        nearest = np.argmin(np.abs(x[:, None] - middles), axis=1)
        moved = [
            np.average(x[nearest == i], weights=w[nearest == i]) if (nearest == i).any() else middles[i]
            for i in range(clusters)
        ]
        if np.array_equal(moved, middles):
            break
        middles = np.array(moved)
    return np.asarray(nearest == np.argmax([w[nearest == i].sum() for i in range(clusters)]))


def reduced(values: Sequence[float], weights: Sequence[float]) -> tuple[float, float]:
    """Mean and standard deviation of a mixture of normal distributions, one for each value (eq. 2)."""
    z, p = np.asarray(values, dtype=np.float64), np.asarray(weights, dtype=np.float64)
    mean, count = float((p * z).sum() / p.sum()), len(z)
    if count == 1:
        return mean, 1.0 / (math.sqrt(2.0 * math.pi) * float(p[0]))
    return mean, math.sqrt(float((p * (z - mean) ** 2).sum() / ((count - 1) / count * p.sum())))


_LEAST_PIVOT = 1e-14
"""Share of a diagonal element below which what others leave of it counts as nothing [-]."""


def matrix_product(left: NDArray[Any], right: NDArray[Any]) -> NDArray[Any]:
    """Product of matrices and vectors, as ``left @ right``; the last axis of `left` (…, n) is summed."""
    if right.ndim == 1:
        return np.asarray((left * right).sum(axis=-1))
    kind = left.dtype if left.dtype == right.dtype else np.result_type(left, right)
    rows = np.ascontiguousarray(left, kind)
    if left.ndim != 2:
        rows = rows.reshape(math.prod(left.shape[:-1]), left.shape[-1])
    out = np.zeros((len(rows), right.shape[1]), kind)
    _add_product(rows, np.ascontiguousarray(right, kind), out)
    return out if left.ndim == 2 else out.reshape(*left.shape[:-1], right.shape[1])


@kernel
def _add_product(left: NDArray[Any], right: NDArray[Any], out: NDArray[Any]) -> None:
    for i in range(left.shape[0]):
        for k in range(left.shape[1]):
            share = left[i, k]
            if share != 0.0:
                for j in range(right.shape[1]):
                    out[i, j] += share * right[k, j]


@kernel
def inverse_of(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inverse (n, n) of a symmetric matrix (n, n) without negative eigenvalues, such as that of normal equations.

    What it says nothing of, or nothing next to the others, has zeros in its row and column (a generalised inverse).
    Beaton's sweep operator (Goodnight 1979, The American Statistician 33, 149–158), the largest pivots first.
    """
    count = len(matrix)
    swept, left = matrix.copy(), np.ones(count, np.bool_)
    for _ in range(count):
        pivot, largest = -1, _LEAST_PIVOT
        for i in range(count):
            # Relative to what it was, so that units do not matter.
            if left[i] and swept[i, i] > largest * matrix[i, i]:
                pivot, largest = i, swept[i, i] / matrix[i, i]
        if pivot < 0:
            break
        left[pivot] = False
        _sweep(swept, pivot)
    for i in range(count):
        for j in range(count):
            swept[i, j] = 0.0 if left[i] or left[j] else -swept[i, j]
    return swept


@kernel
def _sweep(matrix: NDArray[np.float64], pivot: int) -> None:
    scale = 1.0 / matrix[pivot, pivot]
    for i in range(len(matrix)):
        if i != pivot:
            share = scale * matrix[i, pivot]
            for j in range(len(matrix)):
                if j != pivot:
                    matrix[i, j] -= share * matrix[pivot, j]
    for i in range(len(matrix)):
        matrix[i, pivot] *= scale
        matrix[pivot, i] = matrix[i, pivot]
    matrix[pivot, pivot] = -scale


@kernel
def cholesky_factor(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Lower factor L (n, n) of a positive definite matrix L·Lᵀ (`matrix` (n, n)); NaN where it is not."""
    count = len(matrix)
    factor, column = matrix.copy(), np.empty(count)
    for k in range(count):
        factor[k, k] = math.sqrt(factor[k, k])
        for i in range(k + 1, count):
            factor[k, i] = 0.0
            factor[i, k] /= factor[k, k]
            column[i] = factor[i, k]
        for i in range(k + 1, count):
            for j in range(k + 1, i + 1):
                factor[i, j] -= column[i] * column[j]
    return factor


@kernel
def solved_lower(factor: NDArray[np.float64], right: NDArray[np.float64]) -> NDArray[np.float64]:
    """X (n, m) with L·X = `right` (n, m), for a lower factor L (n, n)."""
    found = right.copy()
    for i in range(len(factor)):
        for k in range(i):
            for j in range(found.shape[1]):
                found[i, j] -= factor[i, k] * found[k, j]
        for j in range(found.shape[1]):
            found[i, j] /= factor[i, i]
    return found


@kernel
def solved_upper(factor: NDArray[np.float64], right: NDArray[np.float64]) -> NDArray[np.float64]:
    """X (n, m) with Lᵀ·X = `right` (n, m), for a lower factor L (n, n)."""
    found = right.copy()
    for i in range(len(factor) - 1, -1, -1):
        for j in range(found.shape[1]):
            found[i, j] /= factor[i, i]
        for k in range(i):
            for j in range(found.shape[1]):
                found[k, j] -= factor[i, k] * found[i, j]
    return found


@kernel
def times(matrix: NDArray[np.float64], vector: NDArray[np.float64]) -> NDArray[np.float64]:
    """Product (n,) of a matrix and a vector, for kernels (`matrix` (n, m), `vector` (m,))."""
    out = np.zeros(len(matrix))
    for i in range(len(matrix)):
        for j in range(len(vector)):
            out[i] += matrix[i, j] * vector[j]
    return out


@kernel
def convolution(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    """Full convolution (n + m - 1,) of two series (`one` (n,), `other` (m,))."""
    size, blocks = len(one) + len(other) - 1, (len(one) + 3) // 4
    # Four terms of a sum at a time, in their order: what has been summed is read and written a quarter as often.
    out, padded = np.zeros(size + 6), np.zeros(len(other) + 6)
    padded[3 : 3 + len(other)] = other
    parts = np.zeros(4 * blocks)
    parts[: len(one)] = one
    for block in range(blocks):
        first, second, third, fourth = parts[4 * block : 4 * block + 4]
        for j in range(len(other) + 3):
            total = out[4 * block + j] + first * padded[j + 3]
            total += second * padded[j + 2]
            total += third * padded[j + 1]
            out[4 * block + j] = total + fourth * padded[j]
    return out[:size]


def straight_line(x: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[float, float]:
    """Slope and height at zero of the straight line of least squares (`x`, `y` (n,))."""
    middle, level = float(x.mean()), float(y.mean())
    apart = x - middle
    slope = float(matrix_product(apart, y - level)) / float(matrix_product(apart, apart))
    return slope, level - slope * middle
