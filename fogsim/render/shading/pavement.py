"""How asphalt reflects by the angle at which it is seen, and how it changes along the road."""

import functools
from importlib.resources import files
from typing import NamedTuple

import numpy as np

from fogsim.core.jit import kernel
from fogsim.render.shading.layout import Wide
from fogsim.values.scene import Pavement, RoadSurface

PERIOD = 2048
"""Length after which stretches of older and newer asphalt come again [m]."""

_SHORTEST, _LONGEST = 5.0, 150.0  # of those stretches, even in the logarithm [m]


class Asphalt(NamedTuple):
    """A `Pavement` as numbers."""

    # (n,): Reflectance over that of dry asphalt seen from above, at even steps from 0 to 1 of the root of the sine of
    # the eye's elevation
    by_sine: Wide
    # tracks, repairs: see `Pavement`
    tracks: float
    repairs: float
    # Integral of the stretches' brightness, of mean 0 and deviation 1, over each whole metre along the road [m]
    stretches: Wide


def asphalt(pavement: Pavement) -> Asphalt:
    """Numbers of a pavement."""
    by_sine = reflectance_by_sine(pavement.surface)
    return Asphalt(by_sine, float(pavement.wheel_tracks), float(pavement.repairs), _stretches())


@functools.cache
def reflectance_by_sine(surface: RoadSurface) -> Wide:
    """Reflectance of a surface by the root of the sine of the eye's elevation (`tools/make_road_reflectance.py`).

    Returns over that of dry asphalt seen from above; at even steps from 0 to 1 (n,).
    """
    path = files("fogsim.render") / "data" / "road_reflectance.csv"
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    names, rows = lines[0].split(","), [[float(cell) for cell in line.split(",")] for line in lines[1:]]
    # A column of its own: for one among others the shading would be compiled again.
    column = np.ones(len(rows)) if surface is RoadSurface.LAMBERTIAN else np.array(rows)[:, names.index(surface)].copy()
    column.flags.writeable = False
    return column


@functools.cache
def _stretches() -> Wide:
    rng = np.random.default_rng(20261)
    value, metres = np.zeros(PERIOD), 0
    while metres < PERIOD:
        length = round(float(np.exp(rng.uniform(np.log(_SHORTEST), np.log(_LONGEST)))))
        value[metres : metres + length] = rng.normal()
        metres += length
    value = (value - value.mean()) / value.std()
    integral = np.concatenate(([0.0], np.cumsum(value)))
    integral.flags.writeable = False
    return integral


@kernel
def reflectance_at(by_sine: Wide, sine: float) -> float:
    """Reflectance to an eye at an elevation, over that of dry asphalt seen from above (`by_sine` (n,))."""
    place = np.sqrt(min(1.0, max(0.0, sine))) * (len(by_sine) - 1)
    low = min(int(place), len(by_sine) - 2)
    return float(by_sine[low] + (place - low) * (by_sine[low + 1] - by_sine[low]))


@kernel
def mean_of_stretches(integral: Wide, along: float, extent: float) -> float:
    """Mean brightness of the stretches over an extent along the road (`along` [m], `extent` [m])."""
    extent = min(max(extent, 0.1), float(PERIOD))
    start = (along - 0.5 * extent) % PERIOD
    # The integral over a whole period is 0, so that it goes on behind the table's end as it begins.
    return (_integral_at(integral, (start + extent) % PERIOD) - _integral_at(integral, start)) / extent


@kernel
def _integral_at(integral: Wide, along: float) -> float:
    low = min(int(max(0.0, along)), PERIOD - 1)
    return float(integral[low] + (along - low) * (integral[low + 1] - integral[low]))
