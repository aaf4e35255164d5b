"""Fog on a grid of the camera's view: rays at some pixels, nodes along each, and everything else between them.

Nodes are where the fog is uneven and still to be seen.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.koschmieder_kernels import (
    ENDLESS,
    add_airlight,
    fill_channels,
    interpolate_rows,
    repeat_channels,
    transmittances,
)
from fogsim.atmosphere.fog.medium import BASE, BASE_EDGE, DECAY, TOP, TOP_EDGE, Medium, medium_of
from fogsim.atmosphere.fog.optical_depth_kernels import extinctions_on_ray
from fogsim.core.jit import kernel
from fogsim.core.linear_algebra import matrix_product
from fogsim.values import Camera, CameraPose, FogField, View
from fogsim.values.pinhole import ray_from_pixel

_OPAQUE = 60.0
"""Optical depth beyond which nothing is distinguished [-]."""

_OUT_OF_FOG = 1e-9


@kernel
def _extinctions_on_rays(
    eye: NDArray[np.float64],
    directions: NDArray[np.float64],
    at: NDArray[np.float64],
    medium: Medium,
    values: NDArray[np.float64],
) -> None:
    """Extinction coefficients at distances along rays.

    Takes `eye` (3,) [m], `directions` (m, 3), `at` (n,) [m], `values` (m, n) [1/m].
    """
    for m in range(directions.shape[0]):
        extinctions_on_ray(eye, directions[m], at, medium, values[m])


@kernel
def _sharp_rise(height: float, edge: float, eye: float) -> float:
    """How far a sharp base or top is above the eye [m]; ``inf`` for one that is soft, or nowhere."""
    return math.inf if edge > 0.0 or math.isinf(height) else height - eye


@kernel
def _crossing(rise: float, slope: float) -> float:
    """Distance at which a ray of a slope has risen by so much [m]; ``inf`` where it never does."""
    return rise / slope if rise * slope > 0.0 else math.inf


@kernel
def _split_at_sharp_edges(
    eye: NDArray[np.float64],
    direction: NDArray[np.float64],
    crossing: float,
    other: float,
    distances: NDArray[np.float64],
    medium: Medium,
    pieces: NDArray[np.float64],
) -> float:
    """Put right the optical depth of the interval in which a ray crosses a sharp base or top, or both; its end [m]."""
    middles, values = np.empty(3), np.empty(3)
    n = np.searchsorted(distances, crossing)
    start, end = distances[n - 1], distances[n]
    beyond = min(other, end)
    middles[0], middles[1], middles[2] = 0.5 * (start + crossing), 0.5 * (crossing + beyond), 0.5 * (beyond + end)
    extinctions_on_ray(eye, direction, middles, medium, values)
    pieces[n] = values[0] * (crossing - start) + values[1] * (beyond - crossing) + values[2] * (end - beyond)
    return float(end)


@kernel
def grid_depths(
    eye: NDArray[np.float64],
    directions: NDArray[np.float64],
    distances: NDArray[np.float64],
    medium: Medium,
    extinction: NDArray[np.float32],
    depth: NDArray[np.float32],
) -> None:
    """Extinction and optical depth at the nodes of each ray, by Simpson's rule between nodes.

    Takes `eye` (3,) [m], `directions` (m, 3), `distances` (n,) [m], `extinction`, `depth` (m, n) [1/m].
    """
    last = distances.shape[0] - 1
    at, values, pieces = np.empty(2 * last - 1), np.empty(2 * last - 1), np.zeros(last + 1)
    widths = np.diff(distances)
    at[::2], at[1::2] = distances[:last], 0.5 * (distances[: last - 1] + distances[1:last])
    layer, top, decay = medium.layer, medium.layer[TOP], medium.layer[DECAY]
    rises = _sharp_rise(layer[BASE], layer[BASE_EDGE], eye[2]), _sharp_rise(layer[TOP], layer[TOP_EDGE], eye[2])
    for m in range(directions.shape[0]):
        extinctions_on_ray(eye, directions[m], at, medium, values)
        for n in range(last - 1):
            mean = (values[2 * n] + 4.0 * values[2 * n + 1] + values[2 * n + 2]) / 6.0
            pieces[n + 1] = mean * widths[n]
        one, other = _crossing(rises[0], directions[m, 2]), _crossing(rises[1], directions[m, 2])
        near, far = min(one, other), max(one, other)
        if near < distances[last - 1]:
            end = _split_at_sharp_edges(eye, directions[m], near, far, distances, medium, pieces)
            if end < far < distances[last - 1]:
                _split_at_sharp_edges(eye, directions[m], far, math.inf, distances, medium, pieces)
        rise = max(directions[m, 2], _OUT_OF_FOG)
        rest = max(top - eye[2] - distances[last - 1] * directions[m, 2], 0.0) / rise
        if decay > 0.0:
            rest = min(rest, 1.0 / (decay * rise))
        pieces[last] = values[2 * last - 2] * min(rest, ENDLESS)
        # One thing in each loop, that those without sums become vector instructions.
        for n in range(last):
            extinction[m, n] = values[2 * n]
        extinction[m, last] = values[2 * last - 2]
        total = 0.0
        for n in range(last + 1):
            total += pieces[n]
            pieces[n] = total
        for n in range(last + 1):
            depth[m, n] = min(pieces[n], _OPAQUE)
        pieces[0] = 0.0


class PixelGrid(NamedTuple):
    """What lies on a grid's rays, and where the pixels of an image are between them."""

    rows: NDArray[np.float32]  # (grid rows,): Image rows of the grid [px]
    left: NDArray[np.int64]  # (cols,) int64: Number of the grid's column before each of the image's
    right_share: NDArray[np.float32]  # (cols,): How far each column of the image is on to the next of the grid's, 0 … 1
    distances: NDArray[np.float32]  # (nodes,): Distances of the nodes along every ray [m]
    # (bins + 1,) int64: The node before a distance d, for d / (d + fold) in even steps over 0 … 1
    interval: NDArray[np.int64]
    fold: np.float32  # See `interval` [m]
    depth: NDArray[np.float32]  # (grid rows, grid cols · nodes): Optical depth from the eye to the nodes [-]
    # (grid rows, grid cols · nodes · 3): Luminance scattered in up to the nodes beyond the airlight [cd/m²]; of no
    # columns where there is none
    source: NDArray[np.float32]


@kernel
def _fog_rows_by_grid(
    luminance: NDArray[np.float32],
    distance: NDArray[np.float32],
    grid: PixelGrid,
    airlight: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """Fog every pixel of an image by what lies on the grid's rays.

    L = L0 T + L∞ (1 − T) + S, τ and S interpolated linearly between four rays and two nodes.

    Takes `luminance`, `out` (rows, cols · 3) [cd/m²], `distance` (rows, cols) [m], `airlight` (3,) [cd/m²].
    """
    rows, left, right_share, distances = grid.rows, grid.left, grid.right_share, grid.distances
    interval, fold, depth, source = grid.interval, grid.fold, grid.depth, grid.source
    columns, nodes, bins = distance.shape[1], distances.shape[0], interval.shape[0]
    above, scattered = np.empty(depth.shape[1], np.float32), np.empty(source.shape[1], np.float32)
    row_depth, transmittance = np.empty(columns, np.float32), np.empty(columns, np.float32)
    power = np.empty(columns, np.int32)
    in_channels, light = np.empty(3 * columns, np.float32), np.empty(3 * columns, np.float32)
    node, share = np.empty(columns, np.int64), np.empty(columns, np.float32)
    reach, place = np.empty(columns, np.float32), np.empty(columns, np.int32)
    per_metre = np.empty(nodes - 1, np.float32)
    for n in range(nodes - 1):
        per_metre[n] = np.float32(1.0) / (distances[n + 1] - distances[n])
    fill_channels(airlight, light)
    upper = 0
    for v in range(distance.shape[0]):
        while upper < rows.shape[0] - 2 and rows[upper + 1] <= v:
            upper += 1
        down = (np.float32(v) - rows[upper]) / (rows[upper + 1] - rows[upper])
        interpolate_rows(depth[upper], depth[upper + 1], down, above)
        for u in range(columns):
            reach[u] = max(np.float32(0.0), min(np.float32(ENDLESS), distance[v, u]))
            place[u] = np.int32(reach[u] / (reach[u] + fold) * np.float32(bins))
        for u in range(columns):
            n = interval[place[u]]
            f = min((reach[u] - distances[n]) * per_metre[n], np.float32(1.0))
            a = left[u] * nodes + n
            b = a + nodes
            near = above[a] + (above[b] - above[a]) * right_share[u]
            far = above[a + 1] + (above[b + 1] - above[a + 1]) * right_share[u]
            row_depth[u] = max(near + (far - near) * f, np.float32(0.0))
            node[u], share[u] = n, f
        transmittances(row_depth, power, transmittance)
        repeat_channels(transmittance, in_channels)
        add_airlight(luminance[v], in_channels, light, out[v])
        if source.shape[1] > 0:
            interpolate_rows(source[upper], source[upper + 1], down, scattered)
            _add_source(scattered, left, right_share, node, share, nodes, out[v])


@kernel
def _add_source(
    scattered: NDArray[np.float32],
    left: NDArray[np.int64],
    right_share: NDArray[np.float32],
    node: NDArray[np.int64],
    share: NDArray[np.float32],
    nodes: int,
    out: NDArray[np.float32],
) -> None:
    """Add what is scattered into each pixel of a row."""
    for u in range(node.shape[0]):
        a = 3 * (left[u] * nodes + node[u])
        b = a + 3 * nodes
        for c in range(3):
            near = scattered[a + c] + (scattered[b + c] - scattered[a + c]) * right_share[u]
            far = scattered[a + 3 + c] + (scattered[b + 3 + c] - scattered[a + 3 + c]) * right_share[u]
            out[3 * u + c] += near + (far - near) * share[u]


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
_SEEN = 16.0
"""Optical depth behind which not even lamps are seen (`fogsim.atmosphere.lamps.halos.FARTHEST`) [-]."""
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
    _extinctions_on_rays(eye, probes, _PROBES, medium, k)
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
    _fog_rows_by_grid(
        radiance.reshape(rows, 3 * columns),
        np.ascontiguousarray(view.distance, dtype=np.float32),
        pixels,
        np.array(airlight, dtype=np.float32),
        out.reshape(rows, 3 * columns),
    )
    return out
