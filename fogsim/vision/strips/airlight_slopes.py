"""Airlight that is not even, as photons have it: it brightens upward from the horizon, and darkens toward the road.

Over dark land a line of sight that points down gathers light that has come from below, and there it is dark. How
much, goes by the albedo of the land, which is unknown, in one factor; and by the elevation and the optical height of
the eye in a shape that is known. The sky's brightening upward in the same image informs about that factor.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.values.camera import Camera
from fogsim.vision.light.luminance import linear_table
from fogsim.vision.light.pixel_kernels import SATURATED_SHARE
from fogsim.vision.lines.horizon import Horizon
from fogsim.vision.strips.joint_kernels import JointPrior
from fogsim.vision.strips.joint_start_kernels import darkness_of_slope
from fogsim.vision.strips.sky import Sky

SKY_DEVIATION = 0.005
"""Relative deviation of the airlight at the horizon from the sky above it [-]."""

OVEREXPOSURE = 0.4
"""How far a sky without any unsaturated pixel may lie above saturation, as a deviation [-]."""

_HALF, _MOSTLY = 0.5, 0.98
"""Shares of saturated pixels beyond which a sky may be brighter, and beyond which it gives only a lower bound [-]."""

_EVEN_SKY, _CLOUD, MOST_CLOUD = 0.02, 1.5, 0.015
"""Unevenness of a sky that trees before it and rounding make, how much of more of it the airlight before the road has,
and the most of that [-]: clouds and dirt on the glass go on below the horizon."""


def joint_prior(sky: Sky, camera: Camera, horizon: Horizon) -> JointPrior:
    """Prior of airlight, horizon and lens for `fogsim.vision.strips.joint_fit.fit_jointly`."""
    airlight, below, above = _airlight(sky, camera)
    return JointPrior(
        airlight=airlight,
        below=below,
        above=above,
        shift=horizon.row - camera.horizon_row,
        shift_deviation=horizon.standard_deviation,
        vignetting=sky.vignetting,
        vignetting_deviation=sky.vignetting_deviation,
        cloud=min(_CLOUD * max(sky.unevenness - _EVEN_SKY, 0.0), MOST_CLOUD),
    )


def _airlight(sky: Sky, camera: Camera) -> tuple[float, float, float]:
    """Brightness of the airlight, and its deviations downward and upward [linear grey levels]."""
    deviation, upward = (math.hypot(SKY_DEVIATION * sky.luminance, apart) for apart in (sky.deviation, sky.upward))
    if not sky.is_clipped:
        return sky.luminance, deviation, upward
    table = linear_table(camera.response, camera.bits, camera.black_level)
    level = float(table[-1] - table[-2]) * (2**camera.bits / 256.0)
    if sky.saturated > _MOSTLY:
        return 255.0 + level, 2.0 * level, OVEREXPOSURE * 255.0
    if sky.saturated < SATURATED_SHARE:
        # One of the colours is clipped: there is more light than the others show.
        return sky.luminance + level, deviation + level, deviation + 4.0 * level
    # Noise carries some of the sky's pixels below saturation: the share of the others tells how bright it is.
    airlight = 255.0 - 0.5 * level + 1.3 * level * NormalDist().inv_cdf(sky.saturated)
    # Noise that is added after clipping tells nothing of what was clipped.
    above = OVEREXPOSURE * 255.0 if sky.saturated > _HALF else deviation + level
    return airlight, deviation + level, above


Floats = NDArray[np.float64]

_LEAST_SLOPE, _SURELY = 0.6, 2.0
"""Least slope of a sky over its level [1/rad], and least in its standard deviations, for the airlight to be taken for
uneven. Over snow it is less, and hardly matters; rows of houses that fog hides upward have up to 0.5."""

_OTHER_LIGHT = 0.2
"""Relative deviation of the sky's slope by what else differs: the sky above the fog, droplets, land that is not even
[-].
"""

_LEVEL_DEVIATION = 0.01
"""Relative deviation of the airlight's level by that [-]."""

_LENS_DEVIATION = 0.1
"""Deviation of a lens's vignetting where the sky below which it shows brightens otherwise than evenly [-]."""

_ANY_SLOPE = 2.0
"""Standard deviation of the slope of a sky, over its level, above airlight that is even [1/rad]: that of the CIE
overcast sky behind thin fog."""

DROPLET_CHANCES = (0.65, 0.25, 0.1)
"""How likely droplets of moderate and heavy radiation fog and of advection fog are beforehand [-]. An image hardly
separates them, so that these weights are the bias: with 0.2 for advection fog, radiation fog was read 11 % too short
over the darkest land, and by the right droplets alone 3 to 5 %."""

USUAL_EXTINCTION = 0.03
"""Extinction at which the shape of the airlight is taken where none is known yet [1/m]."""

_ROWS = 24
"""Places of the sky that a straight line is laid through."""


@dataclass(frozen=True, slots=True)
class SlopeTable:
    """Airlight over black land, by the optical height of the eye and the angle of the line of sight to the horizon."""

    depth: Floats  # (n,): Optical heights, evenly in their logarithms [-]
    angle: Floats  # (m,): Angles [rad]
    # below, above (droplets, n, m): by how much it is darker toward the road, and brighter toward the sky, than level,
    # over 1 − the level one in units of E / π [-]
    below: Floats
    above: Floats


@cache
def slope_table() -> SlopeTable:
    """The table that FogSim carries; `tools/make_airlight_slopes.py` makes it."""
    with (files("fogsim.vision") / "data" / "airlight_slopes.npz").open("rb") as file, np.load(file) as found:
        return SlopeTable(*(found[name].astype(np.float64) for name in ("depth", "angle", "below", "above")))


def darkening_priors(
    prior: JointPrior, sky: Sky, chances: tuple[float, ...] = DROPLET_CHANCES
) -> tuple[JointPrior, ...]:
    """What sky and horizon say about airlight that is not even, by droplets; nothing under a sky that is even."""
    if not _brightens(sky):
        return ()
    of_level = _LEVEL_DEVIATION * sky.luminance
    uneven = prior._replace(
        below=math.hypot(prior.below, of_level),
        above=math.hypot(prior.above, of_level),
        vignetting_deviation=math.hypot(prior.vignetting_deviation, _LENS_DEVIATION),
        slope=sky.slope,
        slope_deviation=math.hypot(sky.slope_deviation, _OTHER_LIGHT * sky.slope),
    )
    lines = [_lines(droplets, *sky.heights) for droplets in range(len(slope_table().below))]
    return tuple(
        uneven._replace(droplets=droplets, rise=rise, level=level, cost=prior.cost - 2.0 * math.log(chances[droplets]))
        for droplets, (rise, level) in enumerate(lines)
    )


def _brightens(sky: Sky) -> bool:
    """Whether the sky surely brightens upward."""
    return not sky.is_clipped and sky.slope >= max(_LEAST_SLOPE * sky.luminance, _SURELY * sky.slope_deviation)


@cache
def _lines(droplets: int, lowest: float, highest: float) -> tuple[Floats, Floats]:
    """Mean slope of the airlight between two heights [rad], and where a parabola has it at the horizon."""
    table = slope_table()
    height = np.linspace(lowest, highest, _ROWS)
    above = np.array([np.interp(height, table.angle, row) for row in table.above[droplets]])
    bend, slope, level = np.polynomial.polynomial.polyfit(height, above.T, 2)[::-1]
    return slope + bend * (lowest + highest), level


@kernel
def darkening_of_bins(
    grazing: Floats, below: Floats, prior: JointPrior, angle: Floats, table: Floats
) -> tuple[Floats, Floats]:
    """How the airlight darkens toward bins, for `fogsim.vision.strips.joint_kernels.Bins`.

    Returns ``darker`` and ``darker_by_row``. Takes `grazing` (n,) [rad], `below` (n,) [px], and ``angle`` and ``below``
    of a `SlopeTable`.
    """
    levels = 0 if prior.rise.size == 0 else table.shape[1]
    darker, by_row = np.empty((levels, below.size)), np.empty((levels, below.size))
    for i in range(below.size if levels else 0):
        at = 0
        while at < angle.size - 2 and angle[at + 1] <= grazing[i]:
            at += 1
        for level in range(levels):
            low, high = table[prior.droplets, level, at], table[prior.droplets, level, at + 1]
            slope = (high - low) / (angle[at + 1] - angle[at])
            darker[level, i] = low + slope * (grazing[i] - angle[at])
            # Where the horizon is lower by a row, a bin is seen at a smaller angle.
            by_row[level, i] = -slope * grazing[i] / below[i]
    return darker, by_row


@kernel
def slope_cost(prior: JointPrior) -> float:
    """Add what the sky's slope says of a prior to minus twice a log likelihood: even airlight may be under any sky."""
    if prior.rise.size == 0:
        return 0.0
    scale = _ANY_SLOPE * prior.airlight
    return 2.0 * math.log(prior.slope_deviation / scale) - (prior.slope / scale) ** 2


@dataclass(frozen=True, slots=True)
class RowAirlight:
    """Airlight of the rows of a level image before something on the road."""

    level: float  # At the horizon [linear grey levels]
    share: Floats  # (rows,): Over that at the horizon [-]
    deviation: Floats  # (rows,): Its standard deviation [-]


def row_airlight(sky: Sky, camera: Camera, extinction: float = USUAL_EXTINCTION) -> RowAirlight | None:
    """Airlight by rows from the sky's brightening upward; None where it is not seen whether that brightens.

    Over snow it hardly does, and yet a contrast that fog leaves 5 % of changes by a fifth.

    Takes `extinction` [1/m].
    """
    if sky.is_clipped or sky.slope <= _SURELY * sky.slope_deviation:
        return None
    table, chances = slope_table(), np.array(DROPLET_CHANCES)
    between = _between_depths(extinction * camera.mount_height)
    lines = [[between(part) for part in _lines(droplets, *sky.heights)] for droplets in range(len(chances))]
    slope = sky.slope / sky.luminance
    darker = np.array([darkness_of_slope(slope, float(rise), float(above)) for rise, above in lines])
    angle = np.arctan((camera.horizon_row - np.arange(camera.height)) / camera.focal_length)
    at = np.abs(angle)
    shapes = darker[:, None] * [
        np.where(angle < 0.0, -np.interp(at, table.angle, between(below)), np.interp(at, table.angle, between(above)))
        for below, above in zip(table.below, table.above, strict=True)
    ]
    mean = (chances[:, None] * shapes).sum(axis=0)
    spread = np.sqrt((chances[:, None] * (shapes - mean) ** 2).sum(axis=0))
    higher = (chances * darker * [above for _, above in lines]).sum()
    unsure = math.hypot(_OTHER_LIGHT, sky.slope_deviation / sky.slope)
    return RowAirlight(sky.luminance / (1.0 + float(higher)), 1.0 + mean, np.hypot(spread, unsure * mean))


def _between_depths(depth: float) -> Callable[[Floats], Floats]:
    """How rows of the table by optical heights of the eye are read at another one."""
    at = float(np.interp(math.log(depth), np.log(slope_table().depth), np.arange(slope_table().depth.size)))
    low = min(int(at), slope_table().depth.size - 2)
    return lambda rows: np.asarray(rows[low] + (at - low) * (rows[low + 1] - rows[low]), np.float64)


OTHER_ROAD = 30.0
"""Way after which an image shows so much other road that its evidence counts again [m]."""

LASTS = 1000.0
"""Way over which droplets stay the same [m]."""

MOST = 2.5
"""Most that the logarithm of a likelihood counts, in one picture: some roads fit the wrong droplets by far more [-]."""


class DropletMemory:
    """Chances of the kinds of droplets, learnt over the way.

    A single image hardly separates them, for a road whose albedo wanders may look like either. Its evidence is
    counted by the share of the road in it that is new.
    """

    def __init__(self) -> None:
        self._logarithms = np.log(DROPLET_CHANCES)
        self._time: float | None = None

    @property
    def chances(self) -> tuple[float, ...]:
        """How likely each kind is [-]."""
        weight = np.exp(self._logarithms - self._logarithms.max())
        return tuple((weight / weight.sum()).tolist())

    def learn(self, logarithms: tuple[float, ...], time: float, speed: float) -> None:
        """Learn from a picture (`time`, `speed` [s], [m/s])."""
        if not logarithms:
            return
        moved = 0.0 if self._time is None else max(speed * (time - self._time), 0.0)
        self._time = time
        beforehand, kept = np.log(DROPLET_CHANCES), math.exp(-moved / LASTS)
        learnt = min(moved / OTHER_ROAD, 1.0) * np.maximum(logarithms, -MOST)
        self._logarithms = beforehand + kept * (self._logarithms - beforehand) + learnt
