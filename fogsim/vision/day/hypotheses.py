"""What may explain rows of road and sky by day, and how likely each is beforehand."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.vision.day.row_kernels import (
    AIRLIGHT,
    COLUMNS,
    DARKENING,
    NEAR_TONE,
    OTHER_SKY,
    ROAD,
    SHEEN,
    SKY,
    STRAY,
    TONE,
    VIGNETTING,
    WET,
)  # fmt: skip

Floats = NDArray[np.float64]


class Surfaces(NamedTuple):
    """Roads: deviations of patches, grain and what hides it, relative to the brightest light, and from which depth."""

    albedo: Floats  # (n, 3)
    hidden: Floats  # (n,): [m]; NaN where the road has its greatest step
    chance: Floats  # (n,)


_PATCHES, _GRAIN, _SHADOW, _OBSTACLE = 0.08, 0.02, 0.28, 0.6
"""Deviations of a road's light by patches, grain, shadows, and of things that hide it, over the road's own [-]."""

_USUAL_AIRLIGHT, _AIRLIGHT_DEVIATION = 0.9, 0.7
_USUAL_ROAD, _ROAD_DEVIATION = 0.35, 0.35
"""Airlight and road, over the light that 8 % of bins exceed, and their deviations [-]."""

SURFACES = Surfaces(
    albedo=_USUAL_ROAD * np.array([
        [_PATCHES, _GRAIN, 0.0], [0.3 * _PATCHES, 0.3 * _GRAIN, 0.0], [2.5 * _PATCHES, 2.5 * _GRAIN, 0.0],
        [_PATCHES, _SHADOW, 0.0], [_PATCHES, _GRAIN, _OBSTACLE], [_PATCHES, _GRAIN, _OBSTACLE],
    ]),
    hidden=np.array([np.inf, np.inf, np.inf, np.inf, np.nan, 200.0]),
    chance=np.array([0.35, 0.25, 0.15, 0.12, 0.065, 0.065]),
)  # fmt: skip


class Lights(NamedTuple):
    """Laws of the columns' factors, relative to the brightest light, and whether the sky counts."""

    mean: Floats
    deviation: Floats
    sky: NDArray[np.int64]  # (n,) int64: Whether the sky is as bright as the airlight
    # is_wet, is_unusual (n,) bool: whether the road is wet, and whether that or local tone mapping is there
    is_wet: NDArray[np.bool_]
    is_unusual: NDArray[np.bool_]
    chance: Floats  # (n,)


def _lights() -> Lights:
    """Even or darkening airlight, dry or wet, with or without a sky, and local tone mapping."""
    rows = []
    for darkening, likely in ((False, 0.45), (True, 0.55)):
        rows += [
            (darkening, False, 1, False, likely * 0.68),
            (darkening, True, 1, False, likely * 0.12),
            (darkening, False, 0, False, likely * 0.15),
            (darkening, False, 1, True, likely * 0.05),
        ]
    mean, deviation = np.zeros((len(rows), COLUMNS)), np.zeros((len(rows), COLUMNS))
    mean[:, AIRLIGHT], deviation[:, AIRLIGHT] = _USUAL_AIRLIGHT, _AIRLIGHT_DEVIATION
    mean[:, ROAD], deviation[:, ROAD] = _USUAL_ROAD, _ROAD_DEVIATION
    deviation[:, SHEEN], deviation[:, WET] = 0.06 * _USUAL_ROAD, 0.05
    deviation[:, VIGNETTING], deviation[:, STRAY], deviation[:, SKY] = 0.3, 0.02, 0.1
    for i, (darkening, wet, sky, tone, _) in enumerate(rows):
        if darkening:
            mean[i, DARKENING], deviation[i, DARKENING] = 0.32, 0.16
        if not sky:
            deviation[i, OTHER_SKY] = _AIRLIGHT_DEVIATION
        if wet:
            deviation[i, WET] = 0.5
        if tone:
            deviation[i, TONE], deviation[i, NEAR_TONE] = 0.12, 0.06
    return Lights(
        mean,
        deviation,
        sky=np.array([row[2] for row in rows]),
        is_wet=np.array([row[1] for row in rows]),
        is_unusual=np.array([row[1] or row[3] for row in rows]),
        chance=np.array([row[4] for row in rows]),
    )


LIGHTS = _lights()

CUT_CHANCE = 0.05
"""Chance of each row at which a bonnet or a dashboard may end the road [-]."""


def lights_chances(cuts: int) -> Floats:
    """Chances of the lights, where so many rows may end the road."""
    return np.asarray((1.0 - CUT_CHANCE * cuts) * LIGHTS.chance)
