"""Own lamps' light on surfaces and in the fog before them, for every pixel, row by row."""

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.koschmieder_kernels import (
    ENDLESS,
    bilinear,
    fill_channels,
    interpolate_rows,
    repeat_channels,
    transmittances,
)
from fogsim.atmosphere.lamps.lamp_tables import FOLD, SIZE
from fogsim.atmosphere.lamps.plane_pieces import choose_pixels, row_points, spread
from fogsim.jit import kernel

_ONE, _HALF, _THIRD = np.float32(1.0), np.float32(0.5), np.float32(1.0 / 3.0)
_ZERO = np.float32(0.0)
_FOLD = np.float32(FOLD)
_MIDDLE = np.float32(0.5 * (SIZE - 1))
_LAST_CELL = np.float32(SIZE - 1.001)
_LEAST = np.float32(1e-6)
_NEXT = np.uint32(1)

_Floats = NDArray[np.float32]
_ChoiceRows = tuple[_Floats, _Floats, NDArray[np.uint32], _Floats, NDArray[np.uint64], NDArray[np.bool_]]
_LightRows = tuple[_Floats, _Floats, _Floats, _Floats, _Floats, _Floats]


@kernel
def _read_row(
    count: np.uint64,
    values: NDArray[np.float32],
    nodes: np.uint32,
    left: NDArray[np.uint32],
    aside: NDArray[np.float32],
    node: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """Value for each chosen pixel of a row, linear between two rays and two nodes."""
    for u in range(count):
        n = np.uint32(node[u])
        along, share = node[u] - np.float32(n), aside[u]
        a = left[u] + n
        b = a + nodes
        near = values[a] + (values[b] - values[a]) * share
        far = values[a + _NEXT] + (values[b + _NEXT] - values[a + _NEXT]) * share
        out[u] = near + (far - near) * along


@kernel
def _add_row(
    colour: NDArray[np.float32],
    scattered: NDArray[np.float32],
    shone: NDArray[np.float32],
    response: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    for j in range(out.shape[0]):
        out[j] += colour[j] * (scattered[j] + shone[j] * response[j])


@kernel
def _places(
    count: np.uint64,
    along: NDArray[np.float32],
    across: NDArray[np.float32],
    start_along: np.float32,
    start_across: np.float32,
    out: NDArray[np.float32],
) -> None:
    """Where in a beam's table a row's pixels are, by one of the two tangents."""
    for u in range(count):
        x, y = max(along[u] - start_along, _LEAST), across[u] - start_across
        out[u] = min((y / (_FOLD * x + abs(y)) + _ONE) * _MIDDLE, _LAST_CELL)


@kernel
def _weights(
    count: np.uint64,
    forward: NDArray[np.float32],
    right: NDArray[np.float32],
    up: NDArray[np.float32],
    lamp: NDArray[np.float32],
    length: NDArray[np.float32],
    attenuation: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """e^(κ (r − s)) / s² for a row's pixels; the ways r to the eye and s to the lamp differ by little."""
    lamp_forward, lamp_right, lamp_up = lamp[0], lamp[1], lamp[2]
    for u in range(count):
        x, y, z = forward[u] - lamp_forward, right[u] - lamp_right, up[u] - lamp_up
        square = x * x + y * y + z * z
        gain = attenuation[u] * (length[u] - np.sqrt(square))
        series = _ONE + gain * (_ONE + _HALF * gain * (_ONE + _THIRD * gain))
        out[u] = series / square if x > _ZERO else _ZERO


@kernel
def _add_intensity(
    count: np.uint64,
    table: NDArray[np.float32],
    row: NDArray[np.float32],
    column: NDArray[np.float32],
    weight: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """Add to a row's pixels the intensity of a lamp times their weight."""
    for u in range(count):
        out[u] += bilinear(table, row[u], column[u]) * weight[u]


@kernel
def _column_places(
    count: np.uint64,
    pixel: NDArray[np.float32],
    columns: int,
    cells: int,
    nodes: int,
    left: NDArray[np.uint32],
    aside: NDArray[np.float32],
) -> None:
    """For each chosen pixel, where the profile of the ray left of it begins, and how far it is on to the next."""
    scale = np.float32(cells) / np.float32(max(columns - 1, 1))
    for u in range(count):
        place = pixel[u] * scale
        cell = min(np.int32(place), np.int32(cells - 1))
        left[u], aside[u] = np.uint32(cell * np.int32(nodes)), place - np.float32(cell)


@kernel
def _light_row(
    count: np.uint64,
    points: NDArray[np.float32],
    length: NDArray[np.float32],
    mean: NDArray[np.float32],
    lamps: NDArray[np.float32],
    tables: NDArray[np.float32],
    scratch: NDArray[np.float32],
    power: NDArray[np.int32],
    light: NDArray[np.float32],
) -> None:
    """Light of all lamps on what chosen pixels see, times its transmittance to the eye [lx]."""
    forward, right, up = points[0], points[1], points[2]
    column, row, weight, kept = scratch[0], scratch[1], scratch[2], scratch[3]
    for u in range(count):
        light[u] = _ZERO
    for i in range(lamps.shape[0]):
        _places(count, forward, right, lamps[i, 0], lamps[i, 1], column)
        _places(count, forward, up, lamps[i, 0], lamps[i, 2], row)
        _weights(count, forward, right, up, lamps[i], length, mean, weight)
        _add_intensity(count, tables[i], row, column, weight, light)
    for u in range(count):
        weight[u] = np.float32(2.0) * mean[u] * length[u]
    transmittances(weight[:count], power, kept)
    for u in range(count):
        light[u] *= kept[u]


@kernel
def _any_lit(response: NDArray[np.float32]) -> bool:
    """Whether a row (cols · 3) answers to light at all: bits, of which compilers make vector instructions."""
    lit = np.int32(0)
    for j in range(response.shape[0]):
        lit |= np.int32(response[j] > _ZERO)
    return bool(lit != 0)


@kernel
def _cut_lengths(distance: NDArray[np.float32], length: NDArray[np.float32]) -> None:
    """Distances of a row, endless ones cut to a length that can be computed with."""
    for u in range(length.shape[0]):
        length[u] = min(distance[u], np.float32(ENDLESS))


@kernel
def _node_places(
    count: np.uint64, length: NDArray[np.float32], last: np.float32, fold: np.float32, node: NDArray[np.float32]
) -> None:
    """Where between the nodes of their rays, of which `last` is the last, the things are that chosen pixels see."""
    for u in range(count):
        node[u] = min(last * length[u] / (length[u] + fold), last - np.float32(1e-3))


@kernel
def _rows_of_choice(columns: int, cells: int, nodes: int) -> _ChoiceRows:
    """Rows for the pixels that are chosen: columns, distances, profiles left of them and how far on, and pieces.

    They begin as if every pixel were chosen.
    """
    pixel, chosen = np.arange(columns).astype(np.float32), np.empty(columns, np.float32)
    left, aside = np.empty(columns, np.uint32), np.empty(columns, np.float32)
    _column_places(np.uint64(columns), pixel, columns, cells, nodes, left, aside)
    return pixel, chosen, left, aside, np.empty(columns, np.uint64), np.empty(columns, np.bool_)


@kernel
def _rows_of_light(columns: int) -> _LightRows:
    """Rows for what is scattered and what shines on surfaces: of the chosen pixels, of every pixel, of each channel."""
    few_scattered, few_light = np.empty(columns, np.float32), np.empty(columns, np.float32)
    scattered, light = np.zeros(columns, np.float32), np.zeros(columns, np.float32)
    veiled, shone = np.zeros(3 * columns, np.float32), np.zeros(3 * columns, np.float32)
    return few_scattered, few_light, scattered, light, veiled, shone


@kernel
def add_own_light(
    distance: NDArray[np.float32],
    response: NDArray[np.float32],
    ray_map: NDArray[np.float32],
    step: int,
    lamps: NDArray[np.float32],
    tables: NDArray[np.float32],
    colour: NDArray[np.float32],
    grid_columns: int,
    nodes: np.uint32,
    fold: np.float32,
    veil: NDArray[np.float32],
    attenuation: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """Add to an image (rows, cols · 3) what own lamps of one colour make of it.

    `response` (rows, cols · 3) may have no rows. `ray_map` takes (u, v, 1) to a ray in the vehicle's axes (forward,
    right, up); on plane surfaces light is computed at each `step`-th pixel. `lamps` (n, 3) are places in those axes and
    `tables` (n, SIZE, SIZE) their beams. `veil` and `attenuation` (rows, columns · nodes) hold the veil at each node of
    the grid's rays and the mean extinction coefficient to there; where fog is even `attenuation` has one entry, and in
    clear air `veil` has no rows. Nodes lie evenly over r / (r + fold).
    """
    columns = distance.shape[1]
    uniform, clear, surfaces = attenuation.size == 1, veil.shape[0] == 0, response.shape[0] > 0
    grid_rows, cells, last = max(veil.shape[0], attenuation.shape[0]), grid_columns - 1, np.float32(nodes - 1)
    profiles, node = np.zeros(grid_columns * int(nodes), np.float32), np.empty(columns, np.float32)
    points, scratch = np.empty((3, columns), np.float32), np.empty((4, columns), np.float32)
    length, inverse = np.empty(columns, np.float32), np.empty(columns, np.float32)
    bent, power = np.empty(columns, np.uint8), np.empty(columns, np.int32)
    mean, channels = np.full(columns, attenuation[0, 0]), np.empty(3 * columns, np.float32)
    no_response, n = np.zeros(3 * columns, np.float32), np.uint64(columns)
    pixel, chosen, left, aside, first, even = _rows_of_choice(columns, cells, int(nodes))
    few_scattered, few_light, scattered, light, veiled, shone = _rows_of_light(columns)
    fill_channels(colour, channels)
    if step == 1:
        # Every pixel is chosen, so that what is found for the chosen ones is every pixel's.
        chosen, scattered, light = length, few_scattered, few_light
    for v in range(distance.shape[0]):
        lit = surfaces and _any_lit(response[v])
        if clear and not lit:
            continue
        _cut_lengths(distance[v], length)
        if step > 1:
            n = choose_pixels(length, step, inverse, bent, pixel, chosen, first, even)
            _column_places(n, pixel, columns, cells, int(nodes), left, aside)
        _node_places(n, chosen, last, fold, node)
        place = np.float32(v) * np.float32(grid_rows - 1) / np.float32(max(distance.shape[0] - 1, 1))
        upper = min(int(place), grid_rows - 2)
        if not clear:
            interpolate_rows(veil[upper], veil[upper + 1], place - np.float32(upper), profiles)
            _read_row(n, profiles, nodes, left, aside, node, few_scattered)
            if step > 1:
                spread(few_scattered, step, first, even, scattered)
            repeat_channels(scattered, veiled)
        if lit:
            if not uniform:
                interpolate_rows(attenuation[upper], attenuation[upper + 1], place - np.float32(upper), profiles)
                _read_row(n, profiles, nodes, left, aside, node, mean)
            row_points(n, ray_map, v, pixel, chosen, points)
            _light_row(n, points, chosen, mean, lamps, tables, scratch, power, few_light)
            if step > 1:
                spread(few_light, step, first, even, light)
            repeat_channels(light, shone)
        _add_row(channels, veiled, shone, response[v] if lit else no_response, out[v])
