"""Whether the road before the vehicle ahead is lit by the sky, as methods of its contrast need, or by lamps."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera
from fogsim.vision.road_image import CannotTellError

BRIGHT_ROAD = 1.1
"""Luminance of the road before the vehicle over that of the sky, from which on there is no daylight, or no road [-]."""

GAP = 0.3
"""How far above the vehicle's foot, as heights, the road that is looked at ends before it: its shadow [m]."""

HALF_STRIP = 0.6
"""Half the width of that strip of road as a thing of this size has at the vehicle [m]."""


def road_before(camera: Camera, depth: float) -> tuple[slice, slice]:
    """Every fourth row, and the columns, of the road between the camera and a vehicle ahead in a level image.

    Parameters
    ----------
    camera : Camera
        The told calibration.
    depth : float
        From the camera to the vehicle's rear [m].
    """
    scale = camera.focal_length / depth
    first = min(math.ceil(camera.horizon_row + camera.row_distance / depth + GAP * scale), camera.height - 3)
    middle, half = camera.principal_point[0], max(HALF_STRIP * scale, 4.0)
    cols = slice(max(math.floor(middle - half), 0), max(min(math.ceil(middle + half) + 1, camera.width), 0))
    return slice(max(first, 0), camera.height, 4), cols


def check_road(road: NDArray[np.float32], sky: float) -> None:
    """Refuse a road that is brighter than the sky: head lamps light it, or the image is upside-down.

    What they light is the vehicle, too, and the fog before it, which then has no airlight of the sky's: contrast to the
    sky no longer falls as Duntley's law has it.

    Parameters
    ----------
    road : (rows, cols) float32
        Luminance of the road before the vehicle, as `road_before` has it; nothing is refused where it is empty.
    sky : float
        Luminance of the sky in the same unit.

    Raises
    ------
    CannotTellError
        If it is.
    """
    if road.size and float(np.median(road)) > BRIGHT_ROAD * sky:
        raise CannotTellError("the road is brighter than the sky: this is a daytime method")
