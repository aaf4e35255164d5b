"""What a camera could see, and what it did."""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from fogsim.core.parameters import checked_parameters
from fogsim.values.camera import Camera

T = TypeVar("T")
Image = NDArray[np.uint8] | NDArray[np.uint16]


@dataclass(frozen=True, slots=True)
class View:
    """A drawn scene before the air and the camera have touched it.

    Attributes
    ----------
    radiance : (rows, cols, 3) float32
        Luminance of each linear channel [cd/m²]: their sum by `LUMINANCE_WEIGHTS` is the luminance.
    distance : (rows, cols) float32
        Distance along the ray from the optical centre [m]; ``inf`` for the sky.
    instance : (rows, cols) int32
        What is seen: 0 sky, 1 terrain, 2 road, 3 roadside, 4 sign, 16 + i the vehicle in row i of the traffic state.
    lamp_response : (rows, cols, 3) float32 or None
        Luminance toward the camera per illuminance that the camera's own vehicle casts, measured across the ray
        [cd/m² per lx]: of diffuse surfaces ρ/π cos θ, of road, markings and sheeting their coefficient of
        retroreflected luminance; zero for the sky. None where it was not asked for.
    """

    radiance: NDArray[np.float32]
    distance: NDArray[np.float32]
    instance: NDArray[np.int32]
    lamp_response: NDArray[np.float32] | None = None


@checked_parameters
@dataclass(frozen=True, slots=True)
class Frame:
    """An image and the calibration that its vehicle assumes.

    Attributes
    ----------
    time : float
        Instant of the exposure [s].
    image : (rows, cols, 3) or (rows, cols) uint8, or uint16 of a camera of 10 or 12 bits
        Pixel values 0 … 2^bits − 1, red first; read-only.
    camera : Camera
        The calibration that the vehicle assumes, which may differ from the true one.
    """

    time: float
    image: NDArray[np.uint8] | NDArray[np.uint16]
    camera: Camera

    def __post_init__(self) -> None:
        """Keep a read-only view, so that no method changes what later ones read and recorders write."""
        object.__setattr__(self, "image", read_only(self.image))


def read_only(array: T) -> T:
    """View of an array that cannot be written through; anything else as it is."""
    if not isinstance(array, np.ndarray) or not array.flags.writeable:
        return array
    view = array.view()
    view.flags.writeable = False
    return view


def for_kernels(image: Image) -> Image:
    """An image for numba's kernels, which must not write into it: a read-only array is of another type to numba.

    Every kernel would be compiled a second time, and each call would take 20 µs to find the type.
    """
    view: Image = image.view()
    try:
        view.flags.writeable = True
    except ValueError:  # its owner is read-only too, as bytes are
        return image.copy()
    return view
