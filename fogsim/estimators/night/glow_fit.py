"""Extinction from looks at one glow at several ranges."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.estimators.night.tail_glow import DEPTHS, tail_glows
from fogsim.estimators.night.tail_lamps import ANGLES, SECTORS, RedGlow, TailLamps
from fogsim.linear_algebra import inverse_of, matrix_product, times
from fogsim.units import extinction_from_visibility

Floats = NDArray[np.float64]

EXTINCTIONS = np.geomspace(extinction_from_visibility(2500.0), extinction_from_visibility(15.0), 56)
"""Extinction coefficients that are compared, all as likely beforehand [1/m]."""

SPACING = 0.08
"""Least difference of the logarithms of two looks' ranges [-]."""

MOST_LOOKS = 10
"""Looks at different ranges that are kept."""

ROUGH, LOCAL, COMMON, EXPOSURE = 0.05, 0.04, 0.10, 0.05
"""Relative deviations of a ring's light from the model: by itself; with its neighbours in one look; with its neighbours
in all looks; and of all rings of a look, by what tells its exposure [-].

The formula of the glow is within 10 % of photons, lamps shine otherwise than at the least that regulations ask, what
stands behind them is lit, and roads are not alike everywhere."""

INTENSITIES = (8.0, 108.0, 208.0)
"""Usual axial intensities of a tail lamp, of one that brakes, and with a rear fog lamp [cd]; UNECE R148 allows 4 … 17
for the first, 60 … 260 and 150 … 300 more for the others."""

RED_SHARE = 4.1
"""Red light of a red lamp, beyond that of white light, over its luminance [-]: red is a quarter of a white lamp's."""

ROAD_LUMINANCE = 1.65
"""Usual luminance of the near road in low beams [cd/m²]."""

USUAL = 0.5
"""Standard deviation of the logarithm of lamps' intensity over the road's luminance about the usual ones [-]."""

REACH, RANGE_REACH = 0.7, 1.0
"""Distances in ln γ, and in ln R, within which such deviations are alike [-]."""


@dataclass(frozen=True, slots=True)
class GlowLook:
    """One look at the glow.

    Attributes
    ----------
    time : float
        When [s].
    distance : float
        Range of the lamps [m].
    ratio : (h, t, rings) float32
        Ln of the light over the model's of every hypothesis and optical depth, at the exposure that the road tells; NaN
        where a ring tells nothing.
    noise : (rings,) float64
        Its standard deviation by the pixels' noise [-].
    unevenness : float
        How much the light over the best model's differs from side to side in a ring, the median of all [-].
    """

    time: float
    distance: float
    ratio: NDArray[np.float32]
    noise: Floats
    unevenness: float


def look_at(
    seen: RedGlow, lamps: TailLamps, focal_length: float, distance: float, road: float, time: float
) -> GlowLook:
    """Compare the red light about lamps with every model.

    Parameters
    ----------
    seen : RedGlow
        The light.
    lamps : TailLamps
        About which it is.
    focal_length : float
        Of the camera [px].
    distance : float
        Range of the lamps [m].
    road : float
        Light of the near road [-].
    time : float
        When [s].
    """
    told = np.isfinite(seen.log_red).sum(axis=1) >= 3
    u, v = seen.u[told].reshape(-1), seen.v[told].reshape(-1)
    model = np.zeros(())
    for side in (-1.0, 1.0):
        across, up = u - (lamps.u + side * lamps.half_spacing), lamps.v - v
        angle = np.arctan(np.hypot(across, up) / focal_length)
        # The lamp looks at the camera: its right is the picture's left.
        model = model + tail_glows().about(angle, np.arctan2(up, -across))
    red = seen.log_red[told]
    each = red - np.log(model).reshape(*model.shape[:2], -1, len(SECTORS))
    known = np.isfinite(red)
    ratio = np.full((*model.shape[:2], len(ANGLES)), np.nan, np.float32)
    noise, uneven = np.full(len(ANGLES), np.inf), np.empty((*model.shape[:2], len(red)))
    for at, ring in enumerate(np.flatnonzero(told)):
        some = each[:, :, at, known[at]]
        middle = np.median(some, axis=2)
        ratio[:, :, ring] = middle + 2.0 * math.log(distance) - math.log(max(road, 1e-3))
        noise[ring] = seen.noise[ring, known[at]].max() / math.sqrt(known[at].sum())
        uneven[:, :, at] = np.median(np.abs(some - middle[:, :, None]), axis=2)
    return GlowLook(time, distance, ratio, noise, float(np.median(uneven, axis=2).min()))


def likelihood(looks: tuple[GlowLook, ...], usual: float = USUAL) -> tuple[Floats, float]:
    """Share of each of `EXTINCTIONS` in what looks at one pair of lamps say (k,), and the best one's misfit a ring.

    Parameters
    ----------
    looks : tuple of GlowLook
        One or more, with the same lamps lit.
    usual : float
        Standard deviation of the logarithm of lamps' intensity over the road's luminance about the usual ones [-].
    """
    kept = [np.isfinite(look.noise) for look in looks]
    rest = np.concatenate([_at_extinctions(look)[:, :, some] for look, some in zip(looks, kept, strict=True)], axis=2)
    inverse = inverse_of(_spread(looks, kept))
    hypotheses, extinctions, count = rest.shape
    flat = rest.reshape(-1, count)
    ones = times(inverse, np.ones(count))
    known = 1.0 / float(ones.sum())
    common = (flat * ones).sum(axis=1) * known
    flat = flat - common[:, None]
    misfit = (matrix_product(flat, inverse) * flat).sum(axis=1)
    # The intensity is what all have in common: near one of the usual ones.
    likely = np.log(np.array(INTENSITIES) * RED_SHARE / ROAD_LUMINANCE)
    misfit = misfit[:, None] + (common[:, None] - likely) ** 2 / (usual**2 + known)
    misfit = misfit.reshape(hypotheses, extinctions, -1)
    # No lamp is seen through more fog than the models have.
    misfit[:, EXTINCTIONS * max(look.distance for look in looks) > DEPTHS[-1]] = np.inf
    least = float(misfit.min())
    share = np.exp(-0.5 * (misfit - least)).sum(axis=(0, 2))
    return share / share.sum(), least / count


def _at_extinctions(look: GlowLook) -> Floats:
    """Ln of the light over the model's at `EXTINCTIONS` (h, k, rings)."""
    depth = np.log(EXTINCTIONS * look.distance)
    row = np.interp(depth, np.log(DEPTHS), np.arange(len(DEPTHS), dtype=np.float64))
    low = np.minimum(row.astype(np.int64), len(DEPTHS) - 2)
    part = (row - low)[:, None]
    found = look.ratio[:, low] * (1.0 - part) + look.ratio[:, low + 1] * part
    # In thinner fog than the table's thinnest the light is in proportion to k.
    return np.asarray(found - np.minimum(depth - math.log(DEPTHS[0]), 0.0)[:, None], dtype=np.float64)


def _spread(looks: tuple[GlowLook, ...], kept: list[NDArray[np.bool_]]) -> Floats:
    """Covariance of all rings of all looks (n, n)."""
    angle = np.concatenate([np.log(ANGLES[some]) for some in kept])
    number = np.concatenate([np.full(int(some.sum()), at) for at, some in enumerate(kept)])
    distance = np.array([math.log(look.distance) for look in looks])[number]
    noise = np.concatenate([look.noise[some] for look, some in zip(looks, kept, strict=True)])
    alike = np.exp(-0.5 * ((angle[:, None] - angle) / REACH) ** 2)
    ranged = np.exp(-0.5 * ((distance[:, None] - distance) / RANGE_REACH) ** 2)
    same = number[:, None] == number
    spread = COMMON**2 * alike * ranged + same * (EXPOSURE**2 + LOCAL**2 * alike)
    return np.asarray(spread + np.diag(ROUGH**2 + noise**2))
