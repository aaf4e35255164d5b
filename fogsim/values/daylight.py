"""Daylight of surfaces."""

from typing import NamedTuple


class SideLight(NamedTuple):
    """Daylight of surfaces that are not level.

    Attributes
    ----------
    vertical, below : float
        Illuminance of a vertical surface, on the mean of all sides, and of one that faces down, over that of a level
        one [-].
    """

    vertical: float
    below: float


EVEN_LIGHT = SideLight(0.56, 0.12)
"""That under a sky which is about as bright everywhere, above dark ground."""
