"""Lamps of a scene: how they shine in all directions."""

from fogsim.scene.lamps.lobes import (
    FULL,
    LOBE_AZIMUTHS,
    LOBE_ELEVATIONS,
    SIGNAL_LOBES,
    STREET_ANGLES,
    STREET_INTENSITIES,
    STREET_LOBE,
    SignalLobe,
    signal_shares,
    sum_of_beams,
)

__all__ = [
    "FULL",
    "LOBE_AZIMUTHS",
    "LOBE_ELEVATIONS",
    "SIGNAL_LOBES",
    "STREET_ANGLES",
    "STREET_INTENSITIES",
    "STREET_LOBE",
    "SignalLobe",
    "signal_shares",
    "sum_of_beams",
]
