"""Optical depth on the rays of a frustum grid, and its way to the pixels between them."""

import math
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
from fogsim.atmosphere.fog.medium import BASE, BASE_EDGE, DECAY, TOP, TOP_EDGE, Medium
from fogsim.atmosphere.fog.optical_depth_kernels import extinctions_on_ray
from fogsim.core.jit import kernel

_OPAQUE = 60.0
"""Optical depth beyond which nothing is distinguished [-]."""

_OUT_OF_FOG = 1e-9


@kernel
def extinctions_on_rays(
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
def _split_at_sharp_edge(
    eye: NDArray[np.float64],
    direction: NDArray[np.float64],
    crossing: float,
    distances: NDArray[np.float64],
    medium: Medium,
    pieces: NDArray[np.float64],
) -> None:
    """Put right the optical depth of the interval in which a ray crosses a sharp base or top."""
    halves, values = np.empty(2), np.empty(2)
    n = np.searchsorted(distances, crossing)
    halves[0], halves[1] = 0.5 * (distances[n - 1] + crossing), 0.5 * (crossing + distances[n])
    extinctions_on_ray(eye, direction, halves, medium, values)
    pieces[n] = values[0] * (crossing - distances[n - 1]) + values[1] * (distances[n] - crossing)


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
        for sharp in rises:
            crossing = _crossing(sharp, directions[m, 2])
            if crossing < distances[last - 1]:
                _split_at_sharp_edge(eye, directions[m], crossing, distances, medium, pieces)
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
def fog_rows_by_grid(
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
