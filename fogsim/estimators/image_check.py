"""The one thing that estimators demand of an image."""

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.values.camera import Camera


def checked_image(image: object, camera: Camera) -> NDArray[np.uint8]:
    """Return an image unchanged if it can have come from a camera.

    Parameters
    ----------
    image : (rows, cols) or (rows, cols, 3) uint8
        The pixels.
    camera : Camera
        The told calibration.

    Raises
    ------
    InputError
        If it is not an array of uint8 with two or three axes, or not of the camera's size.
    """
    if not isinstance(image, np.ndarray):
        raise InputError(f"an image must be a numpy array of uint8, got {type(image).__name__}")
    if image.dtype != np.uint8:
        raise InputError(f"an image must have dtype uint8 (0 … 255), got {image.dtype}")
    if not (image.ndim == 2 or (image.ndim == 3 and image.shape[2] == 3)):
        raise InputError(f"an image must have shape (rows, cols) or (rows, cols, 3), got {image.shape}")
    if image.shape[:2] != (camera.height, camera.width):
        raise InputError(
            f"the image has {image.shape[1]}×{image.shape[0]} pixels (width × height), "
            f"the camera was told as {camera.width}×{camera.height}"
        )
    return image
