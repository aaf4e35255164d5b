"""The one thing that estimators demand of an image."""

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.values.camera import Camera


def checked_image(image: object, camera: Camera) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """Return an image unchanged if it can have come from a camera.

    Parameters
    ----------
    image : (rows, cols) or (rows, cols, 3) uint8, or uint16 of a camera of 10 or 12 bits
        The pixels.
    camera : Camera
        The told calibration.

    Raises
    ------
    InputError
        If it is not an array of the camera's bit depth with two or three axes, or not of the camera's size.
    """
    expected, most = np.dtype(np.uint8 if camera.bits == 8 else np.uint16), 2**camera.bits - 1
    if not isinstance(image, np.ndarray):
        raise InputError(f"an image must be a numpy array of {expected}, got {type(image).__name__}")
    if image.dtype != expected:
        raise InputError(f"an image of {camera.bits} bits must have dtype {expected} (0 … {most}), got {image.dtype}")
    if not (image.ndim == 2 or (image.ndim == 3 and image.shape[2] == 3)):
        raise InputError(f"an image must have shape (rows, cols) or (rows, cols, 3), got {image.shape}")
    if image.shape[:2] != (camera.height, camera.width):
        raise InputError(
            f"the image has {image.shape[1]}×{image.shape[0]} pixels (width × height), "
            f"the camera was told as {camera.width}×{camera.height}"
        )
    if camera.bits > 8 and image.max() > most:
        raise InputError(f"an image of {camera.bits} bits must have values 0 … {most}, got one of {image.max()}")
    return image


def checked_count(name: str, value: object, least: int) -> int:
    """Return a number unchanged if it is whole and large enough.

    Parameters
    ----------
    name : str
        What it is called.
    value : object
        The number.
    least : int
        Smallest that is allowed.

    Raises
    ------
    InputError
        If it is not.
    """
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise InputError(f"{name} must be a whole number ≥ {least}, got {value!r}")
    return value
