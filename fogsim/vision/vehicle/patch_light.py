"""Mean light of one thing in two pictures, over pixels that say most of the fog and least of what has changed."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.vision.vehicle.patch import Patch, Placement, pixel_grid, seen_as

Floats = NDArray[np.float64]

DARKEST = 0.05
"""Luminance, over the sky's, that the darkest parts of any vehicle have from nearby: glass, tyres, shadow [-]."""

SHADING = 0.08
"""Standard deviation of a surface's own luminance between two pictures, relative [-]: gloss, shading, what is drawn or
resolved of it. White paint is uncertain by that much of the sky's light, glass by next to nothing."""

MISPLACED = 0.5
"""Misplacement of a pixel that is reckoned with [px]."""

LEAST_PIXELS = 12
"""Fewest pixels of a mean."""

BIWEIGHT = 4.7
"""Residual at which a pixel no longer counts, in robust standard deviations [-] (Tukey's biweight)."""


@dataclass(frozen=True, slots=True)
class SharedLight:
    """Weighted means of the same pixels of two pictures, over the luminance of either's sky.

    Attributes
    ----------
    far, near : float
        Means [-].
    deviation : float
        Standard deviation of the far mean by noise, shading and misplacement [-].
    """

    far: float
    near: float
    deviation: float


def shared_light(
    near: Patch, far: Patch, at: Placement, skies: tuple[float, float], noise: float
) -> SharedLight | None:
    """Compare the light of a thing in two pictures.

    In even fog each pixel's difference to the sky shrinks by one factor (Duntley's law). Pixels count by how much they
    differ and by how well that is known: dark ones most, edges little, and those that do not share the factor (lamps,
    what moved) not at all. The weights come from the near picture, or with residuals of either sign, so noise does not
    bias the mean.

    Parameters
    ----------
    near, far : Patch
        The two pictures.
    at : Placement
        Where the near one is in the far one.
    skies : tuple of float
        Luminance of the near and of the far picture's sky [linear grey levels].
    noise : float
        Standard deviation of single pixels [linear grey levels].

    Returns
    -------
    SharedLight or None
        None if nothing differs from the sky, or too few pixels can be compared.
    """
    grid = pixel_grid(near, far, at)
    if grid is None or grid.far.size < LEAST_PIXELS:
        return None
    shown = seen_as(near, grid, at) / skies[0]
    weight, gain = _certainty(1.0 - shown, 1.0 - grid.far / skies[1], noise / skies[1])
    total = float((weight * gain).sum())
    if total <= 0.0:
        return None
    share = weight * gain / total
    return SharedLight(
        far=float((share * grid.far).sum()) / skies[1],
        near=float((share * shown).sum()),
        deviation=math.sqrt(float((share * share / np.maximum(weight, 1e-12)).sum())),
    )


def _certainty(near: Floats, far: Floats, noise: float) -> tuple[Floats, Floats]:
    """Weights of pixels by their contrasts to the sky, and the near contrasts, which the means are weighted by, too."""
    most = float(np.percentile(near, 95))
    if most <= 2.0 * noise:
        return np.zeros_like(near), np.zeros_like(near)
    through = most / (1.0 - DARKEST)
    own = np.clip(1.0 - near / through, DARKEST, 1.0)
    down, across = np.gradient(near)
    change = np.abs(down) + np.abs(across)
    gain = np.maximum(near, 0.0)
    factor = _weighted_median(far / np.maximum(gain, 1e-9), gain**2 / (noise**2 + (SHADING * through * own) ** 2))
    weight: Floats = np.ones_like(near)
    for _ in range(5):
        t = min(max(factor, 0.0), 2.0)
        variance = noise**2 + t**2 * ((SHADING * through * own) ** 2 + (MISPLACED * change) ** 2)
        residual = (far - factor * gain) / np.sqrt(variance)
        scale = max(1.4826 * float(np.median(np.abs(residual))), 1.0)
        weight = np.maximum(1.0 - (residual / (BIWEIGHT * scale)) ** 2, 0.0) ** 2 / (variance * scale**2)
        weight[np.abs(residual) >= BIWEIGHT * scale] = 0.0
        power = float((weight * gain**2).sum())
        if power <= 0.0:
            return np.zeros_like(near), gain
        factor = float((weight * gain * far).sum()) / power
    return weight, gain


def _weighted_median(values: Floats, weights: Floats) -> float:
    order = np.argsort(values, axis=None)
    upto = np.cumsum(weights.ravel()[order])
    return float(values.ravel()[order][int(np.searchsorted(upto, 0.5 * upto[-1]))])
