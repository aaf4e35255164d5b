"""Linear luminance of an image."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.values.camera import Response
from fogsim.vision.light import pixel_kernels
from fogsim.vision.light.linear_table import linear_table


def linear_luminance(
    image: NDArray[np.uint8] | NDArray[np.uint16], response: Response, bits: int = 8
) -> NDArray[np.float32]:
    """Undo a camera's response and weigh the colours to luminance (ITU-R BT.709).

    Parameters
    ----------
    image : (rows, cols) or (rows, cols, 3) uint8, or uint16 for more than 8 bits
        Pixel values 0 … 2^bits − 1, red first.
    response : Response
        The told curve of the camera.
    bits : int
        Its bit depth.

    Returns
    -------
    (rows, cols) float32
        Linear grey levels 0 … 255 at every bit depth; of a grey image and of a colour image with three equal channels
        the same.

    Raises
    ------
    InputError
        If the image is not of the type that its bit depth has.
    """
    expected = np.uint8 if bits == 8 else np.uint16
    if image.dtype != expected:
        raise InputError(f"an image of {bits} bits must have dtype {np.dtype(expected)}, got {image.dtype}")
    # A copy of the cached table: numba would compile a second kernel for a read-only array.
    table = linear_table(response, bits).copy()
    pixels: NDArray[Any] = np.ascontiguousarray(image)
    luminance_of = pixel_kernels.grey_luminance if pixels.ndim == 2 else pixel_kernels.colour_luminance
    return luminance_of(pixels, table)
