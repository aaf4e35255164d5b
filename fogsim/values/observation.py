"""What a vehicle knows: the only thing that estimators and agents are given."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.values.image import Frame


@dataclass(frozen=True, slots=True)
class LeadMeasurement:
    """A radar-like measurement of the vehicle ahead.

    Attributes
    ----------
    distance : float
        Gap from the own front bumper to the lead's rear bumper, with sensor noise [m].
    relative_speed : float
        Lead's speed minus own speed, with sensor noise [m/s].
    """

    distance: float
    relative_speed: float


@dataclass(frozen=True, slots=True)
class SignSighting:
    """A traffic sign that the map says lies ahead.

    Attributes
    ----------
    sign_id : str
        Its id in the sign map.
    kind : str
        Sign code ("speed_limit", …).
    value : float
        What it says, for a speed limit the speed [m/s].
    distance : float
        Distance ahead along the vehicle's heading [m].
    lateral : float
        Offset to the left of the vehicle's axis [m].
    diameter : float
        Size of its face [m].
    height : float
        Middle of its face above the plane of the road at the front bumper [m].
    facing : float
        How far its face is turned from square to the vehicle's axis, counterclockwise seen from above [rad].
    """

    sign_id: str
    kind: str
    value: float
    distance: float
    lateral: float
    diameter: float
    height: float = 2.2
    facing: float = 0.0


@dataclass(frozen=True, slots=True)
class Observation:
    """What one vehicle has at one instant.

    Attributes
    ----------
    frame : Frame or (rows, cols[, 3]) uint8, or uint16 of a camera of 10 or 12 bits
        The camera's image; a bare array serves where the time does not matter.
    speed : float
        Own speed by the odometer [m/s].
    lead : LeadMeasurement or None
        The tracked vehicle ahead, if the sensor has one.
    signs : tuple of SignSighting
        Signs ahead by the map, nearest first.
    """

    frame: Frame | NDArray[np.uint8] | NDArray[np.uint16]
    speed: float = 0.0
    lead: LeadMeasurement | None = None
    signs: tuple[SignSighting, ...] = ()

    @property
    def image(self) -> NDArray[np.uint8] | NDArray[np.uint16]:
        """(rows, cols[, 3]) uint8, or uint16 of a camera of 10 or 12 bits: the pixels."""
        return self.frame.image if isinstance(self.frame, Frame) else self.frame

    @property
    def time(self) -> float:
        """Instant of the exposure [s]; 0 for a bare array."""
        return self.frame.time if isinstance(self.frame, Frame) else 0.0
