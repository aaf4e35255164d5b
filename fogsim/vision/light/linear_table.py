"""The inverse of a camera's response: from pixel values back to light."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Response
from fogsim.values.camera_response import exposure_of


@lru_cache(maxsize=3 * len(Response))
def linear_table(response: Response, bits: int = 8) -> NDArray[np.float32]:
    """Light behind each pixel value, in linear grey levels that are the same for every bit depth.

    Parameters
    ----------
    response : Response
        The told curve of the camera.
    bits : int
        Its bit depth.

    Returns
    -------
    (2^bits,) float32
        Linear grey levels 0 … 255, read-only; the first is 0 and the last 255. sRGB: IEC 61966-2-1.
    """
    share = np.arange(2**bits, dtype=np.float64) / (2**bits - 1)
    table: NDArray[np.float32] = (255.0 * exposure_of(share, response)).astype(np.float32)
    table.flags.writeable = False
    return table
