"""Fog on a grid of the camera's view: rays at some pixels, nodes along each, and everything else between them.

Nodes are where the fog is uneven and still to be seen.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.frustum_kernels import PixelGrid, extinctions_on_rays, fog_rows_by_grid, grid_depths
from fogsim.atmosphere.fog.koschmieder_kernels import ENDLESS
from fogsim.atmosphere.fog.medium import Medium, medium_of
from fogsim.core.linear_algebra import matrix_product
from fogsim.values import Camera, CameraPose, FogField, View
from fogsim.values.pinhole import ray_from_pixel

_COARSE = 16
"""Pixels between two rays of a large image; across a small one there are not fewer than 15, nor more than 30 rows."""

_FINER = 4
"""How much denser the rays are at the horizon, where layers of fog are seen edge-on."""

_WIDER = 1.6
"""How much farther apart the rays are across the image, where fog changes less than with height."""

_NODES = 32
"""Nodes along a ray, with the eye and the end of the ray."""

FARTHEST = 20_000.0
"""What is farther than this and not endless is taken to be here [m]."""

_PROBES = np.concatenate(([0.0], np.geomspace(0.5, 0.9 * FARTHEST, 128)))
_SEEN = 7.0
"""Optical depth behind which a thousandth of the contrast is left [-]."""
_FOG_LEFT = 1e-3
"""Optical depth ahead that matters no more [-]."""
_EVEN_SHARE = 0.3
"""Share of the nodes that is spread whatever the fog, evenly in the logarithm of the distance."""

_BINS = 2048
_FOLD = 100.0


@dataclass(frozen=True, slots=True)
class FrustumGrid:
    """What fog does on a grid of rays.

    Attributes
    ----------
    eye : (3,) float64
        Optical centre [m].
    rows : (r,) float32
        Image rows of the rays, ascending from the first to the last row or beyond [px].
    columns : (c,) float32
        Their image columns [px].
    directions : (r, c, 3) float64
        Unit vectors.
    distances : (n,) float64
        Distances of the nodes along every ray, from 0; the last stands for the end of the ray, wherever it is [m].
    extinction : (r, c, n) float32
        Extinction coefficient at the nodes [1/m].
    depth : (r, c, n) float32
        Optical depth from the eye to the nodes [-], not above 60.
    """

    eye: NDArray[np.float64]
    rows: NDArray[np.float32]
    columns: NDArray[np.float32]
    directions: NDArray[np.float64]
    distances: NDArray[np.float64]
    extinction: NDArray[np.float32]
    depth: NDArray[np.float32]


def frustum_grid(
    field: FogField, camera: Camera, pose: CameraPose, distances: NDArray[np.float64] | None = None
) -> FrustumGrid:
    """Optical depth on the rays of a grid.

    Parameters
    ----------
    field : FogField
        The fog, at one time (see `field_at`).
    camera : Camera
        The camera.
    pose : CameraPose
        Where it is.
    distances : (n,) float64 or None
        Where the nodes are, ascending from 0 [m]; the last stands for the end of a ray. None to put them where the fog
        is uneven and still to be seen.
    """
    eye, medium = np.array(pose.position, dtype=np.float64), medium_of(field)
    ray_map = ray_from_pixel(camera, pose)
    rows, columns = _grid_rows(camera, ray_map), _grid_columns(camera)
    directions = _directions(ray_map, rows, columns)
    if distances is None:
        # Rows are dense where the fog is seen edge-on, and so are the probes.
        probes = directions[:: max(1, len(rows) // 14), :: max(1, (len(columns) - 1) // 2)]
        distances = _node_distances(eye, probes, medium)
    shape = (len(rows), len(columns), len(distances))
    extinction, depth = np.empty(shape, np.float32), np.empty(shape, np.float32)
    flat = (shape[0] * shape[1], shape[2])
    grid_depths(eye, directions.reshape(-1, 3), distances, medium, extinction.reshape(flat), depth.reshape(flat))
    return FrustumGrid(eye, rows, columns, directions, distances, extinction, depth)


def _spacing(camera: Camera) -> float:
    """Pixels between rays far from the horizon."""
    return camera.height / min(max(camera.height / _COARSE, 15.0), 30.0)


def _grid_columns(camera: Camera) -> NDArray[np.float32]:
    count = max(2, round(camera.width / (_WIDER * _spacing(camera))) + 1)
    return np.linspace(0, camera.width - 1, count, dtype=np.float32)


def _grid_rows(camera: Camera, ray_map: NDArray[np.float64]) -> NDArray[np.float32]:
    """Rows of rays: dense from where the horizon enters the image to where it leaves it."""
    # The horizon is where the third component of the ray is 0, at the left and at the right edge.
    slope = ray_map[2, 1] if abs(ray_map[2, 1]) > 1e-12 else 1e-12
    crossings = [-(ray_map[2, 2] + ray_map[2, 0] * u) / slope for u in (0, camera.width - 1)]
    high, low = min(crossings), max(crossings)
    coarse = _spacing(camera)
    fine = coarse / _FINER
    rows = [0.0]
    while rows[-1] < camera.height - 1:
        off = max(high - rows[-1] - fine, rows[-1] - low, 0.0)
        rows.append(rows[-1] + min(max(0.25 * off, fine), coarse))
    return np.array(rows if len(rows) > 1 else [0.0, 1.0], dtype=np.float32)


def _directions(
    ray_map: NDArray[np.float64], rows: NDArray[np.float32], columns: NDArray[np.float32]
) -> NDArray[np.float64]:
    pixels = np.ones((len(rows), len(columns), 3))
    pixels[..., 0], pixels[..., 1] = columns, rows[:, None]
    rays = matrix_product(pixels, ray_map.T)
    return np.asarray(rays / np.sqrt(np.einsum("rci,rci->rc", rays, rays))[..., None])


def _node_distances(eye: NDArray[np.float64], directions: NDArray[np.float64], medium: Medium) -> NDArray[np.float64]:
    """Distances of nodes [m] such that linear interpolation of τ between them errs about equally everywhere.

    The error of the transmittance T in an interval Δ is T |dk/dr| Δ² / 8, so that nodes should be as dense as
    √(T |dk/dr|), taken as the largest over some probing rays, `directions`. They ascend from 0; the last two are
    `FARTHEST` and `ENDLESS`.
    """
    probes = np.ascontiguousarray(directions.reshape(-1, 3))
    k = np.empty((len(probes), len(_PROBES)))
    extinctions_on_rays(eye, probes, _PROBES, medium, k)
    step = np.diff(_PROBES)
    pieces = 0.5 * (k[:, 1:] + k[:, :-1]) * step
    depth = np.cumsum(pieces, axis=1)
    matters = (depth - pieces < _SEEN) & (depth[:, -1:] - depth + pieces > _FOG_LEFT)
    last = max(10, int(np.flatnonzero(matters.any(axis=0)).max(initial=0)) + 1)
    slope = np.abs(np.diff(k, axis=1)) / step * np.exp(-depth) * matters
    uneven = np.sqrt(slope.max(axis=0))[:last] * step[:last]
    even = step[:last] / (_PROBES[1 : last + 1] + 5.0)
    weight = _EVEN_SHARE * even / even.sum() + (1.0 - _EVEN_SHARE) * uneven / max(uneven.sum(), 1e-30)
    growth = np.concatenate(([0.0], np.cumsum(weight)))
    inner = np.interp(np.linspace(0.0, growth[-1], _NODES - 2), growth, _PROBES[: last + 1])
    return np.append(inner, (FARTHEST, ENDLESS))


def radiance_through_grid(
    view: View,
    grid: FrustumGrid,
    airlight: tuple[float, float, float],
    source: NDArray[np.float32] | None = None,
) -> NDArray[np.float32]:
    """Luminance at the camera, L = L0 T + L∞ (1 − T) + S, with τ and S taken from a grid to every pixel.

    Parameters
    ----------
    view : View
        The scene without air.
    grid : FrustumGrid
        Optical depths.
    airlight : tuple of float
        L∞ per channel [cd/m²].
    source : (r, c, n, 3) float32 or None
        What is scattered towards the eye between it and each node beyond the airlight [cd/m²].

    Returns
    -------
    (rows, cols, 3) float32
        Linear luminance per channel at the camera [cd/m²].
    """
    radiance = np.ascontiguousarray(view.radiance, dtype=np.float32)
    out = np.empty_like(radiance)
    rows, columns = view.distance.shape
    place = np.arange(columns, dtype=np.float32)
    left = np.clip(np.searchsorted(grid.columns, place, side="right") - 1, 0, len(grid.columns) - 2)
    width = grid.columns[left + 1] - grid.columns[left]
    middles = (np.arange(_BINS) + 0.5) / _BINS
    interval = np.searchsorted(grid.distances, _FOLD * middles / (1.0 - middles), side="right") - 1
    pixels = PixelGrid(
        rows=grid.rows,
        left=left,
        right_share=((place - grid.columns[left]) / width).astype(np.float32),
        distances=grid.distances.astype(np.float32),
        # Endless rays end in the last interval, at its far end.
        interval=np.append(np.clip(interval, 0, len(grid.distances) - 2), len(grid.distances) - 2),
        fold=np.float32(_FOLD),
        depth=grid.depth.reshape(len(grid.rows), -1),
        source=np.zeros((len(grid.rows), 0), np.float32) if source is None else source.reshape(len(grid.rows), -1),
    )
    fog_rows_by_grid(
        radiance.reshape(rows, 3 * columns),
        np.ascontiguousarray(view.distance, dtype=np.float32),
        pixels,
        np.array(airlight, dtype=np.float32),
        out.reshape(rows, 3 * columns),
    )
    return out
