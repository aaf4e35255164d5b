"""The boundary between pass and fail: Gaussian-process classification, and where the next runs show most of it.

Laplace approximation with a probit likelihood: Rasmussen & Williams (2006), Gaussian Processes for Machine Learning,
algorithms 3.1, 3.2 and 5.1. Further runs are drawn where the outcome is least certain: |mean| over standard deviation,
the learning function U of Echard, Gayton & Lemaire (2011), Structural Safety 33, 145.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import log_ndtr, ndtr

from fogsim.core.linear_algebra import cholesky_factor, matrix_product, solved_lower, solved_upper

Points = NDArray[np.float64]
"""(n, d) places in the space, each coordinate 0 … 1 over the range of its parameter (in logarithms where declared)."""

_SHORTEST, _LONGEST = 0.1, 20.0
"""Bounds of the length scales, as shares of a parameter's range [-]."""

_LEAST_SCALE, _GREATEST_SCALE = 1.0, 100.0
"""Bounds of the latent function's standard deviation [-]."""

_STARTS = ((10.0, 1.0), (30.0, 3.0))
"""Scale and length scale from which the likelihood is maximised."""

_ITERATIONS = 60
_ENOUGH = 1e-9
_JITTER = 1e-8


@dataclass(frozen=True, slots=True)
class Boundary:
    """A fitted classifier: latent values below 0 are failures."""

    points: Points
    signs: NDArray[np.float64]
    parameters: NDArray[np.float64]  # Logarithms of scale and length scales
    gradient: NDArray[np.float64]  # Of the log likelihood at the mode
    root: NDArray[np.float64]  # √W
    factor: NDArray[np.float64]  # Cholesky factor of B = I + √W K √W

    def latent(self, places: Points) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Mean and standard deviation of the latent function at places, (m,) each."""
        cross = _kernel(self.parameters, self.points, places)
        reduced = solved_lower(self.factor, self.root[:, None] * cross)
        variance = np.exp(2.0 * self.parameters[0]) - (reduced**2).sum(axis=0)
        return matrix_product(cross.T, self.gradient), np.sqrt(np.maximum(variance, 0.0))

    def failure(self, places: Points) -> NDArray[np.float64]:
        """Probability of failure at places (m,)."""
        mean, deviation = self.latent(places)
        return np.asarray(ndtr(-mean / np.sqrt(1.0 + deviation**2)), float)

    def choose(self, candidates: Points, number: int) -> NDArray[np.intp]:
        """Indices of the candidates to run next, each chosen as if those before had been run."""
        mean, deviation = self.latent(candidates)
        best = np.argsort(np.abs(mean) / np.maximum(deviation, _ENOUGH), kind="stable")[: max(200, 10 * number)]
        mean = mean[best]
        cross = _kernel(self.parameters, self.points, candidates[best])
        reduced = solved_lower(self.factor, self.root[:, None] * cross)
        covariance = _kernel(self.parameters, candidates[best], candidates[best]) - matrix_product(reduced.T, reduced)
        chosen: list[int] = []
        for _ in range(number):
            doubt = -np.abs(mean) / np.sqrt(np.maximum(covariance.diagonal(), _ENOUGH))
            doubt[chosen] = -np.inf
            one = int(np.argmax(doubt))
            chosen.append(one)
            # A probit observation near the boundary has W = 2/π.
            column = covariance[:, one] / np.sqrt(max(covariance[one, one], 0.0) + 0.5 * np.pi)
            covariance = covariance - np.outer(column, column)
        return best[chosen]


def fit_boundary(points: Points, failed: NDArray[np.bool_], near: Boundary | None = None) -> Boundary:
    """Fit a classifier to runs with both outcomes, beginning at the scales of a fit to fewer runs if there is one."""
    signs = np.where(failed, -1.0, 1.0)
    width = points.shape[1]
    bounds = [(np.log(_LEAST_SCALE), np.log(_GREATEST_SCALE))] + [(np.log(_SHORTEST), np.log(_LONGEST))] * width
    starts = [np.log([scale] + [length] * width) for scale, length in _STARTS] if near is None else [near.parameters]
    fits = [minimize(_loss, start, (points, signs), jac=True, bounds=bounds, method="L-BFGS-B") for start in starts]
    parameters = min(fits, key=lambda one: float(one.fun)).x
    _, gradient, root, factor, _ = _mode(_kernel(parameters, points, points), signs)
    return Boundary(points, signs, parameters, gradient, root, factor)


def _kernel(parameters: NDArray[np.float64], left: Points, right: Points) -> NDArray[np.float64]:
    scale, lengths = np.exp(parameters[0]), np.exp(parameters[1:])
    a, b = left / lengths, right / lengths
    squared = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1) - 2.0 * matrix_product(a, b.T)
    return np.asarray(scale**2 * np.exp(-0.5 * np.maximum(squared, 0.0)))


def _mode(
    kernel: NDArray[np.float64], signs: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], float]:
    """Latent values at the mode, gradient there, √W, factor of B, and log marginal likelihood."""
    latent, objective, coefficients = np.zeros(len(signs)), -np.inf, np.zeros(len(signs))
    for _ in range(_ITERATIONS):
        gradient, weight = _slopes(latent, signs)
        root = np.sqrt(weight)
        factor = cholesky_factor(np.eye(len(signs)) + root[:, None] * kernel * root)
        inner = weight * latent + gradient
        new = inner - root * _solved(factor, (root * matrix_product(kernel, inner))[:, None])[:, 0]
        # A full step may overshoot.
        step = 1.0
        while True:
            trial = coefficients + step * (new - coefficients)
            moved = matrix_product(kernel, trial)
            value = float(-0.5 * matrix_product(trial, moved) + log_ndtr(signs * moved).sum())
            if value >= objective or step < 1e-3:
                break
            step *= 0.5
        coefficients, latent, gain, objective = trial, moved, value - objective, value
        if gain < _ENOUGH:
            break
    gradient, weight = _slopes(latent, signs)
    root = np.sqrt(weight)
    factor = cholesky_factor(np.eye(len(signs)) + root[:, None] * kernel * root)
    return latent, gradient, root, factor, objective - float(np.log(factor.diagonal()).sum())


def _solved(factor: NDArray[np.float64], right: NDArray[np.float64]) -> NDArray[np.float64]:
    """Solution of L·Lᵀ·X = `right` (n, m)."""
    return solved_upper(factor, solved_lower(factor, np.ascontiguousarray(right)))


def _slopes(latent: NDArray[np.float64], signs: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gradient of the log likelihood, and its negative second derivative."""
    z = signs * latent
    ratio = np.exp(-0.5 * z**2 - 0.5 * np.log(2.0 * np.pi) - log_ndtr(z))
    return signs * ratio, np.maximum(ratio * (ratio + z), 1e-12)


def _loss(
    parameters: NDArray[np.float64], points: Points, signs: NDArray[np.float64]
) -> tuple[float, NDArray[np.float64]]:
    """Negative log marginal likelihood and its gradient (algorithm 5.1)."""
    kernel = _kernel(parameters, points, points) + _JITTER * np.eye(len(signs))
    latent, gradient, root, factor, likelihood = _mode(kernel, signs)
    z = signs * latent
    ratio = signs * gradient
    third = signs * ratio * ((z + ratio) * (z + 2.0 * ratio) - 1.0)
    inverse = root[:, None] * _solved(factor, np.diag(root))
    reduced = solved_lower(factor, root[:, None] * kernel)
    s2 = 0.5 * (kernel.diagonal() - (reduced**2).sum(axis=0)) * third
    slopes = []
    for number in range(len(parameters)):
        if number == 0:
            change = 2.0 * kernel
        else:
            lag = (points[:, None, number - 1] - points[:, number - 1]) / np.exp(parameters[number])
            change = kernel * lag**2
        s1 = 0.5 * float(matrix_product(gradient, matrix_product(change, gradient))) - 0.5 * float(
            (inverse * change).sum()
        )
        b = matrix_product(change, gradient)
        s3 = b - matrix_product(kernel, matrix_product(inverse, b))
        slopes.append(-(s1 + float(matrix_product(s2, s3))))
    return -likelihood, np.array(slopes)
