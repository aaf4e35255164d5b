"""Pictures of the vehicle ahead as contrast to the airlight, compared with each other."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.vision.light.box_means import box_means
from fogsim.vision.light.clipped_sky import darker_by

Floats = NDArray[np.float64]

HALF_BODY = 0.42
"""Half the width of the part of the rear that is compared, in widths of the vehicle [-]."""

HEIGHTS = (0.3, 1.2)
"""Heights of that part above the road [m]: above the road's shadow, below the roof of the flattest car."""

LARGE, HIGH = 2.25, (0.6, 1.6)
"""Width from which a vehicle is a lorry or a bus [m], and those heights then [m]: one sees below a semitrailer, and
differently from afar, so the part begins above the bar that keeps cars from running under it."""

TOP = 2.2
"""Height to which a rear may reach [m]: dark windows of vans tell the most, and sky above a car tells nothing."""

FINEST = 0.02
"""Smallest cell on which pictures are compared [m]."""

DARKEST = 0.05
"""Luminance, over the sky's, that the darkest parts of any vehicle have from nearby: glass, tyres, shadow [-]."""

SHADING = 0.08
"""Standard deviation of a surface's own luminance between two pictures, relative [-]: gloss, shading, what is drawn or
resolved of it. White paint is uncertain by that much of the sky's light, glass by next to nothing."""

MISPLACED = 0.5
"""Misplacement of a cell that is reckoned with, in cells: what else is resolved in it [-]."""

BIWEIGHT = 4.7
"""Residual at which a cell no longer counts, in robust standard deviations [-] (Tukey's biweight): a lit lamp."""

LOST = 0.25
"""Deviation of what clipping takes from a vehicle, relative to it [-]."""

LEAST_KEPT = 0.5
"""Share of the cells that must not have changed [-]."""

INDEPENDENT = 8.0
"""Cells that count as one where what is left is no noise, but detail that is not resolved alike [-]."""


@dataclass(frozen=True, slots=True)
class LeadPicture:
    """A part of an image around the rear of a vehicle.

    Attributes
    ----------
    contrast : (rows, cols) float64
        (A − L) / A, A the luminance of the sky [-].
    noise : float
        Deviation of single pixels of it [-].
    column, foot : float
        Where the middle of the rear meets the road, in columns and rows of the picture [px].
    scale : float
        Pixels in a metre at the vehicle [px/m].
    width : float
        Of the vehicle [m].
    clipped : tuple of float
        By how much the light from which channels are clipped is above the sky's, and their single deviation, over it;
        the latter is 0 where nothing is clipped [-].
    """

    contrast: Floats
    noise: float
    column: float
    foot: float
    scale: float
    width: float
    clipped: tuple[float, float] = (1.0, 0.0)

    @property
    def heights(self) -> tuple[float, float]:
        """Lowest and highest part of the rear that is compared, above the road [m]."""
        return HIGH if self.width >= LARGE else HEIGHTS

    def moved(self, right: float, up: float) -> "LeadPicture":
        """The same picture of a vehicle that is farther right and up [m]."""
        return replace(self, column=self.column + right * self.scale, foot=self.foot - up * self.scale)


@dataclass(frozen=True, slots=True)
class Fading:
    """Contrast of a picture over that of another of the same vehicle.

    Attributes
    ----------
    ratio, deviation : float
        The ratio and its standard deviation by noise and by cells that differ [-].
    lever : float
        Change of the ratio with an error of the airlight relative to it [-].
    visible : float
        Contrast of the reference in standard deviations of the other picture's cells [-].
    kept : float
        Share of the cells that took part [-].
    """

    ratio: float
    deviation: float
    lever: float
    visible: float
    kept: float


def resampled(picture: LeadPicture, lateral: Floats, height: Floats, cell: float) -> tuple[Floats, float]:
    """Contrast on a grid in metres as seen by pixels of one cell, and the variance of its noise.

    A far picture's box is one pixel; a near one's is wider by what a far pixel blurs, and squares of widths add.
    """
    box = math.sqrt(max(2.0 * (cell * picture.scale) ** 2 - 1.0, 1.0))
    rows, cols = picture.foot - height * picture.scale, picture.column + lateral * picture.scale
    means, left = box_means(picture.contrast, rows, cols, box)
    return means, picture.noise**2 * left


def cell_of(one: LeadPicture, other: LeadPicture) -> float:
    """Size of a pixel of the coarser of two pictures [m]."""
    return max(1.0 / one.scale, 1.0 / other.scale, FINEST)


def grid(low: float, high: float, cell: float, least: int) -> Floats:
    """Middles of cells between two places [m], at least so many."""
    count = max(round((high - low) / cell), least)
    return np.asarray(0.5 * (low + high) + cell * (np.arange(count) - 0.5 * (count - 1)), np.float64)


def compared(reference: LeadPicture, picture: LeadPicture) -> Fading | None:
    """Ratio of the contrasts of two pictures of one vehicle: a line through the airlight, not a free one.

    Every part of the rear fades alike. Parts count by how well that is known: dark ones the most, as no shading and no
    loss of detail makes them bright; edges, which are not resolved alike, little; what is as bright as the airlight and
    what has changed (lit lamps) not at all.

    Parameters
    ----------
    reference, picture : LeadPicture
        The vehicle, placed in both.

    Returns
    -------
    Fading or None
        None if the reference shows no contrast, or too much has changed.
    """
    cell = cell_of(reference, picture)
    side = HALF_BODY * reference.width
    lateral, height = grid(-side, side, cell, 2), grid(reference.heights[0], TOP, cell, 3)
    shown, shown_noise = resampled(reference, lateral, height, cell)
    seen, seen_noise = resampled(picture, lateral, height, cell)
    own = _uncertainty(shown, math.sqrt(shown_noise))
    if own is None:
        return None
    weight, ratio = _line(shown, seen, own, (shown_noise, seen_noise))
    count = int((weight > 0).sum())
    if count < max(LEAST_KEPT * shown.size, 6):
        return None
    power, by_noise = float((weight * shown**2).sum()), float(weight.sum()) * shown_noise
    if power <= by_noise + 4.0 * math.sqrt(float((weight**2).sum())) * shown_noise:
        return None
    # Noise of the reference flattens the line.
    power -= by_noise
    ratio *= 1.0 + by_noise / power
    spread = seen_noise + ratio**2 * (shown_noise + INDEPENDENT * own**2)
    deviation = math.sqrt(float((weight**2 * shown**2 * spread).sum())) / power
    lever = abs(float((weight * shown).sum())) / power
    visible = math.sqrt(power / float(weight.sum()) / max(seen_noise, 1e-12))
    if lever > 0.0:
        fall, lost = darker_by(ratio / lever, *picture.clipped)
        ratio, deviation = fall * lever, math.hypot(deviation, LOST * lost * lever)
    return Fading(ratio, deviation, lever, visible, count / shown.size)


def _uncertainty(shown: Floats, noise: float) -> Floats | None:
    """Deviation of each cell's own contrast between two pictures; None if nothing stands out of the noise."""
    most = float(np.percentile(shown, 95))
    if most <= 2.0 * noise:
        most = float(np.percentile(np.abs(shown), 95))
        if most <= 2.0 * noise:
            return None
    through = most / (1.0 - DARKEST)
    luminance = np.maximum(1.0 - shown / through, DARKEST)
    down, across = np.gradient(shown)
    return np.asarray(np.sqrt((SHADING * through * luminance) ** 2 + MISPLACED**2 * (down**2 + across**2)), np.float64)


def _line(shown: Floats, seen: Floats, own: Floats, noise: tuple[float, float]) -> tuple[Floats, float]:
    """Weights of the cells, and the slope through the origin."""
    weight = shown**2 / (noise[1] + noise[0] + own**2)
    ratio = _weighted_median(seen / np.where(np.abs(shown) > 1e-9, shown, 1e-9), weight)
    for _ in range(5):
        t = min(max(ratio, 0.0), 2.0)
        variance = noise[1] + t**2 * (noise[0] + own**2)
        residual = np.abs(seen - ratio * shown) / np.sqrt(variance)
        scale = max(1.4826 * float(np.median(residual)), 1.0)
        weight = np.maximum(1.0 - (residual / (BIWEIGHT * scale)) ** 2, 0.0) ** 2 / variance
        power = float((weight * shown**2).sum())
        if power <= 0.0:
            return np.zeros_like(shown), ratio
        ratio = float((weight * shown * seen).sum()) / power
    return weight, ratio


def _weighted_median(values: Floats, weights: Floats) -> float:
    order = np.argsort(values, axis=None)
    upto = np.cumsum(weights.ravel()[order])
    return float(values.ravel()[order][int(np.searchsorted(upto, 0.5 * upto[-1]))])
