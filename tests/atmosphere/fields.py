"""Fog fields of every kind, and the slow way to see through them."""

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere import extinction
from fogsim.values import Camera, CameraPose, FogBank, FogField, FogPatches

AIRLIGHT = (2900.0, 3000.0, 3100.0)
BANK = FogBank((60.0, 10.0), (0.96, 0.28), 0.0, 300.0, 60.0, 0.055)
PATCHES = FogPatches(correlation_length=40.0, correlation_height=8.0, strength=0.8, seed=3)

UNEVEN = {
    "ground fog": FogField(0.05, AIRLIGHT, top=250.0, scale_height=4.0),
    "shallow layer": FogField(0.04, AIRLIGHT, top=4.0, top_edge=3.0),
    "lifted": FogField(0.03, AIRLIGHT, top=80.0, top_edge=20.0, base=4.0, base_edge=4.0),
    "patches": FogField(0.02, AIRLIGHT, top=250.0, patches=PATCHES),
    "thin patches": FogField(0.006, AIRLIGHT, top=250.0, patches=PATCHES),
    "bank of ground fog": FogField(0.002, AIRLIGHT, (BANK,), top=250.0, scale_height=8.0),
    "all at once": FogField(0.004, AIRLIGHT, (BANK,), 60.0, 20.0, scale_height=12.0, patches=PATCHES),
}
"""Fields whose optical depth is no product of a function of the place and one of the height, by name."""

CAMERA = Camera(640, 480, 577.0, (320, 240), 1.38, 0.035)
POSE = CameraPose((10.0, 20.0, 1.38), 0.3)


def brute_force(
    field: FogField, start: NDArray[np.float64], ends: NDArray[np.float64], steps: int = 400
) -> NDArray[np.float64]:
    """Optical depth from a point to others by the midpoint rule, which knows nothing but k at places."""
    share = (np.arange(steps) + 0.5) / steps
    places = start + share[:, None] * (ends - start)[..., None, :]
    return np.asarray(extinction(field, places).mean(axis=-1) * np.linalg.norm(ends - start, axis=-1))
