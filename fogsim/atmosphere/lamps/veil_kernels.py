"""Fog lit by own lamps, along rays: how much light meets each place, and how much of it comes back to the eye."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.koschmieder_kernels import transmittances
from fogsim.atmosphere.lamps.lamp_tables import BLURS, FIRST_BLUR, FOLD, PHASE_SIZE, SIZE
from fogsim.core.jit import kernel

PIECES = 4
"""Pieces of a ray between two of its nodes."""

_LAMP_SIZE = 0.08
"""Radius of a lamp's face [m]: seen from near, its beam is blurred by as much."""

HIDDEN = 0.4
"""Distance from a lamp within which its light in the air is damped [m]: there a car's bonnet hides it from the eye."""

_LAST_CELL = SIZE - 1.001
_LAST_BLUR = BLURS - 1.001
_HALF = 0.5 * (SIZE - 1)


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
def _intensity(table: NDArray[np.float32], forward: float, right: float, up: float, blur: float) -> float:
    """Intensity toward a place ahead of a lamp, blurred by an angle [cd]."""
    column = min(_LAST_CELL, (right / (FOLD * forward + abs(right)) + 1.0) * _HALF)
    row = min(_LAST_CELL, (up / (FOLD * forward + abs(up)) + 1.0) * _HALF)
    level = max(0.0, blur / FIRST_BLUR)
    if level > 1.0:
        level = min(_LAST_BLUR, 1.0 + math.log2(level))
    i, j, n = int(row), int(column), int(level)
    down, aside, between = row - i, column - j, level - n
    total = 0.0
    for m in range(2):
        low = table[n + m, i, j] + (table[n + m, i, j + 1] - table[n + m, i, j]) * aside
        high = table[n + m, i + 1, j] + (table[n + m, i + 1, j + 1] - table[n + m, i + 1, j]) * aside
        total += (between if m else 1.0 - between) * (low + (high - low) * down)
    return total


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
    directions, at, length = rays.directions, rays.at, rays.length
    phase, spread_phase, spread = phases.straight, phases.spread, phases.width
    straight, turned, path = air.straight, air.turned, air.path
    for m in range(directions.shape[0]):
        ux, uy, uz = directions[m, 0], directions[m, 1], directions[m, 2]
        for n in range(at.shape[0]):
            forward = at[n] * ux - offset[0]
            if not forward > 0.0:
                continue
            left, up = at[n] * uy - offset[1], at[n] * uz - offset[2]
            square = forward * forward + left * left + up * up
            s = math.sqrt(square)
            cosine = -(forward * ux + left * uy + up * uz) / s
            place = min(PHASE_SIZE - 1.001, math.sqrt(max(0.0, 0.5 + 0.5 * cosine)) * (PHASE_SIZE - 1))
            i = int(place)
            share = place - i
            # Seen from near, a lamp is a disc: its beam is blurred by the disc's angle.
            near = _LAMP_SIZE / s
            falling = length[n] / (square + HIDDEN * HIDDEN)
            once = (phase[i] + (phase[i + 1] - phase[i]) * share) * _intensity(table, forward, -left, up, near)
            wide = math.sqrt(near * near + spread * spread)
            again = (spread_phase[i] + (spread_phase[i + 1] - spread_phase[i]) * share) * _intensity(
                table, forward, -left, up, wide
            )
            straight[m, n] += once * falling
            turned[m, n] += again * falling
            path[m, n] += (once + again) * falling * s


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
            for n in range(PIECES):
                depth[PIECES * i + n] = k * path[m, PIECES * i + n]
        transmittances(depth, power, kept)
        for n in range(pieces):
            straight_kept = kept[n] * kept[n]
            kept[n] = straight[m, n] * straight_kept + turned[m, n] * (kept[n] - straight_kept)
        for i in range(intervals):
            n = PIECES * i
            light[i] = ((kept[n] + kept[n + 1]) + kept[n + 2]) + kept[n + 3]
        total = np.float32(0.0)
        veil[m, 0] = total
        for i in range(intervals):
            total += extinction[ray, 0 if uniform_way else i] * light[i]
            veil[m, i + 1] = total
