"""Own lamps' light on surfaces and in the fog before them, for every pixel, row by row."""

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.kernels import ENDLESS, three_times, transmissions
from fogsim.atmosphere.lamp_tables import FOLD, SIZE
from fogsim.jit import kernel

_ONE, _HALF, _THIRD = np.float32(1.0), np.float32(0.5), np.float32(1.0 / 3.0)
_ZERO = np.float32(0.0)
_FOLD = np.float32(FOLD)
_MIDDLE = np.float32(0.5 * (SIZE - 1))
_LAST_CELL = np.float32(SIZE - 1.001)
_FARTHEST_LIT = np.float32(2000.0)
_LEAST = np.float32(1e-6)
_NEXT = np.uint32(1)


@kernel
def _between(low: NDArray[np.float32], high: NDArray[np.float32], share: np.float32, out: NDArray[np.float32]) -> None:
    """Profiles of a row's rays at a place between two rows of the grid."""
    for i in range(out.shape[0]):
        out[i] = low[i] + (high[i] - low[i]) * share


@kernel
def _read_row(
    values: NDArray[np.float32],
    nodes: np.uint32,
    left: NDArray[np.uint32],
    aside: NDArray[np.float32],
    node: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """Value for each pixel of a row, linear between two rays and two nodes."""
    for u in range(out.shape[0]):
        # Unsigned, because indices that may be negative cost a comparison each.
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
    along: NDArray[np.float32],
    across: NDArray[np.float32],
    start_along: np.float32,
    start_across: np.float32,
    out: NDArray[np.float32],
) -> None:
    """Where in a beam's table a row's pixels are, by one of the two tangents."""
    for u in range(out.shape[0]):
        x, y = max(along[u] - start_along, _LEAST), across[u] - start_across
        out[u] = min((y / (_FOLD * x + abs(y)) + _ONE) * _MIDDLE, _LAST_CELL)


@kernel
def _weights(
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
    for u in range(out.shape[0]):
        x, y, z = forward[u] - lamp_forward, right[u] - lamp_right, up[u] - lamp_up
        square = x * x + y * y + z * z
        gain = attenuation[u] * (length[u] - np.sqrt(square))
        series = _ONE + gain * (_ONE + _HALF * gain * (_ONE + _THIRD * gain))
        out[u] = series / square if x > _ZERO else _ZERO


@kernel
def _add_intensity(
    table: NDArray[np.float32],
    row: NDArray[np.float32],
    column: NDArray[np.float32],
    weight: NDArray[np.float32],
    lit: NDArray[np.bool_],
    out: NDArray[np.float32],
) -> None:
    """Add to a row's pixels the intensity of a lamp times their weight."""
    for u in range(out.shape[0]):
        if not lit[u]:
            continue
        a, b = np.uint32(row[u]), np.uint32(column[u])
        down, aside = row[u] - np.float32(a), column[u] - np.float32(b)
        low = table[a, b] + (table[a, b + _NEXT] - table[a, b]) * aside
        high = table[a + _NEXT, b] + (table[a + _NEXT, b + _NEXT] - table[a + _NEXT, b]) * aside
        out[u] += (low + (high - low) * down) * weight[u]


@kernel
def _column_places(cells: int, nodes: int, left: NDArray[np.uint32], aside: NDArray[np.float32]) -> None:
    """For each pixel of a row, where the profile of the ray left of it begins, and how far it is on to the next."""
    for u in range(left.shape[0]):
        place = np.float32(u) * np.float32(cells) / np.float32(max(left.shape[0] - 1, 1))
        cell = min(int(place), cells - 1)
        left[u], aside[u] = cell * nodes, place - np.float32(cell)


@kernel
def _row_points(
    ray_map: NDArray[np.float32],
    v: int,
    length: NDArray[np.float32],
    forward: NDArray[np.float32],
    right: NDArray[np.float32],
    up: NDArray[np.float32],
) -> None:
    """Where the things are that a row's pixels see."""
    first_x = ray_map[0, 1] * np.float32(v) + ray_map[0, 2]
    first_y = ray_map[1, 1] * np.float32(v) + ray_map[1, 2]
    first_z = ray_map[2, 1] * np.float32(v) + ray_map[2, 2]
    for u in range(length.shape[0]):
        x = first_x + ray_map[0, 0] * np.float32(u)
        y = first_y + ray_map[1, 0] * np.float32(u)
        z = first_z + ray_map[2, 0] * np.float32(u)
        scale = length[u] / np.sqrt(x * x + y * y + z * z)
        forward[u], right[u], up[u] = x * scale, y * scale, z * scale


@kernel
def _light_row(
    points: NDArray[np.float32],
    length: NDArray[np.float32],
    mean: NDArray[np.float32],
    response: NDArray[np.float32],
    lamps: NDArray[np.float32],
    tables: NDArray[np.float32],
    scratch: NDArray[np.float32],
    power: NDArray[np.int32],
    lit: NDArray[np.bool_],
    light: NDArray[np.float32],
) -> None:
    """Light of all lamps on what a row's pixels see, times its transmission to the eye [lx]."""
    forward, right, up = points[0], points[1], points[2]
    column, row, weight, kept = scratch[0], scratch[1], scratch[2], scratch[3]
    any_lit = False
    for u in range(length.shape[0]):
        lit[u] = (response[3 * u + 1] > _ZERO) & (length[u] < _FARTHEST_LIT)
        any_lit |= lit[u]
        light[u] = _ZERO
    if not any_lit:
        return
    for i in range(lamps.shape[0]):
        _places(forward, right, lamps[i, 0], lamps[i, 1], column)
        _places(forward, up, lamps[i, 0], lamps[i, 2], row)
        _weights(forward, right, up, lamps[i], length, mean, weight)
        _add_intensity(tables[i], row, column, weight, lit, light)
    for u in range(length.shape[0]):
        weight[u] = np.float32(2.0) * mean[u] * length[u]
    transmissions(weight, power, kept)
    for u in range(length.shape[0]):
        light[u] *= kept[u]


@kernel
def add_own_light(
    distance: NDArray[np.float32],
    response: NDArray[np.float32],
    ray_map: NDArray[np.float32],
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
    right, up), `lamps` (n, 3) are places there and `tables` (n, SIZE, SIZE) their beams. `veil` and `attenuation`
    (rows, columns · nodes) hold the veil at each node of the grid's rays and the mean extinction coefficient to there;
    where fog is even `attenuation` has one entry, and in clear air `veil` has no rows. Nodes lie evenly over
    r / (r + fold).
    """
    columns = distance.shape[1]
    uniform, clear, surfaces = attenuation.size == 1, veil.shape[0] == 0, response.shape[0] > 0
    grid_rows = max(veil.shape[0], attenuation.shape[0])
    profiles = np.zeros(grid_columns * int(nodes), np.float32)
    points, scratch = np.empty((3, columns), np.float32), np.empty((4, columns), np.float32)
    length, node, mean = np.empty(columns, np.float32), np.empty(columns, np.float32), np.empty(columns, np.float32)
    scattered, light = np.zeros(columns, np.float32), np.zeros(columns, np.float32)
    lit, power = np.empty(columns, np.bool_), np.empty(columns, np.int32)
    veiled, shone = np.empty(3 * columns, np.float32), np.zeros(3 * columns, np.float32)
    channels, no_response = np.empty(3 * columns, np.float32), np.zeros(3 * columns, np.float32)
    for j in range(3 * columns):
        channels[j] = colour[j % 3]
    left, aside = np.empty(columns, np.uint32), np.empty(columns, np.float32)
    _column_places(grid_columns - 1, int(nodes), left, aside)
    mean[:] = attenuation[0, 0]
    last = np.float32(nodes - 1)
    for v in range(distance.shape[0]):
        for u in range(columns):
            length[u] = min(distance[v, u], np.float32(ENDLESS))
            node[u] = min(last * length[u] / (length[u] + fold), last - np.float32(1e-3))
        place = np.float32(v) * np.float32(grid_rows - 1) / np.float32(max(distance.shape[0] - 1, 1))
        upper = min(int(place), grid_rows - 2)
        if not clear:
            _between(veil[upper], veil[upper + 1], place - np.float32(upper), profiles)
            _read_row(profiles, nodes, left, aside, node, scattered)
        if surfaces:
            if not uniform:
                _between(attenuation[upper], attenuation[upper + 1], place - np.float32(upper), profiles)
                _read_row(profiles, nodes, left, aside, node, mean)
            _row_points(ray_map, v, length, points[0], points[1], points[2])
            _light_row(points, length, mean, response[v], lamps, tables, scratch, power, lit, light)
            three_times(light, shone)
        three_times(scattered, veiled)
        _add_row(channels, veiled, shone, response[v] if surfaces else no_response, out[v])
