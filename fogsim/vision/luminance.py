"""Linear luminance of an image."""

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Response
from fogsim.vision import kernels
from fogsim.vision.response import linear_table


def linear_luminance(image: NDArray[np.uint8], response: Response) -> NDArray[np.float32]:
    """Undo a camera's response and weigh the colours to luminance (ITU-R BT.709).

    Parameters
    ----------
    image : (rows, cols) or (rows, cols, 3) uint8
        Pixel values, red first.
    response : Response
        The told curve of the camera.

    Returns
    -------
    (rows, cols) float32
        Linear grey levels 0 … 255; of a grey image and of a colour image with three equal channels the same.
    """
    # A copy of the cached table: numba would compile a second kernel for a read-only array.
    table = linear_table(response).copy()
    pixels = np.ascontiguousarray(image)
    luminance_of = kernels.grey_luminance if pixels.ndim == 2 else kernels.colour_luminance
    return luminance_of(pixels, table)
