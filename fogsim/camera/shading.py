"""How a lens darkens the corners of its pictures."""

import numpy as np
from numpy.typing import NDArray

from fogsim.values import Camera


def lens_shading(camera: Camera, strength: float) -> NDArray[np.float32]:
    """Light that each pixel gets, relative to the optical axis: 1 − strength · (1 − cos⁴ θ).

    cos⁴ of the angle θ to the optical axis is the natural vignetting of a thin lens; designs of lenses and correction
    in the camera take part of it back.

    Parameters
    ----------
    camera : Camera
        The true calibration.
    strength : float
        0 for none, 1 for all of it.

    Returns
    -------
    (rows, cols) float32
        Greater than 0, 1 on the axis.
    """
    u0, v0 = camera.principal_point
    across = (np.arange(camera.width) - u0) / camera.focal_length
    along = (np.arange(camera.height) - v0) / camera.focal_length
    # cos² θ = 1 / (1 + tan² θ)
    fourth = (1.0 + across**2 + along[:, None] ** 2) ** -2
    return (1.0 - strength * (1.0 - fourth)).astype(np.float32)
