"""Ground truth as PNG files: the meaning of their values, and how to read them."""

import contextlib
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from fogsim.core.files.readers import read_bytes
from fogsim.errors import FogSimError, InputError

DEPTH_UNIT = 0.01
"""Distance per step of a depth image [m]."""

TRANSMISSION_UNIT = 1.0 / 65_535
"""Transmission per step of a transmission image [-]."""

_MOST = 65_535
_COMPRESSION = 3  # of 9; more takes several times as long for a few per cent

_PNG_START = b"\x89PNG\r\n\x1a\n"
PNG_END = b"\0\0\0\0IEND\xaeB`\x82"
"""Last bytes of a PNG file that is not cut off."""


def encoded_depth(distance: NDArray[np.float32]) -> NDArray[np.uint16]:
    """Distance along the ray as 16-bit values in centimetres.

    Parameters
    ----------
    distance : (rows, cols) float32
        Distance [m]; ``inf`` for the sky.

    Returns
    -------
    (rows, cols) uint16
        1 … 65 534 centimetres; 0 for the sky; 65 535 for 655.35 m and more.
    """
    steps = np.clip(np.rint(np.minimum(distance, 1e6) / DEPTH_UNIT), 1, _MOST)
    return np.where(np.isinf(distance), 0, steps).astype(np.uint16)


def decoded_depth(values: NDArray[np.uint16]) -> NDArray[np.float64]:
    """Distance along the ray from the values of a depth image.

    Parameters
    ----------
    values : (rows, cols) uint16
        Values from `encoded_depth`.

    Returns
    -------
    (rows, cols) float64
        Distance [m]; ``inf`` for the sky; 655.35 stands for that and more.
    """
    return np.where(values == 0, np.inf, values * DEPTH_UNIT)


def encoded_transmission(transmission: NDArray[np.float32]) -> NDArray[np.uint16]:
    """Transmission 0 … 1 as 16-bit values 0 … 65 535.

    Parameters
    ----------
    transmission : (rows, cols) float32
        Transmittance, 0 … 1.
    """
    return np.rint(np.clip(transmission, 0.0, 1.0) * np.float64(_MOST)).astype(np.uint16)


def decoded_transmission(values: NDArray[np.uint16]) -> NDArray[np.float64]:
    """Transmission 0 … 1 from the values of a transmission image.

    Parameters
    ----------
    values : (rows, cols) uint16
        Values from `encoded_transmission`.
    """
    return np.asarray(values * TRANSMISSION_UNIT)


def png(image: NDArray[np.uint8] | NDArray[np.uint16]) -> bytes:
    """PNG file of an image (rows, cols[, 3]), red first, with all its bits."""
    # OpenCV has blue first.
    pixels: NDArray[Any] = image if image.ndim == 2 else np.ascontiguousarray(image[..., ::-1])
    done, data = cv2.imencode(".png", pixels, [cv2.IMWRITE_PNG_COMPRESSION, _COMPRESSION])
    if not done:
        raise FogSimError(f"an image of {image.shape} {image.dtype} could not be written as PNG")
    return data.tobytes()


def read_png(path: Path) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """Image of a PNG file, with all its bits.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    (rows, cols) or (rows, cols, 3) uint8 or uint16
        Pixel values, red first.

    Raises
    ------
    InputError
        If it is not a readable PNG file, or has opacity.
    """
    data = read_bytes(Path(path))
    if not (data.startswith(_PNG_START) and PNG_END in data):
        raise InputError(f"{path}: expected a PNG file, got another one or a part of one")
    image: NDArray[Any] | None = None
    with contextlib.suppress(cv2.error, MemoryError):  # of a header that announces more pixels than OpenCV reads
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise InputError(f"{path}: this PNG file is damaged")
    if image.ndim == 3 and image.shape[2] > 3:
        raise InputError(f"{path}: expected a grey or colour image as in a data set, got one with opacity")
    return image if image.ndim == 2 else np.ascontiguousarray(image[..., ::-1])
