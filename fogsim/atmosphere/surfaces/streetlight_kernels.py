"""Light of street lamps on the ground, as a map, and from the map on what pixels see."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.koschmieder_kernels import bilinear, fill_channels, repeat_channels
from fogsim.atmosphere.lamps.plane_pieces import choose_pixels, row_points, spread_over_row
from fogsim.core.jit import kernel

_ZERO, _ONE = np.float32(0.0), np.float32(1.0)
_FARTHEST = np.float32(500.0)  # half the diagonal of a map, and more


class GroundLight(NamedTuple):
    """A map of the light on the ground."""

    origin: NDArray[np.float64]  # (2,): Where the middle of the map's first corner is (x, y) [m]
    cell: float  # Side of its cells [m]
    # illuminance, tops (rows, cols): horizontal illuminance [lx] and height of the nearest lamp [m], rows to the north,
    # columns to the east
    illuminance: NDArray[np.float32]
    tops: NDArray[np.float32]


class EyeOnMap(NamedTuple):
    """Where the eye is on a map."""

    # column, row: place on the map [cells]
    column: np.float32
    row: np.float32
    cells_per_metre: np.float32  # [1/m]
    height: np.float32  # Of the eye [m]


class Reflection(NamedTuple):
    """How surfaces return the lamps' light: as they do the sky's."""

    factor: NDArray[np.float32]  # (3,): The lamps' colour per illuminance of the sky [1/lx]
    most: np.float32  # What is brighter shines by itself, and returns no more than that [cd/m²]


@kernel
def add_lamp_illuminance(
    lamps: NDArray[np.float64],
    extinction: NDArray[np.float64],
    height: float,
    intensity: NDArray[np.float64],
    farthest: float,
    ground: GroundLight,
) -> None:
    """Add lamps to a map of illuminance, and set how high the nearest lamp hangs.

    Takes `lamps` (n, 3) [m], `extinction` (n,) [1/m], `height` [m], `intensity` (m,) [cd], `farthest` [m].
    """
    origin, cell, illuminance, tops = ground.origin, ground.cell, ground.illuminance, ground.tops
    rows, columns = illuminance.shape
    last = intensity.shape[0] - 1.001
    nearest = np.full((rows, columns), np.float32(np.inf))
    for i in range(lamps.shape[0]):
        x0, y0 = (lamps[i, 0] - origin[0]) / cell, (lamps[i, 1] - origin[1]) / cell
        reach = farthest / cell
        for row in range(max(0, math.ceil(y0 - reach)), min(rows, math.floor(y0 + reach) + 1)):
            for column in range(max(0, math.ceil(x0 - reach)), min(columns, math.floor(x0 + reach) + 1)):
                square = cell**2 * ((column - x0) ** 2 + (row - y0) ** 2)
                if square >= farthest**2:
                    continue
                way = math.sqrt(square + height**2)
                cosine = height / way
                place = min(last, cosine * (intensity.shape[0] - 1))
                n = int(place)
                candela = intensity[n] + (intensity[n + 1] - intensity[n]) * (place - n)
                edge = 1.0 - square / farthest**2
                light = candela * cosine / way**2 * math.exp(-extinction[i] * way) * min(1.0, 4.0 * edge)
                illuminance[row, column] += np.float32(light)
                if square < nearest[row, column]:
                    nearest[row, column], tops[row, column] = np.float32(square), np.float32(lamps[i, 2])


@kernel
def _any_near(distance: NDArray[np.float32]) -> bool:
    """Whether a row sees anything that a lamp of the map may light."""
    near = False
    for u in range(distance.shape[0]):
        near |= distance[u] < _FARTHEST
    return near


@kernel
def _read_map(
    count: np.uint64,
    points: NDArray[np.float32],
    eye: EyeOnMap,
    ground: GroundLight,
    light: NDArray[np.float32],
) -> bool:
    """Illuminance of what chosen pixels see, at `points` (3, n) from the eye, none above the lamps; if there is any."""
    illuminance, tops, eye_height = ground.illuminance, ground.tops, eye.height
    last_row, last_column = np.float32(illuminance.shape[0] - 1.001), np.float32(illuminance.shape[1] - 1.001)
    east, north, up, per_metre = points[0], points[1], points[2], eye.cells_per_metre
    any_light = False
    for n in range(count):
        x, y = eye.column + east[n] * per_metre, eye.row + north[n] * per_metre
        light[n] = _ZERO
        if not (_ZERO <= x < last_column and _ZERO <= y < last_row):
            continue
        value = bilinear(illuminance, y, x)
        if value > _ZERO:
            top = tops[np.uint32(y), np.uint32(x)]
            light[n] = value * min(max(top - (eye_height + up[n]), _ZERO), _ONE)
            any_light = True
    return any_light


@kernel
def _light_row(
    luminance: NDArray[np.float32],
    light: NDArray[np.float32],
    factor: NDArray[np.float32],
    most: np.float32,
    out: NDArray[np.float32],
) -> None:
    for j in range(out.shape[0]):
        out[j] = luminance[j] + min(luminance[j], most) * light[j] * factor[j]


@kernel
def add_street_light(
    luminance: NDArray[np.float32],
    distance: NDArray[np.float32],
    ray_map: NDArray[np.float32],
    step: int,
    eye: EyeOnMap,
    ground: GroundLight,
    reflection: Reflection,
    out: NDArray[np.float32],
) -> None:
    """Luminance of an image by the sky's light and that of street lamps.

    Takes `luminance`, `out` (rows, cols · 3) [cd/m²], `distance` (rows, cols) [m], `ray_map` (3, 3).
    """
    columns = distance.shape[1]
    points, light, few = (
        np.empty((3, columns), np.float32),
        np.empty(columns, np.float32),
        np.empty(columns, np.float32),
    )
    length, inverse = np.empty(columns, np.float32), np.empty(columns, np.float32)
    pixel, chosen = np.empty(columns, np.float32), np.empty(columns, np.float32)
    bent, first, even = np.empty(columns, np.uint8), np.empty(columns, np.uint64), np.empty(columns, np.bool_)
    lit, channels = np.empty(3 * columns, np.float32), np.empty(3 * columns, np.float32)
    fill_channels(reflection.factor, channels)
    for v in range(distance.shape[0]):
        any_light = False
        if _any_near(distance[v]):
            for u in range(columns):
                length[u] = min(distance[v, u], _FARTHEST)
            n = choose_pixels(length, step, inverse, bent, pixel, chosen, first, even)
            row_points(n, ray_map, v, pixel, chosen, points)
            any_light = _read_map(n, points, eye, ground, few)
        if any_light:
            spread_over_row(few, step, first, even, light)
            repeat_channels(light, lit)
            _light_row(luminance[v], lit, channels, reflection.most, out[v])
        else:
            for j in range(3 * columns):
                out[v, j] = luminance[v, j]
