"""An image paired with what makes light of its values."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.units import LUMINANCE_WEIGHTS
from fogsim.values.camera import Camera
from fogsim.vision.light.linear_table import linear_table

Pixels = NDArray[np.uint8] | NDArray[np.uint16]


@dataclass(frozen=True, slots=True)
class LinearPixels:
    """An image with what makes light of its values.

    Attributes
    ----------
    pixels : (rows, cols, channels) uint8 or uint16
        Contiguous.
    tables : (channels, levels) float32
        Linear grey levels that each channel adds.
    """

    pixels: Pixels
    tables: NDArray[np.float32]


def linear_pixels(image: Pixels, camera: Camera) -> LinearPixels:
    """Pair an image with the inverse of its camera's response; no pixel is touched.

    Parameters
    ----------
    image : (rows, cols) or (rows, cols, 3) uint8 or uint16
        An image of the camera.
    camera : Camera
        The told calibration.
    """
    table = linear_table(camera.response, camera.bits)
    weights = np.array(LUMINANCE_WEIGHTS if image.ndim == 3 else (1.0,), np.float32)
    pixels: NDArray[Any] = np.ascontiguousarray(image if image.ndim == 3 else image[:, :, None])
    return LinearPixels(pixels, weights[:, None] * table)
