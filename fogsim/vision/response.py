"""The inverse of a camera's response: from pixel values back to light."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fogsim.response import exposure_of
from fogsim.values.camera import Response


@lru_cache(maxsize=len(Response))
def linear_table(response: Response) -> NDArray[np.float32]:
    """Light behind each of the 256 pixel values, in linear grey levels.

    Parameters
    ----------
    response : Response
        The told curve of the camera.

    Returns
    -------
    (256,) float32
        Linear grey levels 0 … 255, read-only; 0 and 255 map to themselves. sRGB: IEC 61966-2-1.
    """
    share = np.arange(256, dtype=np.float64) / 255.0
    table: NDArray[np.float32] = (255.0 * exposure_of(share, response)).astype(np.float32)
    table.flags.writeable = False
    return table
