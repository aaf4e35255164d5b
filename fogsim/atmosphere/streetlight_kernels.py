"""Light of street lamps on the ground, as a map, and from the map on what pixels see."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.kernels import three_times
from fogsim.atmosphere.plane_pieces import choose_pixels, spread
from fogsim.jit import kernel

_ZERO, _ONE = np.float32(0.0), np.float32(1.0)
_FARTHEST = np.float32(500.0)  # half the diagonal of a map, and more
_NEXT = np.uint32(1)


@kernel
def add_lamps(
    lamps: NDArray[np.float64],
    extinction: NDArray[np.float64],
    height: float,
    intensity: NDArray[np.float64],
    farthest: float,
    origin: NDArray[np.float64],
    cell: float,
    illuminance: NDArray[np.float32],
    tops: NDArray[np.float32],
) -> None:
    """Add lamps (n, 3) to a map of horizontal illuminance [lx], and set how high the nearest lamp hangs [m].

    `extinction` holds what each lamp's light loses a metre [1/m], `intensity` values over the cosine of the angle from
    straight down in even steps from 0 to 1 [cd]. `origin` is where the middle of the map's first corner is.
    """
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
                place = min(cosine * (intensity.shape[0] - 1), last)
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
def _row_places(
    count: np.uint64,
    ray_map: NDArray[np.float32],
    v: int,
    start: NDArray[np.float32],
    pixel: NDArray[np.float32],
    length: NDArray[np.float32],
    places: NDArray[np.float32],
) -> None:
    """Where chosen pixels of a row look, in cells of the map and metres above the eye."""
    first_x = ray_map[0, 1] * np.float32(v) + ray_map[0, 2]
    first_y = ray_map[1, 1] * np.float32(v) + ray_map[1, 2]
    first_z = ray_map[2, 1] * np.float32(v) + ray_map[2, 2]
    per_cell, east, north, up = start[2], places[0], places[1], places[2]
    for n in range(count):
        x = first_x + ray_map[0, 0] * pixel[n]
        y = first_y + ray_map[1, 0] * pixel[n]
        z = first_z + ray_map[2, 0] * pixel[n]
        scale = length[n] / np.sqrt(x * x + y * y + z * z)
        east[n], north[n], up[n] = start[0] + x * scale * per_cell, start[1] + y * scale * per_cell, z * scale


@kernel
def _read_map(
    count: np.uint64,
    places: NDArray[np.float32],
    eye_height: np.float32,
    illuminance: NDArray[np.float32],
    tops: NDArray[np.float32],
    light: NDArray[np.float32],
) -> bool:
    """Illuminance of what chosen pixels see, linear between the map's cells, none above the lamps; whether any."""
    last_row, last_column = np.float32(illuminance.shape[0] - 1.001), np.float32(illuminance.shape[1] - 1.001)
    east, north, up = places[0], places[1], places[2]
    any_light = False
    for n in range(count):
        x, y = east[n], north[n]
        light[n] = _ZERO
        if not (_ZERO <= x < last_column and _ZERO <= y < last_row):
            continue
        i, j = np.uint32(y), np.uint32(x)
        down, aside = y - np.float32(i), x - np.float32(j)
        low = illuminance[i, j] + (illuminance[i, j + _NEXT] - illuminance[i, j]) * aside
        high = illuminance[i + _NEXT, j] + (illuminance[i + _NEXT, j + _NEXT] - illuminance[i + _NEXT, j]) * aside
        value = low + (high - low) * down
        if value > _ZERO:
            light[n] = value * min(max(tops[i, j] - (eye_height + up[n]), _ZERO), _ONE)
            any_light = True
    return any_light


@kernel
def _light_row(
    radiance: NDArray[np.float32],
    light: NDArray[np.float32],
    factor: NDArray[np.float32],
    most: np.float32,
    out: NDArray[np.float32],
) -> None:
    for j in range(out.shape[0]):
        out[j] = radiance[j] + min(radiance[j], most) * light[j] * factor[j]


@kernel
def light_streets(
    radiance: NDArray[np.float32],
    distance: NDArray[np.float32],
    ray_map: NDArray[np.float32],
    step: int,
    start: NDArray[np.float32],
    eye_height: np.float32,
    illuminance: NDArray[np.float32],
    tops: NDArray[np.float32],
    factor: NDArray[np.float32],
    most: np.float32,
    out: NDArray[np.float32],
) -> None:
    """Radiance of an image (rows, cols · 3) by the sky's light and that of street lamps.

    Surfaces return the lamps' light as they do the sky's: `factor` (3) is the lamps' colour per illuminance of the sky
    [1/lx]. What is brighter than `most` shines by itself and returns no more than that [cd/m²]. `ray_map` takes
    (u, v, 1) to a ray in the world; on plane surfaces light is read at each `step`-th pixel. `start` is the eye's place
    on the map and the cells per metre.
    """
    columns = distance.shape[1]
    places, light, few = (
        np.empty((3, columns), np.float32),
        np.empty(columns, np.float32),
        np.empty(columns, np.float32),
    )
    length, inverse = np.empty(columns, np.float32), np.empty(columns, np.float32)
    pixel, chosen = np.empty(columns, np.float32), np.empty(columns, np.float32)
    bent, first, even = np.empty(columns, np.uint8), np.empty(columns, np.uint64), np.empty(columns, np.bool_)
    lit, channels = np.empty(3 * columns, np.float32), np.empty(3 * columns, np.float32)
    for j in range(3 * columns):
        channels[j] = factor[j % 3]
    for v in range(distance.shape[0]):
        any_light = False
        if _any_near(distance[v]):
            for u in range(columns):
                length[u] = min(distance[v, u], _FARTHEST)
            n = choose_pixels(length, step, inverse, bent, pixel, chosen, first, even)
            _row_places(n, ray_map, v, start, pixel, chosen, places)
            any_light = _read_map(n, places, eye_height, illuminance, tops, few)
        if any_light:
            spread(few, step, first, even, light)
            three_times(light, lit)
            _light_row(radiance[v], lit, channels, most, out[v])
        else:
            for j in range(3 * columns):
                out[v, j] = radiance[v, j]
