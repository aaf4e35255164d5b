"""Reference images of the own head lamps in fog of any density, as a method gets them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera


@dataclass(frozen=True, slots=True, eq=False)
class VeilReferences:
    """What a camera sees of a dark, flat road by own lamps, by cells."""

    camera: Camera  # The camera; cells are those of `camera_of_cells`
    visibility: NDArray[np.float64]  # (n,): Meteorological visibilities, rising [m]; inf for a clear night
    # (n, rows, cols): Luminance of the fog that the lamps light, before the road or the sky [cd/m²]
    veil: NDArray[np.float64]
    # (n, rows, cols): Luminance of the road that they light, of asphalt, through the fog [cd/m²]; 0 above the horizon
    road: NDArray[np.float64]
