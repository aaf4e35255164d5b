"""Where the vehicle ahead is in the image: a window from its range and the calibration, refined on its edges."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.values.camera import Camera
from fogsim.vision.light.medians import median_among
from fogsim.vision.vehicle.patch import vertex

Floats = NDArray[np.float64]

WIDTHS = (1.4, 2.7)
"""Narrowest and widest rear of a vehicle with two tracks [m]: small cars to lorries."""

_NARROW_WIDTHS = (0.4, 1.0)
"""Narrowest and widest motorcycle with its rider's legs [m]."""

_ALONE = 1.25
"""How far from a motorcycle's middle nothing else has an edge as strong as its own [m]: of a car, something has."""

_NARROWER = 1.5
"""Factor by which a motorcycle must stand out more than the wider vehicle that might be there instead [-]."""

ASIDE = 3.5
"""Farthest that a vehicle's middle is looked for next to the own axis [m]."""

_USUAL_ASIDE = 1.2
"""Standard deviation of that offset [m]: place in the lane, heading of the own vehicle, bends."""

BODY = (0.25, 0.95)
"""Heights between which sides of all vehicles are upright [m]."""

_SMALLEST = 4.0
"""Least width of the widest vehicle for anything to be looked for [px]."""

_LEAST_EDGE = 4.5
"""Least step across either side of a vehicle, in standard deviations of the step's noise [-]."""

_CLUTTER = 6.0
"""Least step across either side of a vehicle, in medians of the steps between all columns [-]."""

_LEAST_STEP = 0.15
"""Least noise of a step, for instance by rounding [linear grey levels]."""

SMOOTHING = (0.00962006, 0.2054237, 0.56991248, 0.2054237, 0.00962006)
"""A Gaussian of 0.7 px, with which rows are smoothed before edges are looked for in them [-]."""

REACH, STANDS_OUT = math.radians(0.3), 2.5
"""How far from where the calibration has it the foot is looked for [rad], and the least step there over the usual one;
where none stands out so, the calibration says more [-]."""

_TYRES = 0.12
"""Share of a vehicle's width at either side in which the foot is searched [-]: between its wheels bright road shows."""


@dataclass(frozen=True, slots=True)
class RearBox:
    """Rear of a vehicle in an image."""

    column: float  # Of its middle [px]
    foot: float  # Row at which it stands on the road [px]
    width: float  # [px]
    evidence: float = 0.0  # How clearly the foot stands out, ln(1 + (step over the usual one)²) [-]


def search_window(camera: Camera, distance: float) -> tuple[slice, slice] | None:
    """Rows and columns of a level image in which a vehicle at a distance can be.

    Returns None if it is outside the image, or too small to be seen. Takes `distance` [m].
    """
    scale = camera.focal_length / distance
    foot, pitch = camera.horizon_row + camera.row_distance / distance, 0.01 * camera.focal_length
    middle, aside = camera.principal_point[0], (ASIDE + 1.6) * scale
    rows = max(math.floor(foot - 2.4 * scale - pitch), 0), min(math.ceil(foot + 0.2 * scale + pitch) + 1, camera.height)
    cols = max(math.floor(middle - aside), 0), min(math.ceil(middle + aside) + 1, camera.width)
    if rows[1] - rows[0] < 8 or cols[1] - cols[0] < 16 or foot >= camera.height or WIDTHS[1] * scale < _SMALLEST:
        return None
    return slice(*rows), slice(*cols)


def localise_rear(
    luminance: NDArray[np.float32], origin: tuple[int, int], camera: Camera, distance: float, noise: float
) -> RearBox | None:
    """Find the rear of a vehicle at a known distance.

    Left and right edge are the pair of columns with the strongest steps over the height of a vehicle's body, one up and
    one down, at a width that vehicles have, weighted by how symmetric it looks in between and how near to the own axis
    it is. The foot is the strongest step down the rows near where the calibration has the road.

    Returns In pixels of the whole image; None if no such pair stands out of the noise. Takes `luminance` (rows, cols),
    `distance` [m], `noise` [linear grey levels].
    """
    scale = camera.focal_length / distance
    foot = camera.horizon_row + camera.row_distance / distance - origin[1]
    rows = _span(foot - BODY[1] * scale, foot - BODY[0] * scale, luminance.shape[0])
    if rows is None or luminance.shape[1] < 8:
        return None
    body = luminance[rows]
    pair = _best_pair(body, scale, camera.principal_point[0] - origin[0], noise)
    if pair is None:
        return None
    left, right = pair
    between = luminance[:, math.ceil(left) + 1 : math.floor(right)]
    tyre = max(round(_TYRES * (right - left)), 1)
    foot, evidence = _refined_foot(np.hstack([between[:, :tyre], between[:, -tyre:]]), foot, camera, noise)
    return RearBox(0.5 * (left + right) + origin[0], foot + origin[1], right - left, evidence)


def _span(first: float, last: float, size: int) -> slice | None:
    low, high = max(math.floor(first), 0), min(math.ceil(last) + 1, size)
    return slice(low, high) if high - low >= 2 else None


def upright_steps(body: NDArray[np.float32], noise: float) -> tuple[Floats, float]:
    """Steps of luminance across upright edges, column by column, and the least that stands out.

    Returns both in linear grey levels per pixel (cols,). Takes `body` (rows, cols) [linear grey levels], `noise`
    [linear grey levels].
    """
    step, usual = _upright_steps(body)
    # Blur, difference and median leave half of a pixel's noise in one row, and what the road's texture adds.
    by_noise = _LEAST_EDGE * max(0.5 * noise, _LEAST_STEP) / math.sqrt(body.shape[0])
    return step, max(by_noise, _CLUTTER * usual)


@kernel
def _upright_steps(body: NDArray[np.float32]) -> tuple[Floats, float]:
    """`upright_steps`, and the median of their sizes."""
    (rows, cols), step = body.shape, np.empty(body.shape[1])
    smooth, down = np.zeros((rows, cols)), np.empty(rows)
    for row in range(rows):
        for col in range(cols):
            for i in range(len(SMOOTHING)):
                at = abs(col + i - 2)
                smooth[row, col] += SMOOTHING[i] * body[row, min(at, 2 * (cols - 1) - at)]
    for col in range(cols):
        left, right = max(col - 1, 0), min(col + 1, cols - 1)
        for row in range(rows):
            down[row] = (smooth[row, right] - smooth[row, left]) / (right - left)
        # The median down the rows keeps what is upright; marks of the road, which run aslant, drop out.
        step[col] = median_among(down)
    return step, median_among(np.abs(step))


def _best_pair(body: NDArray[np.float32], scale: float, axis: float, noise: float) -> tuple[float, float] | None:
    step, floor = upright_steps(body, noise)
    wide = _pair(body, step, WIDTHS, scale, axis, floor)
    narrow = _pair(body, step, _NARROW_WIDTHS, scale, axis, floor)
    if narrow is not None:
        narrow = _alone(narrow, step, scale, floor)
    if narrow is not None and (wide is None or narrow[0] > _NARROWER * wide[0]):
        wide = narrow
    return (
        None if wide is None else (wide[1] + vertex(-np.abs(step), wide[1]), wide[2] + vertex(-np.abs(step), wide[2]))
    )


def _pair(
    body: NDArray[np.float32], step: Floats, widths: tuple[float, float], scale: float, axis: float, floor: float
) -> tuple[float, int, int] | None:
    """Score, left and right column of the likeliest pair of edges of one of the widths."""
    scores: list[tuple[float, int, int]] = []
    wanted = np.arange(math.floor(widths[0] * scale), math.ceil(widths[1] * scale) + 1)
    for width in wanted[(wanted >= 3) & (wanted < step.size - 1)]:
        first, second = step[:-width], step[width:]
        # A rear is darker than what is next to it on both sides, or brighter on both.
        strength = np.where(first * second < 0, np.minimum(np.abs(first), np.abs(second)), 0.0)
        middle = np.arange(strength.size) + 0.5 * width
        usual = np.exp(-0.5 * ((middle - axis) / (_USUAL_ASIDE * scale)) ** 2)
        score = np.where(np.abs(middle - axis) <= ASIDE * scale, strength * usual, 0.0)
        best = int(np.argmax(score))
        if strength[best] > floor:
            scores.append((float(score[best]), best, int(best + width)))
    if not scores:
        return None
    likely = sorted(scores, reverse=True)[:12]
    return max(likely, key=lambda s: s[0] * (1.0 + max(_symmetry(body[:, s[1] : s[2] + 1]), 0.0)))


def _alone(pair: tuple[float, int, int], step: Floats, scale: float, floor: float) -> tuple[float, int, int] | None:
    """The pair, weaker by the strongest edge about it; None if that leaves nothing."""
    score, left, right = pair
    reach = _ALONE * scale - 0.5 * (right - left)
    gap = max(round(0.12 * scale), 2)
    before = np.abs(step[max(math.floor(left - reach), 0) : max(left - gap + 1, 0)])
    behind = np.abs(step[right + gap : max(math.ceil(right + reach), 0) + 1])
    other = max(float(before.max(initial=0.0)), float(behind.max(initial=0.0)))
    own = min(abs(step[left]), abs(step[right]))
    return None if own - other < floor else (score * (own - other) / own, left, right)


def _symmetry(pixels: NDArray[np.float32]) -> float:
    """Correlation of pixels with their mirror image."""
    centred = pixels - pixels.mean()
    power = float((centred**2).sum())
    return float((centred * centred[:, ::-1]).sum()) / power if power > 0 else 0.0


def _refined_foot(strip: NDArray[np.float32], foot: float, camera: Camera, noise: float) -> tuple[float, float]:
    """Row near where the foot should be at which the road begins, brighter than tyres and shadow, and its evidence."""
    reach = max(camera.focal_length * REACH, 1.5)
    first, last = max(int(foot - reach), 1), min(math.ceil(foot + reach), strip.shape[0] - 2)
    if last - first < 2 or strip.shape[1] < 2:
        return foot, 0.0
    rows = strip[first - 1 : last + 2].mean(axis=1, dtype=np.float64)
    step = np.gradient(rows)
    # What the assumed pitch says counts as much as a step does that stands out of the noise and of the other steps.
    other = max(noise / math.sqrt(2.0 * strip.shape[1]), float(np.median(np.abs(step))), _LEAST_STEP)
    at = (np.arange(step.size) + first - 1 - foot) / (0.5 * reach)
    evidence = np.log1p((np.maximum(step, 0.0) / other) ** 2) - 0.5 * at**2
    best = int(np.argmax(evidence[1:-1])) + 1
    if step[best] < STANDS_OUT * other:
        return foot, 0.0
    row = best + vertex(-np.maximum(step, 0.0), best) + first - 1
    return row, math.log1p((float(step[best]) / other) ** 2)
