"""What a picture is to the methods: linear light relative to the airlight; and what they give back."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.values.camera import Camera, Response
from fogsim.values.camera_response import exposure_of, respond

Pixels = NDArray[np.uint8] | NDArray[np.uint16]
Floats = NDArray[np.float32]
Light = NDArray[np.float64]
ToneCurve = Callable[[Light], Light]
"""From light to light that is shown, both relative to full scale."""

_STEPS = 2**14
"""Steps of linear light in which 8 bits are written again; the darkest are a fifth of a pixel value."""


@dataclass(frozen=True, slots=True)
class Restoration:
    """A picture with its contrast restored.

    Attributes
    ----------
    image : (rows, cols) or (rows, cols, 3) uint8 or uint16
        Pixel values, of the kind that the picture had.
    transmission : (rows, cols) float32
        Share of the scene's light that is taken to have come through the fog, 0 … 1 [-].
    airlight : (channels,) float64
        Pixel values of the airlight that was used.
    method : str
        The method's name.
    """

    image: Pixels
    transmission: Floats
    airlight: NDArray[np.float64]
    method: str


@dataclass(frozen=True, slots=True)
class FoggyPicture:
    """A picture as the methods read it."""

    pixels: Pixels  # (rows, cols, channels) uint8: Pixel values, contiguous
    camera: Camera  # The assumed calibration
    full: float  # Largest pixel value
    airlight: Light  # (channels,): Light of the airlight, relative to full scale
    extinction: float | None  # Extinction coefficient k [1/m], for methods that reckon with it
    most_gain: float  # Most by which light, and so noise, may be amplified [-]

    def relative_tables(self) -> Floats:
        """Light of each pixel value relative to the airlight, (channels, levels)."""
        table = light_table(self.camera.response, int(self.full), self.camera.black_level)
        return (table[None, :] / self.airlight[:, None]).astype(np.float32)


@lru_cache(maxsize=8)
def light_table(response: Response, full: int, black_level: float) -> Light:
    """Light behind each pixel value, relative to full scale.

    Returns read-only (full + 1,).
    """
    table = exposure_of(np.arange(full + 1) / full, response, black_level)
    table.flags.writeable = False
    return table


@lru_cache(maxsize=8)
def _pixel_table(response: Response, full: int, black_level: float) -> Pixels:
    """Pixel value of each step of light from none to full scale."""
    return _values_of(np.linspace(0.0, 1.0, _steps(full)), response, full, black_level)


def _steps(full: int) -> int:
    return _STEPS if full < 256 else 2**16


def _values_of(light: Light, response: Response, full: int, black_level: float) -> Pixels:
    values = np.rint(full * np.clip(respond(light, response, black_level), 0.0, 1.0))
    return values.astype(np.uint8) if full < 256 else values.astype(np.uint16)


def written_values(picture: FoggyPicture, curve: ToneCurve | None = None) -> Pixels:
    """Pixel value of each step of light from none to full scale, as the picture's camera would have written it."""
    full, camera = int(picture.full), picture.camera
    if curve is None:
        return _pixel_table(camera.response, full, camera.black_level)
    shown = curve(np.linspace(0.0, 1.0, _steps(full)))
    return _values_of(shown, camera.response, full, camera.black_level)


def largest_value(image: Pixels, camera: Camera) -> float:
    """Largest pixel value that an image can have."""
    if image.dtype == np.uint8:
        if camera.bits > 8:
            raise InputError(f"the image has 8 bits, the camera {camera.bits}; they must be the same")
        return 255.0
    full, most = 2 ** (camera.bits if camera.bits > 8 else 16) - 1, int(image.max(initial=0))
    if most > full:
        raise InputError(f"pixel values of a camera of {camera.bits} bits are 0 … {full}, got {most}")
    if camera.bits == 8:
        refuse_short_range(most)
    return float(full)


def refuse_short_range(most: int) -> None:
    """Refuse an image of 16 bits whose largest value shows that its camera has 10 or 12."""
    if 2**8 <= most < 2**12:
        raise InputError(
            f"the image has 16 bits and no value above {most}: write `bits: {10 if most < 2**10 else 12}` in the "
            "camera file if it is the camera's, or spread the values over 0 … 65535"
        )
