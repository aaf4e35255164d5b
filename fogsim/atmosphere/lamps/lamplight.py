"""Light of the own head lamps: on what the camera sees, and in the fog between."""

from dataclasses import dataclass
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.frustum import grid_depths
from fogsim.atmosphere.fog.koschmieder_kernels import (
    ENDLESS,
    interpolate_rows,
    transmittances,
)
from fogsim.atmosphere.fog.medium import is_uniform_below, medium_of
from fogsim.atmosphere.lamps.lamp_tables import FOLD, SIZE, lamp_table
from fogsim.atmosphere.lamps.phase_function import Droplets
from fogsim.atmosphere.lamps.pieces import (
    choose_pixels,
    cut_lengths,
    piece_length,
    read_between,
    row_pieces,
    row_points,
    split_places,
    spread_over_row,
    values_of_row,
)
from fogsim.atmosphere.lamps.veil import (
    FOLD_DISTANCE,
    INTERVALS,
    LitAir,
    VeilRays,
    average_extinctions,
    lit_air,
    node_distances,
    veil_along,
    veil_rays,
)
from fogsim.core.jit import Bands, kernel
from fogsim.core.linear_algebra import matrix_product
from fogsim.values import Camera, CameraPose, FogField, HeadLamp, View
from fogsim.values.pinhole import OWN_FRAME, camera_axes, ray_from_pixel

_ONE, _HALF, _THIRD = np.float32(1.0), np.float32(0.5), np.float32(1.0 / 3.0)
_ZERO = np.float32(0.0)
_FOLD = np.float32(FOLD)
_MIDDLE = np.float32(0.5 * (SIZE - 1))
_LAST_CELL = np.float32(SIZE - 1.001)
_LEAST = np.float32(1e-6)
_FIRST, _SECOND, _THREE = np.uint64(1), np.uint64(2), np.uint64(3)

_Floats = NDArray[np.float32]


class LampGroup(NamedTuple):
    """Lamps of one colour."""

    places: NDArray[np.float32]  # (n, 3): Where they are from the eye in the vehicle's axes (forward, right, up) [m]
    tables: NDArray[np.float32]  # (n, SIZE²): Their beams, sharp, row by row [cd]
    colour: NDArray[np.float32]  # (3,): Linear colour of luminance 1


class VeilGrid(NamedTuple):
    """The veil on a grid of rays, and what fog there is on them."""

    columns: int  # Columns of the grid
    nodes: np.uint32  # Nodes of a ray, which lie evenly over r / (r + fold)
    fold: np.float32  # See `nodes` [m]
    # ray_step, node_step: from a value to that of the next ray, and to that of the next node; one of the two is 1
    ray_step: int
    node_step: int
    # (rows, columns · nodes): Veil from the eye to each node [cd/m²]; without rows in clear air
    veil: NDArray[np.float32]
    # (rows, columns · nodes): Mean extinction coefficient to each node; one entry where fog is even [1/m]
    attenuation: NDArray[np.float32]


class _Places(NamedTuple):
    """Places of a row's pixels along one axis of a table."""

    cell: NDArray[np.int32]  # (n,): Number of the value before each
    share: NDArray[np.float32]  # (n,): How far it is on to the next


class _Work(NamedTuple):
    """Memory for what is computed of a row's pixels."""

    row: _Places
    column: _Places
    weight: NDArray[np.float32]
    kept: NDArray[np.float32]
    power: NDArray[np.int32]
    cell: NDArray[np.int32]
    profiles: NDArray[np.float32]


@kernel
def _read_profiles(
    count: np.uint64,
    low: NDArray[np.float32],
    high: NDArray[np.float32],
    share: np.float32,
    grid: VeilGrid,
    pixel: _Places,
    node: _Places,
    work: _Work,
    out: NDArray[np.float32],
) -> None:
    """Value for each chosen pixel of a row between two rows of a grid, linear between two rays and two nodes."""
    cell, begin, end = work.cell, np.int32(low.shape[0]), np.int32(0)
    for u in range(count):
        cell[u] = pixel.cell[u] + node.cell[u]
        begin, end = min(begin, node.cell[u]), max(end, node.cell[u])
    # Node by node, only those that are seen are needed.
    first, last = (begin, end + 2 * grid.node_step) if grid.ray_step == 1 else (0, low.shape[0])
    interpolate_rows(low[first:last], high[first:last], share, work.profiles[first:last])
    down, aside = (node, pixel) if grid.ray_step == 1 else (pixel, node)
    read_between(count, work.profiles, max(grid.ray_step, grid.node_step), cell, down.share, aside.share, out)


@kernel
def _add_lamplight(
    colour: NDArray[np.float32],
    scattered: NDArray[np.float32],
    light: NDArray[np.float32],
    response: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """Add what fog scatters, and what surfaces return of light, to a row (`response`, `out` (3 · n,))."""
    red, green, blue = colour[0], colour[1], colour[2]
    for u in range(np.uint64(out.shape[0]) // _THREE):
        veil, shone, at = scattered[u], light[u], _THREE * u
        out[at] += red * (veil + shone * response[at])
        out[at + _FIRST] += green * (veil + shone * response[at + _FIRST])
        out[at + _SECOND] += blue * (veil + shone * response[at + _SECOND])


@kernel
def _add_veil(colour: NDArray[np.float32], scattered: NDArray[np.float32], out: NDArray[np.float32]) -> None:
    """Add what fog scatters to a row (`out` (3 · n,))."""
    red, green, blue = colour[0], colour[1], colour[2]
    for u in range(np.uint64(out.shape[0]) // _THREE):
        veil, at = scattered[u], _THREE * u
        out[at] += red * veil
        out[at + _FIRST] += green * veil
        out[at + _SECOND] += blue * veil


@kernel
def _table_places(
    count: np.uint64,
    along: NDArray[np.float32],
    across: NDArray[np.float32],
    start_along: np.float32,
    start_across: np.float32,
    stride: int,
    out: _Places,
) -> None:
    """Where in a beam's table a row's pixels are, by one of the two tangents."""
    share = out.share
    for u in range(count):
        x, y = max(along[u] - start_along, _LEAST), across[u] - start_across
        share[u] = min((y / (_FOLD * x + abs(y)) + _ONE) * _MIDDLE, _LAST_CELL)
    split_places(count, share, stride, out.cell, share)


@kernel
def _distance_weights(
    count: np.uint64,
    points: NDArray[np.float32],
    lamp: NDArray[np.float32],
    length: NDArray[np.float32],
    attenuation: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """e^(κ (r − s)) / s² for a row's pixels; the ways r to the eye and s to the lamp differ by little."""
    forward, right, up, lamp_forward, lamp_right, lamp_up = points[0], points[1], points[2], lamp[0], lamp[1], lamp[2]
    for u in range(count):
        x, y, z = forward[u] - lamp_forward, right[u] - lamp_right, up[u] - lamp_up
        square = x * x + y * y + z * z
        gain = attenuation[u] * (length[u] - np.sqrt(square))
        series = _ONE + gain * (_ONE + _HALF * gain * (_ONE + _THIRD * gain))
        out[u] = series / square if x > _ZERO else _ZERO


@kernel
def _column_places(count: np.uint64, pixel: NDArray[np.float32], columns: int, grid: VeilGrid, out: _Places) -> None:
    """For each chosen pixel, where the profile of the ray left of it begins, and how far it is on to the next."""
    scale, last = np.float32(grid.columns - 1) / np.float32(max(columns - 1, 1)), np.int32(grid.columns - 2)
    step = np.int32(grid.ray_step)
    for u in range(count):
        place = pixel[u] * scale
        whole = min(np.int32(place), last)
        out.cell[u], out.share[u] = whole * step, place - np.float32(whole)


@kernel
def _light_surfaces(
    count: np.uint64,
    points: NDArray[np.float32],
    length: NDArray[np.float32],
    mean: NDArray[np.float32],
    lamps: LampGroup,
    work: _Work,
    light: NDArray[np.float32],
) -> None:
    """Light of all lamps on what chosen pixels see, times its transmittance to the eye [lx]."""
    row, column, weight, kept, cell = work.row, work.column, work.weight, work.kept, work.cell
    for u in range(count):
        light[u] = _ZERO
    places = lamps.places
    for i in range(places.shape[0]):
        _table_places(count, points[0], points[1], places[i, 0], places[i, 1], 1, column)
        if i == 0 or places[i, 0] != places[i - 1, 0] or places[i, 2] != places[i - 1, 2]:
            _table_places(count, points[0], points[2], places[i, 0], places[i, 2], SIZE, row)
        for u in range(count):
            cell[u] = row.cell[u] + column.cell[u]
        read_between(count, lamps.tables[i], SIZE, cell, row.share, column.share, kept)
        _distance_weights(count, points, places[i], length, mean, weight)
        for u in range(count):
            light[u] += kept[u] * weight[u]
    for u in range(count):
        weight[u] = np.float32(2.0) * mean[u] * length[u]
    transmittances(weight[:count], work.power, kept)
    for u in range(count):
        light[u] *= kept[u]


@kernel
def _node_places(count: np.uint64, length: NDArray[np.float32], grid: VeilGrid, out: _Places) -> None:
    """Positions between the nodes of their rays of the surfaces that the chosen pixels see."""
    last, share = np.float32(grid.nodes - 1), out.share
    for u in range(count):
        share[u] = min(last - np.float32(1e-3), last * length[u] / (length[u] + grid.fold))
    split_places(count, share, grid.node_step, out.cell, share)


@kernel
def _places(columns: int) -> _Places:
    return _Places(np.empty(columns, np.int32), np.empty(columns, np.float32))


@kernel
def _work_for(columns: int, grid: VeilGrid) -> _Work:
    return _Work(
        _places(columns),
        _places(columns),
        np.empty(columns, np.float32),
        np.empty(columns, np.float32),
        np.empty(columns, np.int32),
        np.empty(columns, np.int32),
        np.empty(grid.columns * int(grid.nodes), np.float32),
    )


@kernel
def add_own_light(
    distance: NDArray[np.float32],
    response: NDArray[np.float32],
    ray_map: NDArray[np.float32],
    step: int,
    lamps: LampGroup,
    grid: VeilGrid,
    top: int,
    bottom: int,
    out: NDArray[np.float32],
) -> None:
    """Add to rows of an image what own lamps of one colour make of it.

    Takes `distance` (rows, cols) [m], `response` (rows, cols · 3) [cd/m² per lx], `ray_map` (3, 3), `out` (rows, cols ·
    3) [cd/m²].
    """
    veil, attenuation = grid.veil, grid.attenuation
    columns = distance.shape[1]
    uniform, clear, surfaces = attenuation.size == 1, veil.shape[0] == 0, response.shape[0] > 0
    grid_rows = max(veil.shape[0], attenuation.shape[0])
    points, length = np.empty((3, columns), np.float32), np.empty(columns, np.float32)
    mean = np.full(columns, attenuation[0, 0])
    pieces, work, pixel, node = row_pieces(columns, step), _work_for(columns, grid), _places(columns), _places(columns)
    few_scattered, few_light = values_of_row(columns), values_of_row(columns)
    # Where every pixel is chosen, what is found for the chosen ones is every pixel's.
    scattered = few_scattered if step == 1 else values_of_row(columns)
    light = few_light if step == 1 else values_of_row(columns)
    _column_places(np.uint64(columns), pieces.pixel, columns, grid, pixel)
    for v in range(top, bottom):
        # The sky returns no light.
        lit = cut_lengths(distance[v], np.float32(ENDLESS), length) and surfaces
        if clear and not lit:
            continue
        n = choose_pixels(length, pieces)
        chosen = pieces.length
        if step > 1:
            _column_places(n, pieces.pixel, columns, grid, pixel)
        _node_places(n, chosen, grid, node)
        place = np.float32(v) * np.float32(grid_rows - 1) / np.float32(max(distance.shape[0] - 1, 1))
        upper = min(int(place), grid_rows - 2)
        share = place - np.float32(upper)
        if not clear:
            _read_profiles(n, veil[upper], veil[upper + 1], share, grid, pixel, node, work, few_scattered)
            if step > 1:
                spread_over_row(few_scattered, pieces, scattered)
        if not lit:
            _add_veil(lamps.colour, scattered, out[v])
            continue
        if not uniform:
            _read_profiles(n, attenuation[upper], attenuation[upper + 1], share, grid, pixel, node, work, mean)
        row_points(n, ray_map, v, pieces.pixel, chosen, points)
        _light_surfaces(n, points, chosen, mean, lamps, work, few_light)
        if step > 1:
            spread_over_row(few_light, pieces, light)
        _add_lamplight(lamps.colour, scattered, light, response[v], out[v])


def _add_to_band(
    seen: tuple[_Floats, _Floats, _Floats, int, LampGroup, VeilGrid], out: _Floats, _: int, top: int, bottom: int
) -> None:
    add_own_light(*seen, top, bottom, out)


_MIRROR = np.diag((1.0, -1.0, 1.0))
"""Tables of beams count to the right, the vehicle's axes to the left."""

_REMEMBERED = 16

_HIGHEST = 50.0
"""Height above the camera up to which own lamps light the fog [m]."""


@dataclass(frozen=True, slots=True)
class _Group:
    """Lamps of one colour, ready for drawing."""

    light: LampGroup
    air: LitAir


class OwnLamplight:
    """Draws the light of the lamps of the camera's own vehicle."""

    def __init__(self, droplets: Droplets = Droplets.MODERATE_RADIATION) -> None:
        self._droplets, self._bands = Droplets(droplets), Bands()
        self._veils: dict[tuple[int, float], tuple[_Group, NDArray[np.float32]]] = {}

    def prepare(self, camera: Camera, lamps: tuple[HeadLamp, ...]) -> None:
        """Compute beforehand what depends on camera, lamps and droplets alone."""
        self._groups(camera, lamps)

    def add(
        self,
        luminance: NDArray[np.float32],
        view: View,
        camera: Camera,
        pose: CameraPose,
        fog: FogField,
        lamps: tuple[HeadLamp, ...],
    ) -> None:
        """Add the lamps' light on surfaces, R E e^(−τ), and their veil to an image.

        Takes `luminance` (rows, cols, 3) [cd/m²].
        """
        rows, columns = view.distance.shape
        response = np.zeros((0, columns, 3), np.float32) if view.lamp_response is None else view.lamp_response
        rays, ray_map = _rays(camera)
        mean, local = _extinction_on(rays, camera, pose, fog)
        distance = np.ascontiguousarray(view.distance, dtype=np.float32)
        returned = np.ascontiguousarray(response, dtype=np.float32).reshape(len(response), 3 * columns)
        out, step = luminance.reshape(rows, 3 * columns), piece_length(camera.focal_length)
        even = mean.size == 1
        for group in self._groups(camera, lamps):
            grid = VeilGrid(
                columns=rays.shape[1],
                nodes=np.uint32(INTERVALS + 1),
                fold=np.float32(FOLD_DISTANCE),
                ray_step=1 if even else INTERVALS + 1,
                node_step=rays.shape[1] if even else 1,
                veil=self._veil(group, rays.shape, mean, local).reshape(-1, rays.shape[1] * (INTERVALS + 1)),
                attenuation=mean if even else mean.reshape(rays.shape[0], -1),
            )
            add = partial(_add_to_band, (distance, returned, ray_map, step, group.light, grid), out)
            self._bands.work(add, rows, columns)

    def _groups(self, camera: Camera, lamps: tuple[HeadLamp, ...]) -> list[_Group]:
        colours = dict.fromkeys(lamp.colour for lamp in lamps)
        of_colour = [tuple(lamp for lamp in lamps if lamp.colour == colour) for colour in colours]
        return [_group(camera, together, self._droplets) for together in of_colour]

    def _veil(
        self, group: _Group, shape: tuple[int, int], mean: NDArray[np.float32], local: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """The veil on rays of a shape: ray by ray, but node by node in even fog, where it is remembered."""
        if mean.size > 1:
            return veil_along(group.air, local, mean)
        if mean[0, 0] == 0:
            return np.zeros((0, INTERVALS + 1), np.float32)
        key = (id(group), float(mean[0, 0]))
        # An identity may have passed from a group that was forgotten to another one.
        known = self._veils.get(key)
        if known is None or known[0] is not group:
            while len(self._veils) >= _REMEMBERED:
                del self._veils[next(iter(self._veils))]
            by_node = veil_along(group.air, local, mean).reshape(*shape, INTERVALS + 1).transpose(0, 2, 1)
            known = self._veils[key] = (group, np.ascontiguousarray(by_node))
        return known[1]


@lru_cache(_REMEMBERED)
def _rays(camera: Camera) -> tuple[VeilRays, NDArray[np.float32]]:
    """Rays of the veil, and the map from pixels to rays by (forward, right, up)."""
    ray_map = matrix_product(_MIRROR, ray_from_pixel(camera, OWN_FRAME))
    return veil_rays(camera), ray_map.astype(np.float32)


@lru_cache(_REMEMBERED)
def _group(camera: Camera, lamps: tuple[HeadLamp, ...], droplets: Droplets) -> _Group:
    """Lamps of one colour, by what is the same in every scene: the next one's renderer needs not compute it again."""
    places = list(dict.fromkeys(lamp.offset for lamp in lamps))
    # Lamps in one housing shine together.
    tables = [
        np.stack([lamp_table(lamp.beam) for lamp in lamps if lamp.offset == place]).sum(axis=0) for place in places
    ]
    return _Group(
        light=LampGroup(
            places=matrix_product(np.array(places, dtype=np.float32), _MIRROR.astype(np.float32)),
            tables=np.stack([table[..., 0].reshape(-1) for table in tables]),
            colour=np.array(lamps[0].colour, dtype=np.float32),
        ),
        air=lit_air(_rays(camera)[0], list(zip(places, tables, strict=True)), droplets),
    )


def _extinction_on(
    rays: VeilRays, camera: Camera, pose: CameraPose, fog: FogField
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Mean extinction coefficient to each node, and that in the interval before it; one number where fog is even."""
    if is_uniform_below(fog, pose.position[2] + _HIGHEST):
        everywhere = np.full((1, 1), fog.extinction, np.float32)
        return everywhere, everywhere
    distances = node_distances()
    to_world = matrix_product(camera_axes(camera, pose).T, camera_axes(camera, OWN_FRAME))
    shape = (len(rays.directions), len(distances))
    extinction, depth = np.empty(shape, np.float32), np.empty(shape, np.float32)
    directions = np.ascontiguousarray(matrix_product(rays.directions.astype(np.float64), to_world.T))
    grid_depths(np.array(pose.position), directions, distances, medium_of(fog), extinction, depth)
    local = np.empty((shape[0], shape[1] - 1), np.float32)
    average_extinctions(distances.astype(np.float32), depth, local, extinction)
    return extinction, local
