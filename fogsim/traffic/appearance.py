"""Body kinds, paints and lamps of SUMO's vehicles."""

import functools
import math
import zlib
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.values import Lamp, SignalColour

BODY_KINDS = {
    "delivery": "van",
    "truck": "truck",
    "trailer": "truck",
    "bus": "bus",
    "coach": "bus",
    "motorcycle": "motorcycle",
    "moped": "motorcycle",
    "scooter": "motorcycle",
    "bicycle": "motorcycle",
    "pedestrian": "motorcycle",
    "wheelchair": "motorcycle",
    "emergency": "van",
    "tram": "bus",
    "rail_urban": "bus",
    "rail": "bus",
    "rail_electric": "bus",
    "rail_fast": "bus",
    "subway": "bus",
}
"""Body kind of a SUMO vehicle class, or what comes nearest to it; every other class is a car."""

BODY_PARAMETER = "fogsim.body"
"""Parameter of a SUMO vehicle with its body kind, in place of what follows from its class and shape."""

TRAINS = frozenset({"rail_urban", "rail", "rail_electric", "rail_fast", "subway", "cable_car"})
"""SUMO's vehicle classes whose drivers go by signals and not by what they see of the way; trams are not among them."""

RAILWAYS = TRAINS | {"tram"}
"""SUMO's classes of vehicles on rails."""

SHAPE_KINDS = {
    "passenger/van": "van",
    "delivery": "van",
    "emergency": "van",
    "firebrigade": "truck",
    "truck": "truck",
    "bus": "bus",
    "motorcycle": "motorcycle",
    "moped": "motorcycle",
    "bicycle": "motorcycle",
    "scooter": "motorcycle",
}
"""Body kind of a SUMO ``guiShape``, or of what stands before its stroke, where the class is that of a car."""

_CAR_SECTION, LARGE_SECTION = (1.8, 1.5), (2.5, 3.4)
"""Width and height of SUMO's cars, and of trucks and buses whose type leaves them at that [m]."""

_LONGEST_CAR = 7.5
"""Vehicles of a car's class that are longer than this are trucks [m]."""

SUMO_DEFAULT_COLOUR = (255, 255, 0)

PAINTS = (
    (0.62, 0.63, 0.64),
    (0.35, 0.36, 0.38),
    (0.03, 0.03, 0.035),
    (0.10, 0.105, 0.115),
    (0.80, 0.80, 0.79),
    (0.05, 0.09, 0.25),
    (0.30, 0.03, 0.03),
    (0.12, 0.16, 0.10),
    (0.30, 0.26, 0.20),
)
"""Linear reflectances of common car paints: silver, grey, black, anthracite, white, blue, red, green, beige."""

_SIGNALS = (
    (1 << 0, int(Lamp.INDICATOR_RIGHT)),
    (1 << 1, int(Lamp.INDICATOR_LEFT)),
    (1 << 2, int(Lamp.INDICATOR_LEFT | Lamp.INDICATOR_RIGHT)),
    (1 << 3, int(Lamp.STOP)),
    (1 << 4, int(Lamp.LOW_BEAM | Lamp.POSITION)),
    (1 << 5, int(Lamp.REAR_FOG)),
    (1 << 6, int(Lamp.HIGH_BEAM)),
)

OTHERS_LAMPS = Lamp.POSITION | Lamp.LOW_BEAM
"""Lamps that other drivers light in fog, as the law of most countries asks by day."""


def body_kind(vehicle_class: str, shape: str = "", length: float = 0.0) -> str:
    """Body kind of a SUMO vehicle (`length` [m])."""
    known = BODY_KINDS.get(vehicle_class) or SHAPE_KINDS.get(shape) or SHAPE_KINDS.get(shape.split("/", maxsplit=1)[0])
    return known or ("truck" if length > _LONGEST_CAR else "car")


def cross_section(kind: str, width: float, height: float) -> tuple[float, float]:
    """Width and height [m] of a vehicle, those of a truck where its type says no more than that it is long."""
    large = kind in {"truck", "bus"} and math.isclose(width, _CAR_SECTION[0]) and math.isclose(height, _CAR_SECTION[1])
    return LARGE_SECTION if large else (width, height)


def paint(vehicle_id: str, colour: tuple[int, ...]) -> tuple[float, float, float]:
    """Linear reflectance of a vehicle's paint, 0 … 1."""
    if tuple(colour[:3]) == SUMO_DEFAULT_COLOUR:
        return PAINTS[zlib.crc32(vehicle_id.encode()) % len(PAINTS)]
    red, green, blue = ((c / 255.0) ** 2.2 for c in colour[:3])
    return (red, green, blue)


@functools.lru_cache(maxsize=1024)
def lamps_from_signals(signals: int) -> int:
    """Lamps, as bits of `Lamp`, that SUMO's vehicle signals stand for."""
    lamps = 0
    for bit, lamp in _SIGNALS:
        if signals & bit:
            lamps |= lamp
    return lamps


_LAMPS_OF_SIGNALS = np.array([lamps_from_signals(signals) for signals in range(_SIGNALS[-1][0] << 1)], dtype=np.int32)


def lamps_from_many_signals(signals: Sequence[int]) -> NDArray[np.int32]:
    """Lamps as bits of `Lamp` (n,), as `lamps_from_signals` gives them for each."""
    known = len(_LAMPS_OF_SIGNALS) - 1
    return np.asarray(_LAMPS_OF_SIGNALS[np.asarray(signals, dtype=np.intp) & known])


SIGNAL_COLOURS: Mapping[str, SignalColour] = {
    "r": SignalColour.RED,
    "u": SignalColour.RED_YELLOW,
    "y": SignalColour.YELLOW,
    "Y": SignalColour.YELLOW,
    "g": SignalColour.GREEN,
    "G": SignalColour.GREEN,
    "s": SignalColour.GREEN_ARROW,
    "o": SignalColour.BLINKING,
    "O": SignalColour.OFF,
}
"""What SUMO's letters for traffic lights mean."""


EYE_HEIGHTS = {"car": 1.08, "van": 1.5, "truck": 2.33, "bus": 1.8, "motorcycle": 1.35}
"""Height of the eyes above the road, by body kind [m]."""

_OF_CLASSES = {
    "bicycle": 1.4,
    "pedestrian": 1.5,
    "wheelchair": 1.2,
    "tram": 2.0,
    "rail_urban": 2.0,
    "subway": 2.0,
    "rail": 2.7,
    "rail_electric": 2.7,
    "rail_fast": 2.7,
}
"""The same of SUMO's vehicle classes that share a body with others, but not the height [m]."""


def eye_height(vehicle_class: str, shape: str = "", length: float = 0.0) -> float:
    """Height of a driver's eyes above the road [m]."""
    known = _OF_CLASSES.get(vehicle_class)
    return EYE_HEIGHTS[body_kind(vehicle_class, shape, length)] if known is None else known
