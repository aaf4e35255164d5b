"""The veil: fog lit by the own head lamps, seen between the eye and everything else.

A place x on a line of sight is lit by each lamp and scatters light back to the eye,

    L(r) = ∫₀ʳ k Σ [ p I e^(−η₁ k d) + p̃ Ĩ (e^(−η₂ k d) − e^(−η₁ k d)) ] / s² dr,      d = s + r,

s being the way from lamp to x and r from x to the eye. With η₁ = 1 the first term is single scattering. But droplets
scatter most light by less than a few degrees: such light is not lost to the beam, so the beam fades by η₁ k only. What
is scattered a little farther goes on in a broadened beam Ĩ with a broadened phase function p̃, and fades by η₂ k. The
four numbers below were fitted to photons (`benchmarks/monte_carlo.py veil`); the docs have the deviations.
"""

import math
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.koschmieder_kernels import transmittances
from fogsim.atmosphere.lamps.lamp_tables import BLURS, FIRST_BLUR, FOLD, PHASE_SIZE, SIZE, phase_table
from fogsim.atmosphere.lamps.phase_function import Droplets, blurred, phase_function
from fogsim.core.jit import kernel
from fogsim.core.linear_algebra import matrix_product
from fogsim.values import Camera
from fogsim.values.pinhole import OWN_FRAME, camera_axes

_PIECES = 4
"""Pieces of a ray between two of its nodes."""

_LAMP_SIZE = 0.08
"""Radius of a lamp's face [m]: seen from near, its beam is blurred by as much."""

HIDDEN = 0.4
"""Distance from a lamp within which its light in the air is damped [m]: there a car's bonnet hides it from the eye."""

_LAST_CELL = SIZE - 1.001
_LAST_BLUR = BLURS - 1.001
_HALF = 0.5 * (SIZE - 1)
# Unsigned, because indices that may be negative cost a comparison each.
_NEXT, _TO_NEXT_COLUMN, _TO_NEXT_ROW = np.uint32(1), np.uint32(BLURS), np.uint32(SIZE * BLURS)


class VeilRays(NamedTuple):
    """Rays of a camera's view, in the vehicle's axes (forward, left, up)."""

    shape: tuple[int, int]  # Rows and columns of the grid, whose corners are the middles of the image's corner pixels
    directions: NDArray[np.float32]  # (n, 3): Unit vectors, row by row
    # at, length (pieces,): middles and lengths of the pieces of each ray [m]
    at: NDArray[np.float64]
    length: NDArray[np.float64]


class ScatteringPhase(NamedTuple):
    """Where light is scattered to, as it is and after it has been spread."""

    # straight, spread: tables of the phase functions of straight and of spread light [1/sr]
    straight: NDArray[np.float32]
    spread: NDArray[np.float32]
    width: float  # Standard deviation of the directions of spread light [rad]


class LitAir(NamedTuple):
    """What lamps would send to the eye from each piece of the rays, were the air clear on the way."""

    # straight, turned (rays, pieces): from the beam as it is and as scattering spreads it [cd/m² per extinction]
    straight: NDArray[np.float32]
    turned: NDArray[np.float32]
    # (rays, pieces): Way from lamp to piece to eye [m]; while lamps are added, that from lamp to piece weighted by its
    # light
    path: NDArray[np.float32]


@kernel
def _place_pieces(
    at: NDArray[np.float64],
    direction: NDArray[np.float32],
    offset: NDArray[np.float64],
    square: NDArray[np.float64],
    way: NDArray[np.float64],
    column: NDArray[np.float64],
    row: NDArray[np.float64],
    phase: NDArray[np.float64],
) -> None:
    """Ways from a lamp to the pieces of a ray [m], and where in its beam's table and in phase functions they are."""
    ux, uy, uz, ahead, aside, above = direction[0], direction[1], direction[2], offset[0], offset[1], offset[2]
    for n in range(at.shape[0]):
        forward, left, up = at[n] * ux - ahead, at[n] * uy - aside, at[n] * uz - above
        square[n] = forward * forward + left * left + up * up
        way[n] = math.sqrt(square[n])
        cosine = -(forward * ux + left * uy + up * uz) / way[n]
        phase[n] = min(PHASE_SIZE - 1.001, math.sqrt(max(0.0, 0.5 + 0.5 * cosine)) * (PHASE_SIZE - 1))
        column[n] = min(_LAST_CELL, (-left / (FOLD * forward + abs(left)) + 1.0) * _HALF)
        row[n] = min(_LAST_CELL, (up / (FOLD * forward + abs(up)) + 1.0) * _HALF)


@kernel
def _blur_levels(
    way: NDArray[np.float64], spread: float, straight: NDArray[np.float64], turned: NDArray[np.float64]
) -> None:
    """Tables in a stack from which beams are read: as they are, but blurred by the lamp's face, and spread."""
    for n in range(way.shape[0]):
        # Seen from near, a lamp is a disc: its beam is blurred by the disc's angle.
        near = _LAMP_SIZE / way[n]
        straight[n] = near / FIRST_BLUR
        turned[n] = math.sqrt(near * near + spread * spread) / FIRST_BLUR
    for levels in (straight, turned):
        for n in range(way.shape[0]):
            if levels[n] > 1.0:
                levels[n] = min(_LAST_BLUR, 1.0 + math.log2(levels[n]))


@kernel
def _read_beam(
    table: NDArray[np.float32],
    row: NDArray[np.float64],
    column: NDArray[np.float64],
    level: NDArray[np.float64],
    out: NDArray[np.float64],
) -> None:
    """Intensities from a flat stack of tables [cd]."""
    for n in range(row.shape[0]):
        i, j, m = np.uint32(row[n]), np.uint32(column[n]), np.uint32(level[n])
        down, aside, between = row[n] - np.float64(i), column[n] - np.float64(j), level[n] - np.float64(m)
        a = i * _TO_NEXT_ROW + j * _TO_NEXT_COLUMN + m
        b, c, d = a + _TO_NEXT_COLUMN, a + _TO_NEXT_ROW, a + _TO_NEXT_ROW + _TO_NEXT_COLUMN
        low = table[a] + (table[b] - table[a]) * aside
        high = table[c] + (table[d] - table[c]) * aside
        sharper = low + (high - low) * down
        low = table[a + _NEXT] + (table[b + _NEXT] - table[a + _NEXT]) * aside
        high = table[c + _NEXT] + (table[d + _NEXT] - table[c + _NEXT]) * aside
        out[n] = (1.0 - between) * sharper + between * (low + (high - low) * down)


@kernel
def _read_phase(table: NDArray[np.float32], place: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    """Multiply by a phase function."""
    for n in range(place.shape[0]):
        i = np.uint32(place[n])
        out[n] *= table[i] + (table[i + _NEXT] - table[i]) * (place[n] - np.float64(i))


@kernel
def _add(values: NDArray[np.float64], out: NDArray[np.float32]) -> None:
    for n in range(values.shape[0]):
        out[n] += values[n]


@kernel
def add_scattered_light(
    rays: VeilRays,
    offset: NDArray[np.float64],
    table: NDArray[np.float32],
    phases: ScatteringPhase,
    air: LitAir,
) -> None:
    """Add a lamp's light on pieces of rays that is scattered to the eye: Σ p(Θ) I / s² Δr [cd/m² per extinction].

    Takes `offset` (3,) [m].
    """
    stack, scratch = table.reshape(-1), np.empty((9, rays.at.shape[0]))
    for m in range(rays.directions.shape[0]):
        # Pieces before the lamp.
        begin, end, ahead = 0, rays.at.shape[0], rays.directions[m, 0]
        while begin < end and not rays.at[begin] * ahead - offset[0] > 0.0:
            begin += 1
        while begin < end and not rays.at[end - 1] * ahead - offset[0] > 0.0:
            end -= 1
        count, at, length = end - begin, rays.at[begin:end], rays.length[begin:end]
        square, way, column = scratch[0, :count], scratch[1, :count], scratch[2, :count]
        row, phase, level = scratch[3, :count], scratch[4, :count], scratch[5, :count]
        spread_level, once, again = scratch[6, :count], scratch[7, :count], scratch[8, :count]
        _place_pieces(at, rays.directions[m], offset, square, way, column, row, phase)
        _blur_levels(way, phases.width, level, spread_level)
        _read_beam(stack, row, column, level, once)
        _read_beam(stack, row, column, spread_level, again)
        _read_phase(phases.straight, phase, once)
        _read_phase(phases.spread, phase, again)
        # One thing in each loop, which become vector instructions.
        for n in range(count):
            square[n] = length[n] / (square[n] + HIDDEN * HIDDEN)
        for n in range(count):
            way[n] = (once[n] + again[n]) * square[n] * way[n]
        for n in range(count):
            once[n] *= square[n]
        for n in range(count):
            again[n] *= square[n]
        _add(once, air.straight[m, begin:end])
        _add(again, air.turned[m, begin:end])
        _add(way, air.path[m, begin:end])


@kernel
def average_extinctions(
    distances: NDArray[np.float32], depth: NDArray[np.float32], local: NDArray[np.float32], mean: NDArray[np.float32]
) -> None:
    """Mean extinction coefficients along rays.

    Takes `distances` (nodes,) [m], `depth` (m, nodes), `local` (m, nodes - 1) [1/m], `mean` (m, nodes) [1/m].
    """
    for m in range(depth.shape[0]):
        for n in range(distances.shape[0] - 1):
            local[m, n] = (depth[m, n + 1] - depth[m, n]) / (distances[n + 1] - distances[n])
        for n in range(1, distances.shape[0]):
            mean[m, n] = depth[m, n] / distances[n]


@kernel
def integrate_veil(
    air: LitAir,
    extinction: NDArray[np.float32],
    mean: NDArray[np.float32],
    loss: np.float32,
    veil: NDArray[np.float32],
) -> None:
    """Light that comes back to the eye from the ray up to each node.

    Takes `extinction`, `mean` (m or 1, intervals or 1) [1/m], `veil` (m, nodes) [cd/m²].
    """
    straight, turned, path = air.straight, air.turned, air.path
    pieces, intervals = path.shape[1], veil.shape[1] - 1
    depth, kept = np.empty(pieces, np.float32), np.empty(pieces, np.float32)
    power, light = np.empty(pieces, np.int32), np.empty(intervals, np.float32)
    uniform_rays, uniform_way = extinction.shape[0] == 1, extinction.shape[1] == 1
    # Four pieces at a time and one thing in each loop, which become vector instructions.
    for m in range(path.shape[0]):
        ray = 0 if uniform_rays else m
        for i in range(intervals):
            k = loss * mean[ray, 0 if uniform_way else i]
            for n in range(_PIECES):
                depth[_PIECES * i + n] = k * path[m, _PIECES * i + n]
        transmittances(depth, power, kept)
        for n in range(pieces):
            straight_kept = kept[n] * kept[n]
            kept[n] = straight[m, n] * straight_kept + turned[m, n] * (kept[n] - straight_kept)
        for i in range(intervals):
            n = _PIECES * i
            light[i] = ((kept[n] + kept[n + 1]) + kept[n + 2]) + kept[n + 3]
        total = np.float32(0.0)
        veil[m, 0] = total
        for i in range(intervals):
            total += extinction[ray, 0 if uniform_way else i] * light[i]
            veil[m, i + 1] = total


LOSS_OF_SPREAD_LIGHT = 0.3
"""η₂: part of the extinction that takes light out of the broadened beam [-]; η₁ is twice that."""

SPREAD = 0.22
"""Standard deviation of the directions of spread light [rad]."""

PHASE_SPREAD = 0.17
"""Width by which the phase function of spread light is blurred [rad]."""

FOLD_DISTANCE = 10.0
"""Nodes lie evenly over r / (r + FOLD_DISTANCE) [m]."""

INTERVALS = 32
CELLS = 64
"""Cells across the image between whose corners the veil is interpolated: below a cut-off it changes within a degree."""

_FARTHEST = 1e4


def node_distances() -> NDArray[np.float64]:
    """Distances of a ray's nodes [m]; the last stands for an endless ray."""
    folded = np.arange(INTERVALS + 1) / INTERVALS
    return np.minimum(FOLD_DISTANCE * folded / np.maximum(1.0 - folded, 1e-9), _FARTHEST)


def veil_rays(camera: Camera) -> VeilRays:
    """Rays on which a camera's veil is computed."""
    rows = max(2, math.ceil(CELLS * camera.height / camera.width)) + 1
    u0, v0 = camera.principal_point
    right = (np.linspace(0, camera.width - 1, CELLS + 1) - u0) / camera.focal_length
    down = (np.linspace(0, camera.height - 1, rows) - v0) / camera.focal_length
    plane = np.stack(np.broadcast_arrays(right, down[:, None], np.ones((1, 1))), axis=-1).reshape(-1, 3)
    rays = matrix_product(plane, camera_axes(camera, OWN_FRAME))
    at, length = ray_pieces()
    directions = rays / np.linalg.norm(rays, axis=1)[:, None]
    return VeilRays((rows, CELLS + 1), np.ascontiguousarray(directions, dtype=np.float32), at, length)


def ray_pieces() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Middles and lengths of the pieces into which a ray is cut [m]."""
    count = INTERVALS * _PIECES
    folded = (np.arange(count) + 0.5) / count
    return FOLD_DISTANCE * folded / (1.0 - folded), FOLD_DISTANCE / count / (1.0 - folded) ** 2


def lit_air(
    rays: VeilRays, lamps: list[tuple[tuple[float, float, float], NDArray[np.float32]]], droplets: Droplets
) -> LitAir:
    """Light of lamps on rays, by geometry and droplets alone (`lamps` (offset, table) [m])."""
    shape = (len(rays.directions), len(rays.at))
    straight, turned, path = (np.zeros(shape, np.float32) for _ in range(3))
    air = LitAir(straight, turned, path)
    for offset, table in lamps:
        add_scattered_light(rays, np.array(offset, dtype=np.float64), table, _scattering_phase(droplets), air)
    path /= np.maximum(straight + turned, np.float32(1e-30))
    path += rays.at.astype(np.float32)
    return air


@cache
def _scattering_phase(droplets: Droplets) -> ScatteringPhase:
    phase = phase_function(droplets)
    return ScatteringPhase(phase_table(phase), phase_table(blurred(phase, PHASE_SPREAD)), SPREAD)


def veil_along(air: LitAir, extinction: NDArray[np.float32], mean: NDArray[np.float32]) -> NDArray[np.float32]:
    """Veil between the eye and each node of the rays [cd/m²], (rays, nodes).

    Takes `extinction`, `mean` (rays, intervals) [1/m].
    """
    veil = np.empty((len(air.path), INTERVALS + 1), np.float32)
    integrate_veil(air, extinction, mean, np.float32(LOSS_OF_SPREAD_LIGHT), veil)
    return veil
