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

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.lamps.lamp_tables import phase_table
from fogsim.atmosphere.lamps.phase_function import Droplets, blurred, phase_function
from fogsim.atmosphere.lamps.veil_kernels import (
    PIECES,
    LitAir,
    ScatteringPhase,
    VeilRays,
    add_scattered_light,
    integrate_veil,
)
from fogsim.core.linear_algebra import matrix_product
from fogsim.values import Camera, CameraPose
from fogsim.values.pinhole import camera_axes

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
    rays = matrix_product(plane, camera_axes(camera, CameraPose((0.0, 0.0, 0.0), 0.0)))
    at, length = ray_pieces()
    directions = rays / np.linalg.norm(rays, axis=1)[:, None]
    return VeilRays((rows, CELLS + 1), np.ascontiguousarray(directions, dtype=np.float32), at, length)


def ray_pieces() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Middles and lengths of the pieces into which a ray is cut [m]."""
    count = INTERVALS * PIECES
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
