"""Lamps of a scene: how they shine in all directions."""

from fogsim.scene.lamps.road_beams import (
    FULL,
    SIGNAL_LOBES,
    STREET_ANGLES,
    STREET_INTENSITIES,
    STREET_LOBE,
    signal_shares,
    sum_of_beams,
)

__all__ = [
    "FULL",
    "SIGNAL_LOBES",
    "STREET_ANGLES",
    "STREET_INTENSITIES",
    "STREET_LOBE",
    "signal_shares",
    "sum_of_beams",
]
