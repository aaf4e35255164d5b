"""Pictures of the vehicle ahead as contrast to the airlight, placed on each other and compared."""

import math
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

HALF_BODY = 0.42
"""Half the width of the part of the rear that is compared, in widths of the vehicle [-]."""

HEIGHTS = (0.3, 1.2)
"""Heights of that part above the road [m]: above the road's shadow, below the roof of the flattest car."""

LARGE, HIGH = 2.25, (0.6, 1.6)
"""Width from which a vehicle is a lorry or a bus [m], and those heights then [m]: one sees below a semitrailer, and
differently from afar, so the part begins above the bar that keeps cars from running under it."""

ASIDE, ABOVE, BELOW = 0.25, 0.15, 0.4
"""What is placed reaches so far beyond that part, or beyond the vehicle's sides [m]: its outline tells the place."""

FINEST = 0.02
"""Smallest cell on which pictures are compared [m]."""

OUTLIER, OWN_SHARE, EDGE_SHARE = 4.0, 0.25, 0.5
"""Residual of a cell that has changed, as a lit lamp has: robust deviations, and shares of the cell's own contrast and
of that to its neighbours, which a small displacement makes [-]."""

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
    """

    contrast: Floats
    noise: float
    column: float
    foot: float
    scale: float
    width: float

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


def _weights(size: int, centres: Floats, box: float) -> tuple[Floats, slice]:
    """Shares of pixels in boxes about centres, and which pixels; beyond the border there is nothing to share."""
    first = min(max(math.floor(centres.min() - 0.5 * box), 0), size - 1)
    last = min(max(math.ceil(centres.max() + 0.5 * box) + 1, first + 1), size)
    pixels = np.arange(first, last, dtype=np.float64)
    upper = np.minimum(centres[:, None] + 0.5 * box, pixels + 0.5)
    lower = np.maximum(centres[:, None] - 0.5 * box, pixels - 0.5)
    shares = np.maximum(upper - lower, 0.0)
    return np.asarray(shares / np.maximum(shares.sum(axis=1, keepdims=True), 1e-9), np.float64), slice(first, last)


def _resampled(picture: LeadPicture, lateral: Floats, height: Floats, cell: float) -> tuple[Floats, float]:
    """Contrast on a grid in metres as seen by pixels of one cell, and the variance of its noise.

    A far picture's box is one pixel; a near one's is wider by what a far pixel blurs, and squares of widths add.
    """
    box = math.sqrt(max(2.0 * (cell * picture.scale) ** 2 - 1.0, 1.0))
    rows, down = _weights(picture.contrast.shape[0], picture.foot - height * picture.scale, box)
    cols, across = _weights(picture.contrast.shape[1], picture.column + lateral * picture.scale, box)
    left = float((rows**2).sum(axis=1).mean() * (cols**2).sum(axis=1).mean())
    return np.asarray(rows @ picture.contrast[down, across] @ cols.T), picture.noise**2 * left


def _cell(one: LeadPicture, other: LeadPicture) -> float:
    return max(1.0 / one.scale, 1.0 / other.scale, FINEST)


def _grid(low: float, high: float, cell: float, least: int) -> Floats:
    count = max(round((high - low) / cell), least)
    return np.asarray(0.5 * (low + high) + cell * (np.arange(count) - 0.5 * (count - 1)), np.float64)


def placed(
    reference: LeadPicture, picture: LeadPicture, aside: float, pitch: float
) -> tuple[LeadPicture, float] | None:
    """Find the vehicle of a reference in a picture.

    Parameters
    ----------
    reference : LeadPicture
        The vehicle as it was seen.
    picture : LeadPicture
        Where it is expected.
    aside, pitch : float
        Standard deviations of its place sideways and upward [m].

    Returns
    -------
    (LeadPicture, float) or None
        The picture with the place of greatest posterior, and the correlation there [-]; None if it is too small.
    """
    cell = _cell(reference, picture)
    side = 0.5 * reference.width + ASIDE
    low, high = reference.heights
    lateral, height = _grid(-side, side, cell, 5), _grid(low - BELOW, high + ABOVE, cell, 4)
    across, up = (max(math.ceil(2.5 * deviation / cell), 1) for deviation in (aside, pitch))
    template, _ = _resampled(reference, lateral, height, cell)
    wide = cell * np.arange(-across, across + 1), cell * np.arange(-up, up + 1)
    lateral = np.concatenate([lateral[0] + wide[0][:across], lateral, lateral[-1] + wide[0][across + 1 :]])
    height = np.concatenate([height[0] + wide[1][:up], height, height[-1] + wide[1][up + 1 :]])
    seen, _ = _resampled(picture, lateral, height, cell)
    if float(template.std()) < 1e-4:
        return None
    match = cv2.matchTemplate(seen.astype(np.float32), template.astype(np.float32), cv2.TM_CCOEFF_NORMED)
    found = np.clip(np.nan_to_num(match.astype(np.float64), nan=0.0, posinf=0.0, neginf=0.0), 0.0, 0.9999)
    known = 0.5 * (wide[1][:, None] / pitch) ** 2 + 0.5 * (wide[0] / aside) ** 2
    cost = 0.5 * template.size * np.log1p(-(found**2)) + known
    row, col = np.unravel_index(int(np.argmin(cost)), cost.shape)
    right = (float(col) - across + _vertex(cost[row], int(col))) * cell
    high = (float(row) - up + _vertex(cost[:, col], int(row))) * cell
    return picture.moved(right, high), float(found[row, col])


def _vertex(cost: Floats, at: int) -> float:
    """Place of a minimum between cells, by a parabola."""
    if not 0 < at < cost.size - 1:
        return 0.0
    left, here, right = (float(value) for value in cost[at - 1 : at + 2])
    bend = left - 2.0 * here + right
    return min(max(0.5 * (left - right) / bend, -0.5), 0.5) if bend > 0 else 0.0


def compared(reference: LeadPicture, picture: LeadPicture) -> Fading | None:
    """Ratio of the contrasts of two pictures of one vehicle: a line through the airlight, not a free one.

    Every part of the rear fades alike, dark ones tell the most, and what is as bright as the airlight tells nothing.
    Cells that have changed are left out.

    Parameters
    ----------
    reference, picture : LeadPicture
        The vehicle, placed in both.

    Returns
    -------
    Fading or None
        None if the reference shows no contrast, or too much has changed.
    """
    cell = _cell(reference, picture)
    side = HALF_BODY * reference.width
    lateral, height = _grid(-side, side, cell, 2), _grid(*reference.heights, cell, 3)
    shown, shown_noise = _resampled(reference, lateral, height, cell)
    seen, seen_noise = _resampled(picture, lateral, height, cell)
    line = _line(shown, seen, math.sqrt(seen_noise))
    if line is None:
        return None
    used, ratio, scatter = line
    count = int(used.sum())
    power = float((shown[used] ** 2).sum()) - count * shown_noise
    if power <= 4.0 * math.sqrt(count) * shown_noise or power < count * 1e-4:
        return None
    # Noise of the reference flattens the line.
    ratio *= (power + count * shown_noise) / power
    detail = math.sqrt(max(scatter**2 - seen_noise - ratio**2 * shown_noise, 0.0))
    deviation = math.sqrt((seen_noise + ratio**2 * shown_noise + INDEPENDENT * detail**2) / power)
    lever = abs(float(shown[used].sum())) / power
    return Fading(ratio, deviation, lever, math.sqrt(power / count / max(seen_noise, 1e-12)), count / used.size)


def _line(shown: Floats, seen: Floats, noise: float) -> tuple[NDArray[np.bool_], float, float] | None:
    """Cells used, slope through the origin and deviation of what is left."""
    used = np.ones(shown.shape, bool)
    down, across = np.gradient(shown)
    change = np.abs(down) + np.abs(across)
    ratio = scatter = 0.0
    for _ in range(5):
        power = float((shown[used] ** 2).sum())
        if used.sum() < max(LEAST_KEPT * used.size, 6) or power <= 0:
            return None
        ratio = float((shown[used] * seen[used]).sum()) / power
        residual = np.abs(seen - ratio * shown)
        scatter = max(1.4826 * float(np.median(residual)), noise)
        kept = residual <= OUTLIER * scatter + abs(ratio) * (OWN_SHARE * np.abs(shown) + EDGE_SHARE * change)
        if bool((kept == used).all()):
            break
        used = kept
    return used, ratio, scatter
