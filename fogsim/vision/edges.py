"""Edges that are not fog."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

EDGE_FACTOR = 10.0
"""Gradient of an edge in multiples of the road's own median gradient, which is noise and asphalt grain [-]."""

MIN_GRADIENT = 1.5
"""Smallest gradient that can be an edge [linear grey levels per px]: that of the quantisation of 8 bits."""

GRADIENT_STEPS = 32.0  # fixed-point steps per grey level in the 16-bit gradients that the detector takes


@dataclass(frozen=True, slots=True)
class Edges:
    """Where an image has edges.

    Attributes
    ----------
    pixels : (rows, cols) uint8
        Non-zero on edges.
    threshold : float
        Gradient above which a pixel starts an edge [linear grey levels per px].
    """

    pixels: NDArray[np.uint8]
    threshold: float


def smoothed(luminance: NDArray[np.float32]) -> NDArray[np.float32]:
    """Smooth (rows, cols) float32 with a Gaussian of 1 px."""
    return np.asarray(cv2.GaussianBlur(luminance, (5, 5), 1.0, borderType=cv2.BORDER_REPLICATE), np.float32)


def edge_map(blurred: NDArray[np.float32], fog_slope: NDArray[np.float32]) -> Edges:
    """Edge pixels after Canny, without those that the fog itself draws.

    A Gaussian of 1 px stands in for Deriche's recursive filter. Fog makes rows brighten toward the horizon, and the
    steepest row is the inflection that is sought: a plain detector would draw an edge right there and stop the
    region below it (the published recipe's blind spot beyond some 300 m). So each row's median gradient is taken away
    first, as far as fog could have made it; what differs from its own row (vehicles, marks, kerbs) stays, and so does
    what is too steep for fog where it is. The thresholds follow the median gradient of the lower half, where the road
    is.

    Parameters
    ----------
    blurred : (rows, cols) float32
        Smoothed linear luminance, 0 … 255.
    fog_slope : (rows,) float32
        Steepest brightening upward that fog can make of each row [linear grey levels per px].

    Returns
    -------
    Edges
        The edge pixels and the threshold that they had to pass.
    """
    across, down = _gradient(blurred, 1, 0), _gradient(blurred, 0, 1)
    # Fog over a dark road brightens upward, so dI/dv is negative.
    down -= np.clip(np.median(down[:, ::8], axis=1), -fog_slope, 0.0)[:, None]
    high = max(EDGE_FACTOR * _median_gradient(across, down), MIN_GRADIENT)
    low_step, high_step = 0.5 * high * GRADIENT_STEPS, high * GRADIENT_STEPS
    pixels = cv2.Canny(_fixed_point(across), _fixed_point(down), low_step, high_step, L2gradient=True)
    return Edges(np.asarray(pixels, np.uint8), high)


def _gradient(image: NDArray[np.float32], across: int, down: int) -> NDArray[np.float32]:
    """Sobel derivative [linear grey levels per px]."""
    sobel = cv2.Sobel(image, cv2.CV_32F, across, down, scale=0.125, borderType=cv2.BORDER_REPLICATE)
    return np.asarray(sobel, np.float32)


def _median_gradient(across: NDArray[np.float32], down: NDArray[np.float32]) -> float:
    lower = slice(across.shape[0] // 2, None, 4)
    return float(np.median(np.hypot(across[lower, ::4], down[lower, ::4])))


def _fixed_point(gradient: NDArray[np.float32]) -> NDArray[np.int16]:
    return np.asarray(np.rint(gradient * np.float32(GRADIENT_STEPS)), np.int16)
