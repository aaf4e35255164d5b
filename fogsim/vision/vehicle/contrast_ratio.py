"""Contrast of the rear of a vehicle to the airlight in one picture over that in another."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.vision.light.luminance import darker_by
from fogsim.vision.light.medians import median_among, quantile, quantile_among
from fogsim.vision.vehicle.patch import INDEPENDENT, Patch, Placement, downsample_to, pixel_grid

Floats = NDArray[np.float64]


@kernel
def box_means(picture: Floats, rows: Floats, cols: Floats, box: float) -> tuple[Floats, float]:
    """Means over square boxes about the crossings of rows and columns.

    Takes `picture` (n, m), `rows`, `cols` (l,), `box` [px].
    """
    down, top, down_power = _shares(picture.shape[0], rows, box)
    across, left, across_power = _shares(picture.shape[1], cols, box)
    first, last = picture.shape[1], 0
    for j in range(cols.size):
        first, last = min(first, left[j]), max(last, left[j] + across.shape[1])
    last = min(last, picture.shape[1])
    means = np.zeros((rows.size, cols.size))
    line = np.zeros(picture.shape[1])
    for i in range(rows.size):
        line[first:last] = 0.0
        for r in range(min(down.shape[1], picture.shape[0] - top[i])):
            share = down[i, r]
            if share > 0.0:
                for c in range(first, last):
                    line[c] += share * picture[top[i] + r, c]
        for j in range(cols.size):
            total = 0.0
            for c in range(min(across.shape[1], picture.shape[1] - left[j])):
                total += across[j, c] * line[left[j] + c]
            means[i, j] = total
    return means, down_power * across_power


@kernel
def _shares(size: int, centres: Floats, box: float) -> tuple[Floats, NDArray[np.int64], float]:
    """Shares of pixels in boxes along one axis, the first pixel of each, and the mean of their sums of squares."""
    shares = np.zeros((centres.size, math.ceil(box) + 2))
    first = np.zeros(centres.size, np.int64)
    power = 0.0
    for i in range(centres.size):
        low, high = centres[i] - 0.5 * box, centres[i] + 0.5 * box
        first[i] = min(max(math.floor(low + 0.5), 0), size - 1)
        total = 0.0
        for p in range(min(shares.shape[1], size - first[i])):
            pixel = first[i] + p
            shares[i, p] = max(min(high, pixel + 0.5) - max(low, pixel - 0.5), 0.0)
            total += shares[i, p]
        for p in range(shares.shape[1]):
            shares[i, p] /= max(total, 1e-9)
            power += shares[i, p] ** 2
    return shares, first, power / max(centres.size, 1)


HALF_BODY = 0.42
"""Half the width of the part of the rear that is compared, in widths of the vehicle [-]."""

_HEIGHTS = (0.3, 1.2)
"""Heights of that part above the road [m]: above the road's shadow, below the roof of the flattest car."""

LARGE, HIGH = 2.25, (0.6, 1.6)
"""Width from which a vehicle is a lorry or a bus [m], and those heights then [m]: one sees below a semitrailer, and
differently from afar, so the part begins above the bar that keeps cars from running under it."""

TOP = 2.2
"""Height to which a rear may reach [m]: dark windows of vans are most useful, sky above a car is useless."""

_FINEST = 0.02
"""Smallest cell on which pictures are compared [m]."""

_DARKEST = 0.05
"""Luminance, over the sky's, that the darkest parts of any vehicle have from nearby: glass, tyres, shadow [-]."""

_SHADING = 0.08
"""Standard deviation of a surface's own luminance between two pictures, relative [-]: gloss, shading, what is drawn or
resolved of it. White paint is uncertain by that much of the sky's light, glass by next to nothing."""

_MISPLACED = 0.5
"""Misplacement of a cell that is reckoned with, in cells: what else is resolved in it [-]."""

_BIWEIGHT, _ROUNDS = 4.7, 5
"""Residual at which a cell no longer counts, in robust standard deviations [-] (Tukey's biweight): a lit lamp; and
rounds of the regression."""

LOST = 0.25
"""Deviation of what clipping takes from a vehicle, relative to it [-]."""

_LEAST_KEPT, _LEAST_PIXELS = 0.5, 12
"""Share of the cells that must not have changed [-], and fewest pixels of a mean."""


@dataclass(frozen=True, slots=True)
class RearPicture:
    """A part of an image around the rear of a vehicle."""

    contrast: Floats  # (rows, cols): (A − L) / A, A the luminance of the sky [-]
    noise: float  # Deviation of single pixels of it [-]
    # column, foot: where the middle of the rear meets the road, in columns and rows of the picture [px]
    column: float
    foot: float
    scale: float  # Pixels in a metre at the vehicle [px/m]
    width: float  # Of the vehicle [m]
    # By how much the light from which channels are clipped is above the sky's, and their single deviation, over it; the
    # latter is 0 where nothing is clipped [-]
    clipped: tuple[float, float] = (1.0, 0.0)

    @property
    def heights(self) -> tuple[float, float]:
        """Lowest and highest part of the rear that is compared, above the road [m]."""
        return HIGH if self.width >= LARGE else _HEIGHTS

    def displaced(self, right: float, up: float) -> "RearPicture":
        """The same picture of a vehicle that stands elsewhere in it (`right`, `up` [m])."""
        return replace(self, column=self.column + right * self.scale, foot=self.foot - up * self.scale)


@dataclass(frozen=True, slots=True)
class ContrastRatio:
    """Contrast of a picture over that of another of the same vehicle."""

    # ratio, deviation: the ratio and its standard deviation by noise and by cells that differ [-]
    ratio: float
    deviation: float
    lever: float  # Change of the ratio with an error of the airlight relative to it [-]
    visible: float  # Contrast of the reference in standard deviations of the other picture's cells [-]
    kept: float  # Share of the cells that took part [-]


@dataclass(frozen=True, slots=True)
class MeanLuminances:
    """Weighted means of the same pixels of two pictures, over the luminance of either's sky."""

    # far, near: means [-]
    far: float
    near: float
    deviation: float  # Standard deviation of the far mean by noise, shading and misplacement [-]


def resample(picture: RearPicture, lateral: Floats, height: Floats, cell: float) -> tuple[Floats, float]:
    """Contrast on a grid in metres as seen by pixels of one cell, and the variance of its noise.

    A far picture's box is one pixel; a near one's is wider by what a far pixel blurs, and squares of widths add.

    Takes `lateral`, `height` (m,) [m], `cell` [m].
    """
    box = math.sqrt(max(2.0 * (cell * picture.scale) ** 2 - 1.0, 1.0))
    rows, cols = picture.foot - height * picture.scale, picture.column + lateral * picture.scale
    means, left = box_means(picture.contrast, rows, cols, box)
    return means, picture.noise**2 * left


def common_cell(one: RearPicture, other: RearPicture) -> float:
    """Size of a pixel of the coarser of two pictures [m]."""
    return max(1.0 / one.scale, 1.0 / other.scale, _FINEST)


def cell_centres(low: float, high: float, cell: float, least: int) -> Floats:
    """Middles of cells between two places [m] (`low`, `high`, `cell` [m])."""
    count = max(round((high - low) / cell), least)
    return np.asarray(0.5 * (low + high) + cell * (np.arange(count) - 0.5 * (count - 1)), np.float64)


def contrast_ratio(reference: RearPicture, picture: RearPicture) -> ContrastRatio | None:
    """Ratio of the contrasts of two pictures of one vehicle: a line through the airlight, not a free one.

    Every part of the rear fades alike. Parts count by how well that is known: dark ones the most, as no shading and no
    loss of detail makes them bright; edges, which are not resolved alike, little; what is as bright as the airlight and
    what has changed (lit lamps) not at all.

    Returns None if the reference shows no contrast, or too much has changed.
    """
    cell = common_cell(reference, picture)
    side = HALF_BODY * reference.width
    lateral, height = cell_centres(-side, side, cell, 2), cell_centres(reference.heights[0], TOP, cell, 3)
    shown, shown_noise = resample(reference, lateral, height, cell)
    seen, seen_noise = resample(picture, lateral, height, cell)
    own = _own_variance(shown, math.sqrt(shown_noise))
    if not own.size:
        return None
    sure = shown**2 / (seen_noise + shown_noise + own)
    first = _weighted_median(seen / np.where(np.abs(shown) > 1e-9, shown, 1e-9), sure)
    weight, ratio = _line_through_airlight(shown, seen, first, seen_noise, shown_noise + own, False)
    count = int((weight > 0).sum())
    if count < max(_LEAST_KEPT * shown.size, 6):
        return None
    power, by_noise = float((weight * shown**2).sum()), float(weight.sum()) * shown_noise
    if power <= by_noise + 4.0 * math.sqrt(float((weight**2).sum())) * shown_noise:
        return None
    # Noise of the reference flattens the line.
    power -= by_noise
    ratio *= 1.0 + by_noise / power
    spread = seen_noise + ratio**2 * (shown_noise + INDEPENDENT * own)
    deviation = math.sqrt(float((weight**2 * shown**2 * spread).sum())) / power
    lever = abs(float((weight * shown).sum())) / power
    visible = math.sqrt(power / float(weight.sum()) / max(seen_noise, 1e-12))
    if lever > 0.0:
        fall, lost = darker_by(ratio / lever, *picture.clipped)
        ratio, deviation = fall * lever, math.hypot(deviation, LOST * lost * lever)
    return ContrastRatio(ratio, deviation, lever, visible, count / shown.size)


def mean_luminances(
    near: Patch, far: Patch, at: Placement, skies: tuple[float, float], noise: float
) -> MeanLuminances | None:
    """Mean luminance of a thing in two pictures, over pixels that say most of the fog and least of what has changed.

    In even fog each pixel's difference to the sky shrinks by one factor (Duntley's law). Pixels count by how much they
    differ and by how well that is known: dark ones most, edges little, and those that do not share the factor (lamps,
    what moved) not at all. The weights come from the near picture, or with residuals of either sign, so noise does not
    bias the mean.

    Returns None if nothing differs from the sky, or too few pixels can be compared. Takes `skies` [linear grey levels],
    `noise` [linear grey levels].
    """
    grid = pixel_grid(near, far, at)
    if grid is None or grid.far.size < _LEAST_PIXELS:
        return None
    shown = downsample_to(near, grid, at) / skies[0]
    weight, gain = _pixel_weights(1.0 - shown, 1.0 - grid.far / skies[1], noise / skies[1])
    total = float((weight * gain).sum())
    if total <= 0.0:
        return None
    share = weight * gain / total
    return MeanLuminances(
        far=float((share * grid.far).sum()) / skies[1],
        near=float((share * shown).sum()),
        deviation=math.sqrt(float((share * share / np.maximum(weight, 1e-12)).sum())),
    )


def _pixel_weights(near: Floats, far: Floats, noise: float) -> tuple[Floats, Floats]:
    """Weights of pixels by their contrasts to the sky, and the near contrasts, which the means are weighted by, too."""
    most = quantile(near, 0.95)
    if most <= 2.0 * noise:
        return np.zeros_like(near), np.zeros_like(near)
    shading = _shading_deviation(near, most)
    down, across = np.gradient(near)
    change = np.abs(down) + np.abs(across)
    gain = np.maximum(near, 0.0)
    first = _weighted_median(far / np.maximum(gain, 1e-9), gain**2 / (noise**2 + shading**2))
    own = shading**2 + (_MISPLACED * change) ** 2
    return _line_through_airlight(gain, far, first, noise**2, own, True)[0], gain


@kernel
def _own_variance(shown: Floats, noise: float) -> Floats:
    """Variance of each cell's own contrast between two pictures; none if nothing stands out of the noise."""
    most = quantile_among(shown.copy().ravel(), 0.95)
    if most <= 2.0 * noise:
        most = quantile_among(np.abs(shown).ravel(), 0.95)
        if most <= 2.0 * noise:
            return np.zeros((0, 0))
    (rows, cols), own, through = shown.shape, np.empty(shown.shape), most / (1.0 - _DARKEST)
    for i in range(rows):
        up, low = max(i - 1, 0), min(i + 1, rows - 1)
        for j in range(cols):
            left, right = max(j - 1, 0), min(j + 1, cols - 1)
            down, across = (
                (shown[low, j] - shown[up, j]) / (low - up),
                (shown[i, right] - shown[i, left]) / (right - left),
            )
            shading = _SHADING * through * max(1.0 - shown[i, j] / through, _DARKEST)
            own[i, j] = math.sqrt(shading**2 + _MISPLACED**2 * (down**2 + across**2)) ** 2
    return own


def _shading_deviation(contrast: Floats, most: float) -> Floats:
    """Deviation of contrasts by shading: a share of the luminance, at most the sky's, that the fog lets through."""
    through = most / (1.0 - _DARKEST)
    luminance = np.clip(1.0 - contrast / through, _DARKEST, 1.0)
    return np.asarray(_SHADING * through * luminance, np.float64)


@kernel
def _line_through_airlight(
    shown: Floats, seen: Floats, ratio: float, noise: float, own: Floats, rescaled: bool
) -> tuple[Floats, float]:
    """Weights and slope of seen = ratio · shown from a first ratio on, by variances of the noise and of what is shown.

    Iterated with Tukey's biweight; `rescaled` weights are by the variance that is found and not by that expected.
    """
    weight, residual, slope = np.zeros(shown.shape), np.empty(shown.shape), ratio
    for _ in range(_ROUNDS):
        t = min(max(slope, 0.0), 2.0)
        for i in range(shown.shape[0]):
            for j in range(shown.shape[1]):
                residual[i, j] = abs(seen[i, j] - slope * shown[i, j]) / math.sqrt(noise + t**2 * own[i, j])
        scale = max(1.4826 * median_among(residual.ravel()), 1.0)
        power, both = 0.0, 0.0
        for i in range(shown.shape[0]):
            for j in range(shown.shape[1]):
                kept = max(1.0 - (residual[i, j] / (_BIWEIGHT * scale)) ** 2, 0.0) ** 2
                variance = noise + t**2 * own[i, j]
                weight[i, j] = kept / (variance * scale**2 if rescaled else variance)
                power += weight[i, j] * shown[i, j] ** 2
                both += weight[i, j] * shown[i, j] * seen[i, j]
        if power <= 0.0:
            return np.zeros(shown.shape), slope
        slope = both / power
    return weight, slope


def _weighted_median(values: Floats, weights: Floats) -> float:
    flat = values.ravel()
    order = flat.argsort()
    upto = weights.ravel()[order].cumsum()
    return float(flat[order[upto.searchsorted(0.5 * upto[-1])]])
