"""Patches of images: a near one as a farther camera would show it, and where one fits best."""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.core.linear_algebra import matrix_product

Floats = NDArray[np.float64]

_FLAT = 1e-12
"""Share of a template's power that a place must have to look like anything [-]."""

INDEPENDENT = 8.0
"""Neighbouring pixels that differ alike where a thing has changed: so many count as one [-]."""


class _MatchCost(NamedTuple):
    """How unlikely each place of a template in an image is."""

    correlation: Floats  # (rows, cols): Correlation coefficient, 0 where negative [-]
    cost: Floats  # (rows, cols): Negative logarithm of the posterior, up to a constant [-]
    # row, col: place of the least cost
    row: int
    col: int


def match_cost(image: Floats, template: Floats, prior: Floats) -> _MatchCost:
    """Correlate a template with every place of an image that it fits in, under what is known of its place.

    Takes `image` (rows, cols), `template` (m, n), `prior` (rows - m + 1, cols - n + 1).
    """
    correlation = np.clip(correlations(np.ascontiguousarray(image), np.ascontiguousarray(template)), 0.0, 0.9999)
    cost = 0.5 * template.size / INDEPENDENT * np.log1p(-(correlation**2)) + prior
    row, col = np.unravel_index(int(np.argmin(cost)), cost.shape)
    return _MatchCost(correlation, cost, int(row), int(col))


def vertex(values: Floats, at: int) -> float:
    """Where the minimum at a sample lies between its neighbours, by a parabola [samples]; 0 at the border.

    Takes `values` (n,).
    """
    if not 0 < at < values.size - 1:
        return 0.0
    left, here, right = (float(value) for value in values[at - 1 : at + 2])
    bend = left - 2.0 * here + right
    return min(max(0.5 * (left - right) / bend, -0.5), 0.5) if bend > 0 else 0.0


@kernel
def correlations(image: Floats, template: Floats) -> Floats:
    """Correlation coefficient of a template with each place of an image that it fits in; 0 where either is even.

    Returns by the place of the template's first row and column (rows - m + 1, cols - n + 1). Takes `image` (rows,
    cols), `template` (m, n).
    """
    height, width = template.shape
    rows, cols = image.shape[0] - height + 1, image.shape[1] - width + 1
    found = np.zeros((rows, cols))
    centred = template - template.mean()
    power, level = (centred * centred).sum(), image.mean()
    for row in range(rows):
        cross, total, square = np.zeros(cols), np.zeros(cols), np.zeros(cols)
        for i in range(height):
            for j in range(width):
                weight = centred[i, j]
                for col in range(cols):
                    value = image[row + i, col + j] - level
                    cross[col] += weight * value
                    total[col] += value
                    square[col] += value * value
        for col in range(cols):
            both = (square[col] - total[col] * total[col] / template.size) * power
            if both > _FLAT * power * power:
                found[row, col] = cross[col] / math.sqrt(both)
    return found


_LEAST_BOX = 0.5
"""Least width of the box over near pixels where both pictures are of one size [px]: no jumps from pixel to pixel."""


@dataclass(frozen=True, slots=True)
class Patch:
    """A piece of an image and the point in it that is followed."""

    luminance: Floats  # (rows, cols): Linear grey levels
    # column, row: position of the followed point, in columns and rows of the patch [px]
    column: float
    row: float
    # half_width, half_height: size of the followed thing about that point [px]; the patch may hold more around it
    half_width: float
    half_height: float
    blur: float = 0.0  # Standard deviation of the lens' blur next to the pixels' own size [px]


@dataclass(frozen=True, slots=True)
class Placement:
    """Where a near patch's point is in a far patch, and how much smaller it is there."""

    # column, row: columns and rows of the far patch [px]
    column: float
    row: float
    scale: float  # Far size over near size [-]


def box_weights(
    near_size: int, centre: float, far: Floats, far_centre: float, scale: float, blur: float = 0.0
) -> Floats:
    """Shares of near pixels in each far pixel along one axis.

    A far pixel covers 1/scale near ones, and its light is their mean: detail that the far picture cannot resolve is
    averaged out of the near one before they are compared. Without that, thin fog is overestimated.

    Returns rows sum to 1 where the far pixel lies inside the near patch (n, near_size). Takes `centre`, `far_centre`
    [px], `far` (n,) [px], `blur` [px].
    """
    # A near pixel is itself a mean over 1 and blurred: squares of widths add, as variances do, and a box of width w
    # has the variance w²/12.
    half = 0.5 * math.sqrt(max((1.0 + 12.0 * blur**2) * (scale**-2 - 1.0), _LEAST_BOX**2))
    return pixel_shares(near_size, centre + (far - far_centre) / scale, half)


@kernel
def pixel_shares(size: int, middle: Floats, half: float) -> Floats:
    """Shares of boxes about middles that lie on each of so many pixels."""
    shares = np.zeros((middle.size, size))
    for i in range(middle.size):
        low, high = middle[i] - half, middle[i] + half
        for j in range(max(int(low) - 1, 0), min(int(high) + 3, size)):
            shares[i, j] = max(min(high, j + 0.5) - max(low, j - 0.5), 0.0) / (2.0 * half)
    return shares


@dataclass(frozen=True, slots=True)
class PixelGrid:
    """Far pixels that are compared."""

    # rows, cols (m,): which they are in the far patch [px]
    rows: Floats
    cols: Floats
    far: Floats  # (n, m): Their luminance [linear grey levels]


def pixel_grid(near: Patch, far: Patch, at: Placement) -> PixelGrid | None:
    """Far pixels that the followed thing covers wholly; None if they are too few."""
    spans = []
    for centre, half, size in (
        (at.row, near.half_height * at.scale, far.luminance.shape[0]),
        (at.column, near.half_width * at.scale, far.luminance.shape[1]),
    ):
        first, last = math.ceil(centre - half + 0.5), math.floor(centre + half - 0.5)
        first, last = max(first, 0), min(last, size - 1)
        if last - first < 3:
            return None
        spans.append((first, last))
    (top, bottom), (left, right) = spans
    pixels = far.luminance[top : bottom + 1, left : right + 1]
    return PixelGrid(np.arange(top, bottom + 1.0), np.arange(left, right + 1.0), pixels)


def downsample_to(near: Patch, grid: PixelGrid, at: Placement) -> Floats:
    """Near patch (n, m) as the far camera would show it without fog."""
    return matrix_product(shrunk_rows(near, grid, at), column_weights(near, grid, at).T)


def shrunk_rows(near: Patch, grid: PixelGrid, at: Placement) -> Floats:
    """Rows of the near patch as the far camera would show them, in its own columns (n, near columns)."""
    rows = box_weights(near.luminance.shape[0], near.row, grid.rows, at.row, at.scale, near.blur)
    return matrix_product(rows, near.luminance)


def column_weights(near: Patch, grid: PixelGrid, at: Placement) -> Floats:
    """Shares (m, near columns) of the near patch's columns in the far ones."""
    return box_weights(near.luminance.shape[1], near.column, grid.cols, at.column, at.scale, near.blur)


def shrink(patch: Patch, scale: float) -> Patch:
    """Picture of fewer, larger pixels.

    Returns the same picture; as it is where the scale is 1.
    """
    if scale >= 1.0:
        return patch
    # Pixels are means over 1 already; what is left to widen them to 1/scale.
    half = 0.5 * math.sqrt(scale**-2 - 1.0)
    luminance = _box_means(_box_means(patch.luminance, scale, half).T, scale, half).T
    rows, cols = patch.luminance.shape
    return replace(
        patch,
        luminance=np.ascontiguousarray(luminance),
        column=rescale_position(patch.column, scale, cols, luminance.shape[1]),
        row=rescale_position(patch.row, scale, rows, luminance.shape[0]),
        half_width=patch.half_width * scale,
        half_height=patch.half_height * scale,
        blur=patch.blur * scale,
    )


def _box_means(values: Floats, scale: float, half: float) -> Floats:
    """Means of rows over boxes about the middles of fewer, larger rows, cut off at the border."""
    total = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
    count = max(math.floor(values.shape[0] * scale), 1)
    middle = 0.5 * values.shape[0] + (np.arange(count) - 0.5 * (count - 1)) / scale
    low, high = np.maximum(middle - half, 0.0), np.minimum(middle + half, float(values.shape[0]))

    def upto(edge: Floats) -> Floats:
        whole = np.minimum(edge.astype(np.int64), values.shape[0] - 1)
        share = (edge - whole)[:, None]
        return np.asarray((1.0 - share) * total[whole] + share * total[whole + 1])

    return np.asarray((upto(high) - upto(low)) / (high - low)[:, None])


def rescale_position(position: float, scale: float, before: int, after: int) -> float:
    """Row or column of a point once a picture's pixels have become others of another size about the same middle [px].

    Takes `position` [px].
    """
    return (position - 0.5 * (before - 1)) * scale + 0.5 * (after - 1)
