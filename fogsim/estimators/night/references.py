"""What own head lamps show in fog of any density, as a method is told it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera


@dataclass(frozen=True, slots=True, eq=False)
class VeilReferences:
    """What a camera sees of a dark, flat road by own lamps, by cells.

    Attributes
    ----------
    camera : Camera
        The camera; cells are those of `camera_of_cells`.
    visibility : (n,) float64
        Meteorological visibilities, rising [m]; inf for a clear night.
    veil : (n, rows, cols) float64
        Luminance of the fog that the lamps light, before the road or the sky [cd/m²].
    road : (n, rows, cols) float64
        Luminance of the road that they light, of asphalt, through the fog [cd/m²]; 0 above the horizon.
    """

    camera: Camera
    visibility: NDArray[np.float64]
    veil: NDArray[np.float64]
    road: NDArray[np.float64]
