"""Canny's edges of an image (Canny 1986), but for those that fog draws."""

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from fogsim.vision.light.medians import columns_apart, median, row_medians
from fogsim.vision.lines import edge_kernels

Image = NDArray[np.float32]

EDGE_FACTOR = 10.0
"""Gradient of an edge in multiples of the road's own median gradient, which is noise and asphalt grain [-]."""

MIN_GRADIENT = 1.5
"""Smallest gradient that can be an edge [linear grey levels per px]: that of the quantisation of 8 bits."""


@dataclass(frozen=True, slots=True)
class Gradient:
    """First derivatives of a smoothed image.

    Attributes
    ----------
    across, down : (rows, cols) float32
        Change a pixel to the right and downward [linear grey levels per px].
    """

    across: Image
    down: Image


@dataclass(frozen=True, slots=True)
class Edges:
    """Where an image has edges.

    Attributes
    ----------
    pixels : (rows, cols) uint8
        Non-zero on edges.
    threshold : float
        Gradient above which a pixel starts an edge [linear grey levels per px].
    gradient : Gradient
        Derivatives of the image, the fog's own gradient taken away.
    """

    pixels: NDArray[np.uint8]
    threshold: float
    gradient: Gradient


def smoothed(luminance: Image) -> Image:
    """Smooth with a Gaussian of 1 px, over 5 px; what lies outside is as the border.

    Parameters
    ----------
    luminance : (rows, cols) float32
        The image.
    """
    blurred = np.empty_like(luminance)
    edge_kernels.smooth(luminance, _gaussian(), blurred)
    return blurred


def _gaussian() -> Image:
    """Weights from the middle one on: the rest is its mirror image."""
    weights = np.exp(-0.5 * np.arange(edge_kernels.SMOOTH_TAPS + 1) ** 2)
    return np.asarray(weights / (2.0 * weights.sum() - weights[0]), np.float32)


class EdgeDetector:
    """Edge detector for images of one size, which works in buffers of its own.

    Large arrays made anew for every frame cost more than the filters: the result of a call is overwritten by the next.

    Parameters
    ----------
    derivatives : callable
        Writes the derivatives of its first argument, across and down, into its second and third.
    of_row, of_road : int
        Every which column a row's median gradient is of, and every which row and column the road's [px].
    """

    def __init__(
        self,
        derivatives: Callable[[Image, Image, Image], None],
        *,
        of_row: int = 32,
        of_road: int = 6,
    ) -> None:
        self._derivatives, self._of_row, self._of_road = derivatives, of_row, of_road
        self._shape: tuple[int, ...] = ()

    def __call__(self, luminance: Image, fog_slope: Image | None) -> Edges:
        """Find edges, without those that the fog itself draws.

        Fog makes rows brighten toward the horizon, and the steepest row is the inflection that is sought: a plain
        detector would draw an edge right there and stop the region below it (the published recipe's blind spot beyond
        some 300 m). So each row's median gradient is taken away first, as far as fog could have made it; what differs
        from its own row (vehicles, marks, kerbs) stays, and so does what is too steep for fog where it is. The
        thresholds follow the median gradient of the lower half, where the road is.

        Parameters
        ----------
        luminance : (rows, cols) float32
            Linear luminance, 0 … 255.
        fog_slope : (rows,) float32 or None
            Steepest brightening upward that fog can make of each row [linear grey levels per px]; None leaves the
            fog's gradient in, as published.

        Returns
        -------
        Edges
            The edge pixels, the threshold that they had to pass, and the gradient.
        """
        self._make_room(luminance.shape)
        across, down = self._gradient.across, self._gradient.down
        self._derivatives(luminance, across, down)
        slope = np.zeros(luminance.shape[0], np.float32)
        if fog_slope is not None:
            # Fog over a dark road brightens upward, so dI/dv is negative.
            medians = row_medians(columns_apart(down, self._of_row))
            slope = np.clip(medians, -fog_slope, 0.0).astype(np.float32)
        edge_kernels.squared_lengths(across, down, slope, self._squares)
        high = max(EDGE_FACTOR * _median_size(self._squares, self._of_road), MIN_GRADIENT)
        edge_kernels.trace_edges(across, down, self._squares, 0.5 * high, high, self._pixels)
        return Edges(self._pixels, high, self._gradient)

    def _make_room(self, shape: tuple[int, ...]) -> None:
        if shape != self._shape:
            self._shape = shape
            self._gradient = Gradient(np.empty(shape, np.float32), np.empty(shape, np.float32))
            self._squares: Image = np.zeros((shape[0] + 2, shape[1] + 2), np.float32)
            self._pixels: NDArray[np.uint8] = np.empty(shape, np.uint8)


def edge_map(blurred: Image, fog_slope: Image) -> Edges:
    """Edge pixels after Canny by Sobel's derivatives of an image that is smooth already.

    Parameters
    ----------
    blurred : (rows, cols) float32
        Smoothed linear luminance, 0 … 255.
    fog_slope : (rows,) float32
        Steepest brightening upward that fog can make of each row [linear grey levels per px].

    Returns
    -------
    Edges
        See `EdgeDetector`.
    """
    return EdgeDetector(_sobel, of_row=8, of_road=4)(blurred, fog_slope)


def _sobel(image: Image, across: Image, down: Image) -> None:
    cv2.Sobel(image, cv2.CV_32F, 1, 0, dst=across, scale=0.125, borderType=cv2.BORDER_REPLICATE)
    cv2.Sobel(image, cv2.CV_32F, 0, 1, dst=down, scale=0.125, borderType=cv2.BORDER_REPLICATE)


def _median_size(squares: Image, step: int) -> float:
    """Median size of the gradient in the lower half, of whose squares there is a border of one pixel."""
    inside = squares[1:-1, 1:-1]
    return median(np.sqrt(columns_apart(inside[len(inside) // 2 :: step], step)))
