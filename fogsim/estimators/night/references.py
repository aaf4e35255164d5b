"""What own head lamps show in fog of any density, as a method is told it."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.values.camera import Camera
from fogsim.values.light import Lamp


@dataclass(frozen=True, slots=True, eq=False)
class VeilReferences:
    """What a camera sees of a dark, flat road by own lamps, by cells.

    Attributes
    ----------
    camera : Camera
        The camera; cells are those of `camera_of_cells`.
    lamps : Lamp
        Own lamps that are lit.
    droplets : str
        Name of the fog's droplets.
    setback : float
        Distance of the camera behind the front bumper [m].
    visibility : (n,) float64
        Meteorological visibilities, rising [m]; inf for a clear night.
    veil : (n, rows, cols) float64
        Luminance of the fog that the lamps light, before the road or the sky [cd/m²].
    road : (n, rows, cols) float64
        Luminance of the road that they light, of asphalt, through the fog [cd/m²]; 0 above the horizon.
    slopes : tuple of (n, rows, cols) float64
        How veil and road grow where the picture is shifted downward by a cell [cd/m²].
    """

    camera: Camera
    lamps: Lamp
    droplets: str
    setback: float
    visibility: NDArray[np.float64]
    veil: NDArray[np.float64]
    road: NDArray[np.float64]
    slopes: tuple[NDArray[np.float64], NDArray[np.float64]] = field(init=False)

    def __post_init__(self) -> None:
        """Compute how veil and road grow where the picture is shifted downward by a cell."""
        if self.veil.shape[1:2] < (2,):
            raise InputError(
                f"expected a camera whose image has two rows of cells or more, got {self.camera.width} × "
                f"{self.camera.height} px"
            )
        slopes = tuple(-np.gradient(part, axis=1) for part in (self.veil, self.road))
        object.__setattr__(self, "slopes", slopes)


ReferenceSource = Callable[[Camera, Lamp, float], tuple[VeilReferences, ...]]
"""Gives references for a camera, the lamps that are lit and the camera's distance behind the front bumper [m], of the
same visibilities for each kind of droplets."""
