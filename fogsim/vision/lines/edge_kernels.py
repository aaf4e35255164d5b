"""Canny's search for edges in a gradient (Canny 1986): ridges of its length, followed from the steep to the weak.

OpenCV's takes of two neighbours of one length the left one, so that a mirrored image had other edges, and it wants the
gradient in 16 bits.
"""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel

_FLAT, _UPRIGHT = math.tan(math.radians(22.5)), math.tan(math.radians(67.5))
"""Down over across: below the one a gradient points to the side, above the other up or down [-]."""

_WEAK, _EDGE = 1, 2


@kernel
def squared_lengths(
    across: NDArray[np.float32], down: NDArray[np.float32], slope: NDArray[np.float32], squares: NDArray[np.float32]
) -> None:
    """Take each row's slope from the downward gradient, in place, and square the gradient's length.

    Parameters
    ----------
    across, down : (rows, cols) float32
        The gradient; `down` is changed.
    slope : (rows,) float32
        What is taken off.
    squares : (rows + 2, cols + 2) float32
        Is written, all but its border.
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

    Parameters
    ----------
    across, down : (rows, cols) float32
        The gradient.
    squares : (rows + 2, cols + 2) float32
        Squares of its length, 0 on the border.
    low, high : float
        Thresholds of its length.
    pixels : (rows, cols) uint8
        Is written: 255 on edges and 0 elsewhere.
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


SMOOTH_TAPS = 2
"""Taps of the smoothing on either side of the middle one: known to the compiler, which then does without that loop."""


@kernel
def smooth(image: NDArray[np.float32], weights: NDArray[np.float32], out: NDArray[np.float32]) -> None:
    """Smooth down the columns and along each row; what lies outside is as the border.

    Parameters
    ----------
    image, out : (rows, cols) float32
        The image, and what is written.
    weights : (`SMOOTH_TAPS` + 1,) float32
        Weights from the middle one on.
    """
    rows, cols = image.shape
    line = np.empty(cols + 2 * SMOOTH_TAPS, np.float32)
    for row in range(rows):
        for col in range(cols):
            value = weights[0] * image[row, col]
            for tap in range(1, SMOOTH_TAPS + 1):
                value += weights[tap] * (image[min(row + tap, rows - 1), col] + image[max(row - tap, 0), col])
            line[SMOOTH_TAPS + col] = value
        line[:SMOOTH_TAPS], line[SMOOTH_TAPS + cols :] = line[SMOOTH_TAPS], line[SMOOTH_TAPS + cols - 1]
        for col in range(cols):
            value = weights[0] * line[SMOOTH_TAPS + col]
            for tap in range(1, SMOOTH_TAPS + 1):
                value += weights[tap] * (line[SMOOTH_TAPS + col + tap] + line[SMOOTH_TAPS + col - tap])
            out[row, col] = value


@kernel
def peak_offset(before: float, here: float, behind: float) -> float:
    """Place of the peak of a parabola through three neighbouring pixels.

    Parameters
    ----------
    before, here, behind : float
        Their values.

    Returns
    -------
    float
        Distance from the middle one [px]; 0 where the parabola has no peak.
    """
    bend = before - 2.0 * here + behind
    return 0.5 * (before - behind) / bend if bend < 0.0 else 0.0
