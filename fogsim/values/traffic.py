"""Where every vehicle is at one instant."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class TrafficState:
    """All vehicles at one instant, as arrays; row i belongs to ``ids[i]``.

    Attributes
    ----------
    time : float
        Instant [s].
    ids : tuple of str
        Vehicle ids.
    types : tuple of str
        Body kinds: "car", "van", "truck", "bus", "motorcycle".
    position : (n, 3) float64
        Middle of the front bumper on the road surface [m]: east, north, up.
    heading : (n,) float64
        Direction of travel, counterclockwise from east [rad].
    speed : (n,) float64
        Speed [m/s].
    acceleration : (n,) float64
        Acceleration along the heading [m/s²].
    length, width, height : (n,) float64
        Size of the body [m].
    lane : tuple of str
        Lane ids.
    lamps : (n,) int32
        Lit lamps, bits of `Lamp`.
    paint : (n, 3) float64
        Linear reflectance of the paint, 0 … 1.
    """

    time: float
    ids: tuple[str, ...]
    types: tuple[str, ...]
    position: NDArray[np.float64]
    heading: NDArray[np.float64]
    speed: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    length: NDArray[np.float64]
    width: NDArray[np.float64]
    height: NDArray[np.float64]
    lane: tuple[str, ...]
    lamps: NDArray[np.int32]
    paint: NDArray[np.float64]

    def row(self, vehicle_id: str) -> int | None:
        """Row of a vehicle, or None if it is not on the road now."""
        try:
            return self.ids.index(vehicle_id)
        except ValueError:
            return None
