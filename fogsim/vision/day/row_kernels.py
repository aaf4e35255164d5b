"""Evidence of fog in rows of sky and road: a Kalman filter over each, and columns whose factors are integrated out.

Light of row i is C_i β + h_i · x_i + noise: β has the airlight, the road's reflectance and other factors with normal
priors, x_i the state of the albedo along the road, of the sky above it and of noise that rows share. The filter whitens
the light and every column by one pass, so the evidence of each prior of β costs a small Cholesky factor.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

Floats = NDArray[np.float64]

AIRLIGHT, ROAD, SHEEN, VIGNETTING, _STRAY, SKY, SHIFT, DARKENING, WET, OTHER_SKY, _TONE, _NEAR_TONE, COLUMNS = range(13)
"""Columns: airlight, road, sheen at grazing angles, shade of the lens, stray light, a sky's brightness higher up, a
small shift of the horizon; how the airlight darkens downward, mirror image of the sky on a wet road, a sky that is not
the airlight's, two shapes of local tone mapping; and their number. The light itself is in one column more."""

COMMON = DARKENING
"""How many of the columns, the first, have the same deviations under all lights."""

_DARKENING_ANGLE, _SHEEN_ANGLE, _SKY_ANGLE = 0.064, 0.06, 0.3
"""Angles over which airlight darkens downward, sheen fades and a sky's brightness changes [rad]."""

_TONE_ANGLE, _NEAR_TONE_ANGLE = 0.12, 0.04
"""Angles over which local tone mapping changes [rad]."""

_NODES, _WEIGHTS = np.array([-0.7745966692414834, 0.0, 0.7745966692414834]), np.array([5.0, 8.0, 5.0]) / 18.0
"""Gauss and Legendre's three places within a row, and their weights."""

_MOST_CONTRAST, _MOST_DOUBT = 1.2, 3.0
"""Greatest contrast across a road in clear air, relative to the airlight, and most that one row speaks against fog that
leaves less [-]."""

_REFRACTION = 1.33**2
"""Squared refractive index of water [-]."""

FARTHEST = 5000.0
"""Depth that counts as the road's farthest [m]."""


class RowData(NamedTuple):
    """What was read of an image, under each response (r, n)."""

    # first, last (n,): rows of each bin
    first: Floats
    last: Floats
    # light, slope, noise, by_row (r, n): light of each bin, its derivative by the signal, its noise (0 where clipped),
    # and its change by row
    light: Floats
    slope: Floats
    noise: Floats
    by_row: Floats
    # level, least_airlight (r,): brightest light, and light that the airlight surely exceeds
    level: Floats
    least_airlight: Floats
    contrast: Floats  # (2, n): Contrast across a strip of road, relative to the airlight, and the noise of that
    # (c,) int64: Bins before which the road ends, the first being the first bin below the horizon, the last n
    cuts: NDArray[np.int64]
    free: Floats  # (c,): Evidence of the signals of the bins from each cut on by a law of no road
    none: float  # The same of all bins, the sky's too


@kernel
def fresnel(sine: float) -> float:
    """Share of light that water mirrors under an angle above it."""
    root = math.sqrt(_REFRACTION - 1.0 + sine * sine)
    across, along = (sine - root) / (sine + root), (_REFRACTION * sine - root) / (_REFRACTION * sine + root)
    return 0.5 * (across * across + along * along)


@kernel
def fill_columns(
    first: Floats, last: Floats, horizon: float, lens: Floats, extinction: float, hidden: float,
    columns: Floats, place: Floats,
) -> None:  # fmt: skip
    """Columns of all bins but for the shift and the light, and where each lies.

    Takes `first`, `last` (n,), `lens` (3,) [px], [m], `extinction` [1/m], `hidden` [m], `place` (n, 5) [m], [px],
    [rad].
    """
    focal, height = lens[0], lens[1]
    for i in range(first.size):
        middle, size = 0.5 * (first[i] + last[i]), last[i] - first[i] + 1.0
        columns[i] = 0.0
        left = 0.0
        top, bottom = middle - 0.5 * size, middle + 0.5 * size
        sky = min(max((horizon - top) / size, 0.0), 1.0)
        if sky > 0.0:
            angle = max(0.5 * (horizon - top) if sky < 1.0 else horizon - middle, 0.0) / focal
            columns[i, AIRLIGHT] = columns[i, OTHER_SKY] = sky
            columns[i, SKY] = sky * angle / 0.1 * math.exp(-angle / _SKY_ANGLE)
        upper = max(top, horizon)
        for j in range(3 if sky < 1.0 else 0):
            row = 0.5 * (upper + bottom) + 0.5 * (bottom - upper) * _NODES[j]
            angle = max(row - horizon, 1e-4) / focal
            weight = _WEIGHTS[j] * (1.0 - sky)
            slant = math.sqrt(1.0 + angle * angle)
            depth = min(height / angle, hidden)
            through = math.exp(-extinction * depth * slant)
            left += weight * through
            columns[i, AIRLIGHT] += weight * (1.0 - through)
            columns[i, ROAD] += weight * through
            columns[i, DARKENING] -= weight * (1.0 - through) * (1.0 - math.exp(-angle / _DARKENING_ANGLE))
            columns[i, SHEEN] += weight * through * math.exp(-angle / _SHEEN_ANGLE)
            columns[i, WET] += weight * through * fresnel(angle / slant)
            columns[i, _STRAY] += weight
        angle = (middle - horizon) / focal
        off = (middle - lens[2]) / focal
        columns[i, VIGNETTING] = off * off
        columns[i, _TONE] = math.exp(-((angle / _TONE_ANGLE) ** 2))
        columns[i, _NEAR_TONE] = math.exp(-((angle / _NEAR_TONE_ANGLE) ** 2))
        below = max(angle, 0.25 / focal)
        place[i, 0] = left
        place[i, 1] = min(height / below, FARTHEST)
        upper, lower = max(below - 0.5 * size / focal, 0.1 / focal), below + 0.5 * size / focal
        place[i, 2] = min(height / upper, FARTHEST) - min(height / lower, FARTHEST)
        place[i, 3] = middle - horizon
        place[i, 4] = max(-angle, 0.0)


@kernel
def contrast_across(contrast: Floats, place: Floats, size: int) -> float:
    """Logarithm of the chance of contrasts across the road; fog leaves less of them, the farther away they are.

    Takes `contrast` (2, n).
    """
    total = 0.0
    for i in range(size, place.shape[0]):
        noise = contrast[1, i]
        apart = (contrast[0, i] - _MOST_CONTRAST * place[i, 0]) / noise - 3.0
        if apart > 0.0:
            total -= min(0.5 * apart * apart, _MOST_DOUBT)
    return total


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
            (darkening, False, 1, False, likely * 0.76),
            (darkening, True, 1, False, likely * 0.04),
            (darkening, False, 0, False, likely * 0.15),
            (darkening, False, 1, True, likely * 0.05),
        ]
    mean, deviation = np.zeros((len(rows), COLUMNS)), np.zeros((len(rows), COLUMNS))
    mean[:, AIRLIGHT], deviation[:, AIRLIGHT] = _USUAL_AIRLIGHT, _AIRLIGHT_DEVIATION
    mean[:, ROAD], deviation[:, ROAD] = _USUAL_ROAD, _ROAD_DEVIATION
    deviation[:, SHEEN], deviation[:, WET] = 0.06 * _USUAL_ROAD, 0.05
    deviation[:, VIGNETTING], deviation[:, _STRAY], deviation[:, SKY] = 0.3, 0.02, 0.1
    for i, (darkening, wet, sky, tone, _) in enumerate(rows):
        if darkening:
            mean[i, DARKENING], deviation[i, DARKENING] = 0.32, 0.16
        if not sky:
            deviation[i, OTHER_SKY] = _AIRLIGHT_DEVIATION
        if wet:
            mean[i, WET], deviation[i, WET] = 0.5, 0.5
        if tone:
            deviation[i, _TONE], deviation[i, _NEAR_TONE] = 0.12, 0.06
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
