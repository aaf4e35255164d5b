"""Lamps of others as a camera meets them: where, how bright, behind what, and which of them look like one."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel

PLACE_U, PLACE_V, AHEAD, RANGE, DEPTH, STRENGTH, SHOWN, AREA, PIXELS = range(9)
COLOUR, TOWARDS = 9, 12
COLUMNS = 15
"""Columns of a table of lamps.

Place on the image [px], cosine of the angle off the camera's axis, range [m], optical depth, illuminance at the eye
were the air clear [lx], the share of the lamp that nothing hides, luminous area as a solid angle [sr] and in pixels,
colour (3) and direction in the camera's axes (3).
"""

BEHIND = 0.2
"""Cosine of the angle off the camera's axis at which lamps begin to fade as they pass the camera."""

_NEAREST = 0.5  # lamps nearer than this are not drawn [m]
_BEFORE = 1.0  # a surface so far before a lamp may be the lamp's own vehicle [m]
_SAME_RANGE = 0.15  # share by which ranges of lamps may differ that are drawn as one


@kernel
def project_lamps(
    position: NDArray[np.float64],
    intensity: NDArray[np.float64],
    eye: NDArray[np.float64],
    axes: NDArray[np.float64],
    lens: NDArray[np.float64],
    lamps: NDArray[np.float64],
    chosen: NDArray[np.int64],
) -> int:
    """Set place, range and direction of lamps before a camera, the numbers of which go to `chosen`; their count.

    `lens` holds the focal length and the principal point [px].
    """
    count = 0
    for i in range(position.shape[0]):
        x, y, z = position[i, 0] - eye[0], position[i, 1] - eye[1], position[i, 2] - eye[2]
        distance = math.sqrt(x * x + y * y + z * z)
        forward = axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z
        if intensity[i] <= 0.0 or distance <= _NEAREST or forward <= 0.0:
            continue
        right = axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z
        down = axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z
        lamp = lamps[count]
        lamp[PLACE_U] = lens[1] + lens[0] * right / max(forward, 1e-9)
        lamp[PLACE_V] = lens[2] + lens[0] * down / max(forward, 1e-9)
        lamp[RANGE], lamp[AHEAD] = distance, forward / distance
        lamp[TOWARDS], lamp[TOWARDS + 1], lamp[TOWARDS + 2] = right / distance, down / distance, forward / distance
        chosen[count] = i
        count += 1
    return count


@kernel
def _smooth(x: float) -> float:
    x = min(max(x, 0.0), 1.0)
    return (3.0 - 2.0 * x) * x * x


@kernel
def _shown(distance: NDArray[np.float32], u: float, v: float, nearest: float) -> float:
    """Share of the sixteen pixels about a place that see beyond a distance; outside the image nothing hides a lamp."""
    rows, columns = distance.shape
    if not (-1.0 < u < columns and -1.0 < v < rows):
        return 1.0
    u0, v0 = math.floor(u), math.floor(v)
    seen, free = 0, 0
    for row in range(max(0, v0 - 1), min(rows, v0 + 3)):
        for column in range(max(0, u0 - 1), min(columns, u0 + 3)):
            seen += 1
            if distance[row, column] > nearest:
                free += 1
    # A lamp's own surface may be a pixel in size, with other things beside it.
    return min(1.0, 4.0 * free / max(seen, 1))


@kernel
def select_lamps(
    intensity: NDArray[np.float64],
    colour: NDArray[np.float64],
    area: NDArray[np.float64],
    chosen: NDArray[np.int64],
    depth: NDArray[np.float64],
    farthest: float,
    focal: float,
    distance: NDArray[np.float32],
    lamps: NDArray[np.float64],
) -> int:
    """Set the other columns of placed lamps, and keep those that are not lost in fog; their count."""
    count = 0
    for i in range(depth.shape[0]):
        if depth[i] >= farthest:
            continue
        lamp, number = lamps[count], chosen[i]
        lamp[:] = lamps[i]
        square = lamp[RANGE] ** 2
        fade = _smooth(4.0 * (1.0 - depth[i] / farthest)) * _smooth(lamp[AHEAD] / BEHIND)
        lamp[DEPTH], lamp[STRENGTH] = depth[i], intensity[number] / square * fade
        lamp[SHOWN] = _shown(distance, lamp[PLACE_U], lamp[PLACE_V], lamp[RANGE] - _BEFORE)
        # A pixel sees the solid angle cos³ / f² of its direction off the axis.
        lamp[AREA] = area[number] / square
        lamp[PIXELS] = lamp[AREA] * focal**2 / max(lamp[AHEAD], BEHIND) ** 3
        for c in range(3):
            lamp[COLOUR + c] = colour[number, c]
        count += 1
    return count


@kernel
def merge_lamps(lamps: NDArray[np.float64], apart: float, fused: NDArray[np.float64]) -> int:
    """Draw together lamps that are less than `apart` from each other on the image [px], at like ranges; their count.

    What is left for them is the sum of their strengths, at the middle of their light.
    """
    count = 0
    for i in range(lamps.shape[0]):
        u, v, far, found = lamps[i, PLACE_U], lamps[i, PLACE_V], lamps[i, RANGE], -1
        for j in range(count):
            near = abs(fused[j, PLACE_U] - u) < apart and abs(fused[j, PLACE_V] - v) < apart
            if near and abs(fused[j, RANGE] - far) < _SAME_RANGE * far:
                found = j
                break
        if found < 0:
            fused[count] = lamps[i]
            count += 1
            continue
        strength = fused[found, STRENGTH] + lamps[i, STRENGTH]
        share = lamps[i, STRENGTH] / strength if strength > 0.0 else 0.0
        for column in range(COLUMNS):
            fused[found, column] += (lamps[i, column] - fused[found, column]) * share
        fused[found, STRENGTH] = strength
    return count
