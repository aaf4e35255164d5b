"""A template's place in an image by normalised correlation, summed in an order that is the same on every processor."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

Floats = NDArray[np.float64]

_FLAT = 1e-12
"""Share of a template's power that a place must have to look like anything [-]."""

INDEPENDENT = 8.0
"""Neighbouring pixels that differ alike where a thing has changed: so many count as one [-]."""


class MatchCost(NamedTuple):
    """How unlikely each place of a template in an image is."""

    correlation: Floats  # (rows, cols): Correlation coefficient, 0 where negative [-]
    cost: Floats  # (rows, cols): Negative logarithm of the posterior, up to a constant [-]
    # row, col: place of the least cost
    row: int
    col: int


def match_cost(image: Floats, template: Floats, prior: Floats) -> MatchCost:
    """Correlate a template with every place of an image that it fits in, under what is known of its place.

    Takes `image` (rows, cols), `template` (m, n), `prior` (rows - m + 1, cols - n + 1).
    """
    correlation = np.clip(correlations(np.ascontiguousarray(image), np.ascontiguousarray(template)), 0.0, 0.9999)
    cost = 0.5 * template.size / INDEPENDENT * np.log1p(-(correlation**2)) + prior
    row, col = np.unravel_index(int(np.argmin(cost)), cost.shape)
    return MatchCost(correlation, cost, int(row), int(col))


def vertex(values: Floats, at: int) -> float:
    """Where the minimum at a sample lies between its neighbours, by a parabola [samples]; 0 at the border.

    Takes `values` (n,).
    """
    if not 0 < at < values.size - 1:
        return 0.0
    left, here, right = (float(value) for value in values[at - 1 : at + 2])
    bend = left - 2.0 * here + right
    return min(max(0.5 * (left - right) / bend, -0.5), 0.5) if bend > 0 else 0.0


@kernel
def correlations(image: Floats, template: Floats) -> Floats:
    """Correlation coefficient of a template with each place of an image that it fits in; 0 where either is even.

    Returns by the place of the template's first row and column (rows - m + 1, cols - n + 1). Takes `image` (rows,
    cols), `template` (m, n).
    """
    height, width = template.shape
    rows, cols = image.shape[0] - height + 1, image.shape[1] - width + 1
    found = np.zeros((rows, cols))
    centred = template - template.mean()
    power, level = (centred * centred).sum(), image.mean()
    for row in range(rows):
        cross, total, square = np.zeros(cols), np.zeros(cols), np.zeros(cols)
        for i in range(height):
            for j in range(width):
                weight = centred[i, j]
                for col in range(cols):
                    value = image[row + i, col + j] - level
                    cross[col] += weight * value
                    total[col] += value
                    square[col] += value * value
        for col in range(cols):
            both = (square[col] - total[col] * total[col] / template.size) * power
            if both > _FLAT * power * power:
                found[row, col] = cross[col] / math.sqrt(both)
    return found
