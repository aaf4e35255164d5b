"""The guided filter: what is filtered gets edges where its guide has some."""

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]


def guided_filter(guide: Floats, source: Floats, radius: int, regulariser: float) -> Floats:
    """Filter an image by a grey guide (He, Sun & Tang 2010, ECCV, eqs. 4–8).

    Returns the filtered image (rows, cols). Takes `guide`, `source` (rows, cols), `radius` [px].
    """
    slope, offset = _guided_coefficients(guide, source, radius, regulariser)
    return slope * guide + offset


def _guided_coefficients(guide: Floats, source: Floats, radius: int, regulariser: float) -> tuple[Floats, Floats]:
    """Coefficients a and b of the guided filter's q = a I + b, averaged over windows."""
    mean_guide, mean_source = box_mean(guide, radius), box_mean(source, radius)
    covariance = box_mean(guide * source, radius) - mean_guide * mean_source
    variance = box_mean(guide * guide, radius) - mean_guide * mean_guide
    slope = np.asarray(covariance / (variance + np.float32(regulariser)), np.float32)
    return box_mean(slope, radius), box_mean(mean_source - slope * mean_guide, radius)


def box_mean(image: Floats, radius: int) -> Floats:
    """Mean over square windows, of what of them is within the image (`image` (rows, cols), `radius` [px])."""
    side = (2 * radius + 1, 2 * radius + 1)
    return np.asarray(cv2.boxFilter(image, cv2.CV_32F, side, borderType=cv2.BORDER_REFLECT), np.float32)
