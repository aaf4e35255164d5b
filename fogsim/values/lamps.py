"""Lamps of a vehicle."""

from enum import IntFlag


class Lamp(IntFlag):
    """Lamps of a vehicle that can be lit, one bit each, so that an integer array holds those of many vehicles."""

    NONE = 0
    POSITION = 1
    LOW_BEAM = 2
    HIGH_BEAM = 4
    FRONT_FOG = 8
    REAR_FOG = 16
    STOP = 32
    INDICATOR_LEFT = 64
    INDICATOR_RIGHT = 128
    DAYTIME = 256
