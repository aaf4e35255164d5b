"""Canny's edges of an image (Canny 1986), but for those that fog draws: ridges of the gradient's length.

OpenCV's search takes of two neighbours of one length the left one, so that a mirrored image had other edges, and it
wants the gradient in 16 bits.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.vision.light.medians import median_in

Image = NDArray[np.float32]

_EDGE_FACTOR = 10.0
"""Gradient of an edge in multiples of the road's own median gradient, which is noise and asphalt grain [-]."""

MIN_GRADIENT = 1.5
"""Smallest gradient that can be an edge [linear grey levels per px]: that of the quantisation of 8 bits."""

_SMOOTH_TAPS = 2
"""Taps of the smoothing on either side of the middle one: known to the compiler, which then does without that loop."""

_FLAT, _UPRIGHT = math.tan(math.radians(22.5)), math.tan(math.radians(67.5))
"""Down over across: below the one a gradient points to the side, above the other up or down [-]."""

_WEAK, _EDGE = 1, 2


@dataclass(frozen=True, slots=True)
class Gradient:
    """First derivatives of a smoothed image."""

    # across, down (rows, cols): change a pixel to the right and downward [linear grey levels per px]
    across: Image
    down: Image


@dataclass(frozen=True, slots=True)
class Edges:
    """Where an image has edges."""

    pixels: NDArray[np.uint8]  # (rows, cols) uint8: Non-zero on edges
    threshold: float  # Gradient above which a pixel starts an edge [linear grey levels per px]
    gradient: Gradient  # Derivatives of the image, the fog's own gradient taken away


def smoothed(luminance: Image) -> Image:
    """Smooth with a Gaussian of 1 px, over 5 px; what lies outside is as the border (`luminance` (rows, cols))."""
    blurred = np.empty_like(luminance)
    smooth(luminance, _gaussian(), blurred)
    return blurred


@cache
def _gaussian() -> Image:
    """Weights from the middle one on: the rest is its mirror image; all who ask get the same."""
    weights = np.exp(-0.5 * np.arange(_SMOOTH_TAPS + 1) ** 2)
    return np.asarray(weights / (2.0 * weights.sum() - weights[0]), np.float32)


class EdgeDetector:
    """Edge detector for images of one size, which works in buffers of its own.

    Large arrays made again for every frame cost more than the filters: the result of a call is overwritten by the next.

    Takes `of_row`, `of_road` [px].
    """

    def __init__(
        self,
        derivatives: Callable[[Image, Image, Image], None],
        *,
        of_row: int = 32,
        of_road: int = 6,
    ) -> None:
        self._derivatives, self._of_row, self._of_road = derivatives, of_row, of_road
        self._shape: tuple[int, ...] = ()

    def __call__(self, luminance: Image, fog_slope: Image | None) -> Edges:
        """Find edges, without those that the fog itself draws.

        Fog makes rows brighten toward the horizon, and the steepest row is the inflection that is sought: a plain
        detector would draw an edge right there and stop the region below it (the published recipe's blind spot beyond
        some 300 m). So each row's median gradient is taken away first, as far as fog could have made it; what differs
        from its own row (vehicles, marks, kerbs) stays, and so does what is too steep for fog where it is. The
        thresholds follow the median gradient of the lower half, where the road is.

        Returns the edge pixels, the threshold that they had to pass, and the gradient. Takes `luminance` (rows, cols),
        `fog_slope` (rows,).
        """
        self._make_room(luminance.shape)
        across, down = self._gradient.across, self._gradient.down
        self._derivatives(luminance, across, down)
        slope = np.zeros(luminance.shape[0], np.float32)
        if fog_slope is not None:
            slope = _row_slopes(down, self._of_row, fog_slope)
        squared_lengths(across, down, slope, self._squares)
        high = max(_EDGE_FACTOR * _median_size(self._squares, self._of_road), MIN_GRADIENT)
        trace_edges(across, down, self._squares, 0.5 * high, high, self._pixels)
        return Edges(self._pixels, high, self._gradient)

    def _make_room(self, shape: tuple[int, ...]) -> None:
        if shape != self._shape:
            self._shape = shape
            self._gradient = Gradient(np.empty(shape, np.float32), np.empty(shape, np.float32))
            self._squares: Image = np.zeros((shape[0] + 2, shape[1] + 2), np.float32)
            self._pixels: NDArray[np.uint8] = np.empty(shape, np.uint8)


def edge_map(blurred: Image, fog_slope: Image) -> Edges:
    """Edge pixels after Canny by Sobel's derivatives of an image that is smooth already.

    Returns see `EdgeDetector`. Takes `blurred` (rows, cols), `fog_slope` (rows,).
    """
    return EdgeDetector(_sobel, of_row=8, of_road=4)(blurred, fog_slope)


def _sobel(image: Image, across: Image, down: Image) -> None:
    cv2.Sobel(image, cv2.CV_32F, 1, 0, dst=across, scale=0.125, borderType=cv2.BORDER_REPLICATE)
    cv2.Sobel(image, cv2.CV_32F, 0, 1, dst=down, scale=0.125, borderType=cv2.BORDER_REPLICATE)


@kernel
def _median_size(squares: Image, step: int) -> float:
    """Median size of the gradient in the lower half, of whose squares there is a border of one pixel."""
    rows, cols = squares.shape[0] - 2, squares.shape[1] - 2
    sizes, count = np.empty((rows // (2 * step) + 2) * (cols // step + 3), np.float32), 0
    for row in range(rows // 2, rows, step):
        # From both sides inward: of a mirrored image the same pixels.
        for side in range(2):
            for i in range(0, (cols + 1 - side) // 2, step):
                sizes[count] = math.sqrt(squares[row + 1, cols - i if side else i + 1])
                count += 1
    return median_in(sizes[:count])


@kernel
def _row_slopes(down: NDArray[np.float32], step: int, most: NDArray[np.float32]) -> NDArray[np.float32]:
    """Median of each row's downward gradient in columns some way apart, as far as fog can have made it (rows,).

    Columns are those of `columns_apart`. Fog over a dark road brightens upward, so dI/dv is negative.
    """
    rows, cols = down.shape
    slopes, seen = np.empty(rows, np.float32), np.empty(cols, np.float32)
    for row in range(rows):
        count = 0
        for col in range(0, (cols + 1) // 2, step):
            seen[count] = down[row, col]
            count += 1
        for col in range(0, cols // 2, step):
            seen[count] = down[row, cols - 1 - col]
            count += 1
        ordered = np.sort(seen[:count])
        middle = 0.5 * (float(ordered[(count - 1) // 2]) + float(ordered[count // 2]))
        slopes[row] = min(max(middle, -float(most[row])), 0.0)
    return slopes


@kernel
def squared_lengths(
    across: NDArray[np.float32], down: NDArray[np.float32], slope: NDArray[np.float32], squares: NDArray[np.float32]
) -> None:
    """Take each row's slope from the downward gradient, in place, and square the gradient's length.

    Takes `across`, `down` (rows, cols), `slope` (rows,), `squares` (rows + 2, cols + 2).
    """
    rows, cols = across.shape
    for row in range(rows):
        ramp, side, height, target = slope[row], across[row], down[row], squares[row + 1]
        for col in range(cols):
            height[col] -= ramp
            target[col + 1] = side[col] * side[col] + height[col] * height[col]


@kernel
def trace_edges(
    across: NDArray[np.float32],
    down: NDArray[np.float32],
    squares: NDArray[np.float32],
    low: float,
    high: float,
    pixels: NDArray[np.uint8],
) -> None:
    """Find the ridges of the gradient above `low` that touch one above `high`, or another such ridge.

    Takes `across`, `down` (rows, cols), `squares` (rows + 2, cols + 2), `pixels` (rows, cols) uint8.
    """
    marks, waiting = np.zeros(squares.shape, np.uint8), np.empty(pixels.size, np.int64)
    bounds = np.float32(low * low), np.float32(high * high)
    steep = _mark_ridges(across, down, squares.ravel(), bounds, marks.ravel(), waiting)
    _follow(marks.ravel(), squares.shape[1], waiting, steep)
    for row in range(len(pixels)):
        line, target = marks[row + 1], pixels[row]
        for col in range(len(target)):
            target[col] = 255 * (line[col + 1] == _EDGE)


@kernel
def _mark_ridges(
    across: NDArray[np.float32],
    down: NDArray[np.float32],
    squares: NDArray[np.float32],
    bounds: tuple[np.float32, np.float32],
    marks: NDArray[np.uint8],
    steep: NDArray[np.int64],
) -> int:
    """Mark where the gradient's length falls off on both of the sides that it points to.

    That is weak between both bounds and an edge above: writes the places of the latter and returns their number.
    """
    low, high = bounds
    rows, cols = across.shape
    width, count = cols + 2, 0
    for row in range(rows):
        first = (row + 1) * width + 1
        for col in range(cols):
            here = squares[first + col]
            if here > low:
                side, height = abs(across[row, col]), abs(down[row, col])
                flat, upright = height < _FLAT * side, height > _UPRIGHT * side
                slant = width + 1 if (across[row, col] > 0.0) == (down[row, col] > 0.0) else width - 1
                step = 1 if flat else width if upright else slant
                before, after = squares[first + col - step], squares[first + col + step]
                # Without branches, which no processor could predict. Of equals side by side both are ridges.
                ridge = (here > before) & ((here > after) | ((here == after) & (flat | upright)))
                ridge |= flat & (here == before) & (here > after)
                if ridge:
                    marks[first + col] = _WEAK
                    if here > high:
                        marks[first + col] = _EDGE
                        steep[count] = first + col
                        count += 1
    return count


@kernel
def _follow(marks: NDArray[np.uint8], width: int, waiting: NDArray[np.int64], count: int) -> None:
    """Make edges of all weak ridges that touch one of those waiting, or one that has become one."""
    around = (-width - 1, -width, -width + 1, -1, 1, width - 1, width, width + 1)
    while count > 0:
        count -= 1
        place = waiting[count]
        for step in around:
            if marks[place + step] == _WEAK:
                marks[place + step] = _EDGE
                waiting[count] = place + step
                count += 1


@kernel
def smooth(image: NDArray[np.float32], weights: NDArray[np.float32], out: NDArray[np.float32]) -> None:
    """Smooth down the columns and along each row; what lies outside is as the border (`image`, `out` (rows, cols))."""
    rows, cols = image.shape
    line = np.empty(cols + 2 * _SMOOTH_TAPS, np.float32)
    for row in range(rows):
        for col in range(cols):
            value = weights[0] * image[row, col]
            for tap in range(1, _SMOOTH_TAPS + 1):
                value += weights[tap] * (image[min(row + tap, rows - 1), col] + image[max(row - tap, 0), col])
            line[_SMOOTH_TAPS + col] = value
        line[:_SMOOTH_TAPS], line[_SMOOTH_TAPS + cols :] = line[_SMOOTH_TAPS], line[_SMOOTH_TAPS + cols - 1]
        for col in range(cols):
            value = weights[0] * line[_SMOOTH_TAPS + col]
            for tap in range(1, _SMOOTH_TAPS + 1):
                value += weights[tap] * (line[_SMOOTH_TAPS + col + tap] + line[_SMOOTH_TAPS + col - tap])
            out[row, col] = value


@kernel
def peak_offset(before: float, here: float, behind: float) -> float:
    """Place of the peak of a parabola through three neighbouring pixels.

    Returns distance from the middle one [px]; 0 where the parabola has no peak.
    """
    bend = before - 2.0 * here + behind
    return 0.5 * (before - behind) / bend if bend < 0.0 else 0.0


_ALPHA = 1.0
"""Deriche's α: the smaller, the smoother; 0.5 for noisy and 1.5 for sharp images [1/px]."""

REACH = 7.0
"""Reach of the kernels in 1/α: beyond it less than a hundredth of their weight is left [-]."""


@lru_cache(maxsize=8)
def smoothing_kernel(alpha: float = _ALPHA) -> NDArray[np.float64]:
    """Deriche's smoothing, h(n) = s (α|n| + 1) e^(−α|n|), of sum 1.

    Returns read-only; what the recursion of the same α converges to, cut off at `REACH` (2 n + 1,). Takes `alpha`
    [1/px].
    """
    n = np.abs(_taps(alpha))
    e = math.exp(-alpha)
    kernel = (1.0 - e) ** 2 / (1.0 + 2.0 * alpha * e - e * e) * (alpha * n + 1.0) * np.exp(-alpha * n)
    kernel.flags.writeable = False
    return np.asarray(kernel)


@lru_cache(maxsize=8)
def derivative_kernel(alpha: float = _ALPHA) -> NDArray[np.float64]:
    """Deriche's derivative, ∝ n e^(−α|n|), of response 1 to a slope of 1 per pixel.

    Returns read-only, to be correlated with an image; the slope's sum is Σ n² e^(−α|n|) = 2 e (1 + e) / (1 − e)³ with e
    = e^(−α). Takes `alpha` [1/px].
    """
    n = _taps(alpha)
    e = math.exp(-alpha)
    kernel = n * np.exp(-alpha * np.abs(n)) * (1.0 - e) ** 3 / (2.0 * e * (1.0 + e))
    kernel.flags.writeable = False
    return np.asarray(kernel)


def _taps(alpha: float) -> NDArray[np.float64]:
    reach = math.ceil(REACH / alpha)
    return np.arange(-reach, reach + 1, dtype=np.float64)


_TAPS = math.ceil(REACH / _ALPHA)
"""Taps on either side of the middle one: known to the compiler, which then does without the loops over them."""


class CannyDeriche(EdgeDetector):
    """Edge detector by Deriche's derivatives."""

    def __init__(self) -> None:
        super().__init__(derivatives)


def derivatives(image: Image, across: Image, down: Image) -> None:
    """Derivatives of an image, each smoothed across its own direction.

    Takes `image` (rows, cols), `across`, `down` (rows, cols).
    """
    _derivatives(image, *_halves(), across, down)


@cache
def _halves() -> tuple[Image, Image]:
    """Weights that smooth, and those of the derivative, as in `_gaussian`."""
    return smoothing_kernel()[_TAPS:].astype(np.float32), derivative_kernel()[_TAPS:].astype(np.float32)


@kernel
def _derivatives(image: Image, smooth: Image, derivative: Image, across: Image, down: Image) -> None:
    """Down the columns first, which both share, then along the row, before the next row is begun.

    Pixels at equal distances are added first, so that a mirrored image gives the same to the last bit.
    """
    rows, cols = image.shape
    means, slopes = np.empty(cols + 2 * _TAPS, np.float32), np.empty(cols + 2 * _TAPS, np.float32)
    for row in range(rows):
        mean, slope, here, side, height = means[_TAPS:], slopes[_TAPS:], image[row], across[row], down[row]
        for col in range(cols):
            mean[col], slope[col] = smooth[0] * here[col], np.float32(0.0)
        for tap in range(1, _TAPS + 1):
            # Loops over the columns, since each spans in vector registers.
            lower, upper, weight, change = (
                image[min(row + tap, rows - 1)],
                image[max(row - tap, 0)],
                smooth[tap],
                derivative[tap],
            )
            for col in range(cols):
                mean[col] += weight * (lower[col] + upper[col])
                slope[col] += change * (lower[col] - upper[col])
        means[:_TAPS], means[_TAPS + cols :] = mean[0], mean[cols - 1]
        slopes[:_TAPS], slopes[_TAPS + cols :] = slope[0], slope[cols - 1]
        for col in range(cols):
            side[col], height[col] = np.float32(0.0), smooth[0] * slope[col]
        for tap in range(1, _TAPS + 1):
            weight, change = smooth[tap], derivative[tap]
            before, after = means[_TAPS - tap :], means[_TAPS + tap :]
            above, below = slopes[_TAPS - tap :], slopes[_TAPS + tap :]
            for col in range(cols):
                side[col] += change * (after[col] - before[col])
                height[col] += weight * (below[col] + above[col])
