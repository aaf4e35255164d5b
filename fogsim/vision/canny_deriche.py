"""The Canny–Deriche edge detector (Canny 1986, Deriche 1987), with edges that are not fog."""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from fogsim.vision import kernels
from fogsim.vision.deriche import Gradient, derivative_kernel, smoothing_kernel
from fogsim.vision.edges import EDGE_FACTOR, MIN_GRADIENT
from fogsim.vision.median import median, row_medians

GRADIENT_STEPS = 128.0  # fixed-point steps per grey level in the 16-bit gradients that the detector takes


@dataclass(frozen=True, slots=True)
class DericheEdges:
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


class CannyDeriche:
    """Edge detector for images of one size, which works in buffers of its own.

    Large arrays made anew for every frame cost more than the filters: the result of a call is overwritten by the next.
    """

    def __init__(self) -> None:
        self._shape: tuple[int, ...] = ()

    def __call__(self, luminance: NDArray[np.float32], fog_slope: NDArray[np.float32] | None) -> DericheEdges:
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
        DericheEdges
            The edge pixels, the threshold that they had to pass, and the gradient.
        """
        self._make_room(luminance.shape)
        smooth, derivative = (k.astype(np.float32) for k in (smoothing_kernel(), derivative_kernel()))
        border = cv2.BORDER_REPLICATE
        cv2.sepFilter2D(luminance, cv2.CV_32F, derivative, smooth, dst=self._across, borderType=border)
        cv2.sepFilter2D(luminance, cv2.CV_32F, smooth, derivative, dst=self._down, borderType=border)
        slope = np.zeros(luminance.shape[0], np.float32)
        if fog_slope is not None:
            # Fog over a dark road brightens upward, so dI/dv is negative.
            slope = np.clip(row_medians(self._down[:, ::32]), -fog_slope, 0.0).astype(np.float32)
        kernels.levelled_gradient(self._across, self._down, slope, GRADIENT_STEPS, *self._fixed)
        high = max(EDGE_FACTOR * _median_gradient(self._across, self._down), MIN_GRADIENT)
        low_step, high_step = 0.5 * high * GRADIENT_STEPS, high * GRADIENT_STEPS
        cv2.Canny(*self._fixed, low_step, high_step, edges=self._pixels, L2gradient=True)
        return DericheEdges(self._pixels, high, Gradient(self._across, self._down))

    def _make_room(self, shape: tuple[int, ...]) -> None:
        if shape != self._shape:
            self._shape = shape
            self._across: NDArray[np.float32] = np.empty(shape, np.float32)
            self._down: NDArray[np.float32] = np.empty(shape, np.float32)
            self._fixed: tuple[NDArray[Any], NDArray[Any]] = (np.empty(shape, np.int16), np.empty(shape, np.int16))
            self._pixels: NDArray[np.uint8] = np.empty(shape, np.uint8)


def _median_gradient(across: NDArray[np.float32], down: NDArray[np.float32]) -> float:
    lower = slice(across.shape[0] // 2, None, 6)
    return median(np.hypot(across[lower, ::6], down[lower, ::6]))
