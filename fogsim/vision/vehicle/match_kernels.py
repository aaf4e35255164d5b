"""A template in an image, by normalised correlation, summed in an order that is the same on every processor."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel

FLAT = 1e-12
"""Share of a template's power that a place must have to look like anything [-]."""


@kernel
def correlations(image: NDArray[np.float64], template: NDArray[np.float64]) -> NDArray[np.float64]:
    """Correlation coefficient of a template with each place of an image that it fits in; 0 where either is even.

    Parameters
    ----------
    image : (rows, cols) float64
        The image.
    template : (m, n) float64
        The template, m ≤ rows and n ≤ cols.

    Returns
    -------
    (rows - m + 1, cols - n + 1) float64
        By the place of the template's first row and column.
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
            if both > FLAT * power * power:
                found[row, col] = cross[col] / math.sqrt(both)
    return found
