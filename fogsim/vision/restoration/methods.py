"""The methods of contrast restoration, in one registry."""

from collections.abc import Callable
from dataclasses import dataclass

from fogsim.core.registry import Registry
from fogsim.values.camera import Camera
from fogsim.vision.restoration.airlight import dark_channel_airlight, horizon_airlight
from fogsim.vision.restoration.dark_channel import dark_channel
from fogsim.vision.restoration.picture import Floats, FoggyPicture, Light, Pixels
from fogsim.vision.restoration.planar import planar
from fogsim.vision.restoration.tarel2009 import tarel2009


@dataclass(frozen=True, slots=True)
class Method:
    """A method of contrast restoration."""

    # Gives the transmission (rows, cols) of a picture, which is then undone
    transmission: Callable[[FoggyPicture], Floats]
    # Finds the airlight of pixels of a camera and its largest pixel value, where none is given
    airlight: Callable[[Pixels, Camera, int], Light]
    # Whether it reckons with an extinction coefficient; the others find the veil in the picture
    needs_extinction: bool = False
    smooths: bool = False  # Whether noise is smoothed before it is amplified


METHODS: Registry[Method] = Registry(
    "restoration method",
    {
        "planar": Method(planar, horizon_airlight, needs_extinction=True, smooths=True),
        "dark_channel": Method(dark_channel, dark_channel_airlight),
        "tarel2009": Method(tarel2009, horizon_airlight),
    },
)
