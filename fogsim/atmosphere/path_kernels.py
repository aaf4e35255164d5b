"""Extinction at a place and optical depth along a line: the one integral that everything in the fog goes by.

The extinction is a product of cubics (soft edges of banks and of the layer), an exponential (scale height) and the
patches' factor. Between the places where a line crosses an edge the cubics are plain polynomials, of degree 6 at most
together, which Gauss's rule with four points integrates exactly, as it does the exponential over two scale heights to
3·10⁻⁷ and the patches over one correlation length to a few thousandths.
"""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.medium import BASE, BASE_EDGE, DECAY, EXTINCTION, GROUND, TOP, TOP_EDGE, Medium
from fogsim.jit import kernel

MOST_PIECES = 400
"""A line is cut into no more pieces than this between two edges: very long lines see no single patch."""

FADED = 20.0
"""Scale heights above which nothing is left of ground fog."""

_CELLS_IN_PIECE = 5.0
_NODES = (0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970263)
_WEIGHTS = (0.17392742256872692, 0.32607257743127307, 0.32607257743127307, 0.17392742256872692)


@kernel
def soft_step(value: float, middle: float, edge: float) -> float:
    """Smoothstep from 0 to 1 over an edge; a plain step where the edge has no length."""
    if edge <= 0.0:
        return 1.0 if value > middle else 0.0
    t = min(max((value - middle) / edge + 0.5, 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)


@kernel
def _patch_factor(x: float, y: float, z: float, frame: NDArray[np.float64], factors: NDArray[np.float32]) -> float:
    """Trilinear interpolation on the periodic grid, whose sizes are powers of two."""
    east, north = x - frame[4], y - frame[5]
    across = (east * frame[2] + north * frame[3]) * frame[0]
    along = (north * frame[2] - east * frame[3]) * frame[0]
    up = z * frame[1]
    i, j, k = math.floor(across), math.floor(along), math.floor(up)
    a, b, c = across - i, along - j, up - k
    most_i, most_j, most_k = factors.shape[2] - 1, factors.shape[1] - 1, factors.shape[0] - 1
    i0, j0, k0 = int(i) & most_i, int(j) & most_j, int(k) & most_k
    i1, j1, k1 = (i0 + 1) & most_i, (j0 + 1) & most_j, (k0 + 1) & most_k
    low: float = (factors[k0, j0, i0] * (1 - a) + factors[k0, j0, i1] * a) * (1 - b)
    low += (factors[k0, j1, i0] * (1 - a) + factors[k0, j1, i1] * a) * b
    high: float = (factors[k1, j0, i0] * (1 - a) + factors[k1, j0, i1] * a) * (1 - b)
    high += (factors[k1, j1, i0] * (1 - a) + factors[k1, j1, i1] * a) * b
    return float(low * (1 - c) + high * c)


@kernel
def height_profile(z: float, layer: NDArray[np.float64]) -> float:
    """Share of the extinction that is left at a height, 0 … 1."""
    share: float = soft_step(z, layer[BASE], layer[BASE_EDGE]) - soft_step(z, layer[TOP], layer[TOP_EDGE])
    if layer[DECAY] > 0.0 and z > layer[GROUND]:
        share *= math.exp(-(z - layer[GROUND]) * layer[DECAY])
    return share


@kernel
def extinction_at(x: float, y: float, z: float, medium: Medium) -> float:
    """Extinction coefficient at a place [1/m]."""
    k: float = medium.layer[EXTINCTION]
    for bank in medium.banks:
        station = (x - bank[0]) * bank[2] + (y - bank[1]) * bank[3]
        k += bank[7] * (soft_step(station, bank[4], bank[6]) - soft_step(station, bank[5], bank[6]))
    k *= height_profile(z, medium.layer)
    if medium.factors.size > 1 and k > 0.0:
        k *= _patch_factor(x, y, z, medium.frame, medium.factors)
    return k


@kernel
def _mark(cuts: NDArray[np.float64], count: int, here: float, rate: float, value: float, length: float) -> int:
    """Insert the distance at which a coordinate takes a value, in order; returns the new count."""
    if abs(rate) < 1e-12 or math.isinf(value):
        return count
    at = (value - here) / rate
    if not 0.0 < at < length:
        return count
    place = count
    while place > 0 and cuts[place - 1] > at:
        cuts[place] = cuts[place - 1]
        place -= 1
    cuts[place] = at
    return count + 1


@kernel
def _edges_crossed(
    start: NDArray[np.float64], towards: NDArray[np.float64], length: float, medium: Medium, cuts: NDArray[np.float64]
) -> int:
    """Distances at which a line crosses an edge, in order; returns how many."""
    layer, count = medium.layer, 0
    for middle, edge in ((BASE, BASE_EDGE), (TOP, TOP_EDGE)):
        for side in (-0.5, 0.5):
            count = _mark(cuts, count, start[2], towards[2], layer[middle] + side * layer[edge], length)
    if layer[DECAY] > 0.0:
        count = _mark(cuts, count, start[2], towards[2], layer[GROUND], length)
        count = _mark(cuts, count, start[2], towards[2], layer[GROUND] + FADED / layer[DECAY], length)
    for bank in medium.banks:
        here = (start[0] - bank[0]) * bank[2] + (start[1] - bank[1]) * bank[3]
        rate = towards[0] * bank[2] + towards[1] * bank[3]
        for middle in (bank[4], bank[5]):
            for side in (-0.5, 0.5):
                count = _mark(cuts, count, here, rate, middle + side * bank[6], length)
    return count


@kernel
def unevenness(towards: NDArray[np.float64], medium: Medium) -> float:
    """Pieces in a metre into which a line must be cut between edges, for scale height and patches [1/m]."""
    pieces: float = 0.5 * abs(towards[2]) * medium.layer[DECAY]
    if medium.factors.size > 1:
        level = math.sqrt(towards[0] * towards[0] + towards[1] * towards[1])
        pieces = max(pieces, max(level * medium.frame[0], abs(towards[2]) * medium.frame[1]) / _CELLS_IN_PIECE)
    return pieces


@kernel
def piece_depth(
    start: NDArray[np.float64],
    towards: NDArray[np.float64],
    near: float,
    far: float,
    pieces: float,
    medium: Medium,
) -> float:
    """Optical depth of the part of a line between two edges [-]."""
    z = start[2] + 0.5 * (near + far) * towards[2]
    if height_profile(z, medium.layer) < 1e-9:
        return 0.0
    count = int(min(max(math.ceil((far - near) * pieces), 1.0), MOST_PIECES))
    step, depth = (far - near) / count, 0.0
    for piece in range(count):
        for node, weight in zip(_NODES, _WEIGHTS):  # noqa: B905 - numba knows no strict
            at = near + (piece + node) * step
            depth += weight * extinction_at(
                start[0] + at * towards[0], start[1] + at * towards[1], start[2] + at * towards[2], medium
            )
    return depth * step


@kernel
def depths_along(
    start: NDArray[np.float64],
    towards: NDArray[np.float64],
    distances: NDArray[np.float64],
    medium: Medium,
    depths: NDArray[np.float64],
) -> None:
    """Optical depth from a point to places along one direction, at ascending distances [m]."""
    cuts = np.empty(8 + 4 * medium.banks.shape[0])
    total, here, next_cut = 0.0, 0.0, 0
    count = _edges_crossed(start, towards, distances[-1], medium, cuts)
    pieces = unevenness(towards, medium)
    for i in range(distances.shape[0]):
        while next_cut < count and cuts[next_cut] < distances[i]:
            total += piece_depth(start, towards, here, cuts[next_cut], pieces, medium)
            here = cuts[next_cut]
            next_cut += 1
        total += piece_depth(start, towards, here, distances[i], pieces, medium)
        here = distances[i]
        depths[i] = total


@kernel
def depths_between(
    starts: NDArray[np.float64], ends: NDArray[np.float64], medium: Medium, depths: NDArray[np.float64]
) -> None:
    """Optical depth of each of many straight lines, (n, 3) to (n, 3)."""
    distance = np.empty(1)
    for i in range(starts.shape[0]):
        towards = ends[i] - starts[i]
        distance[0] = math.sqrt(np.sum(towards * towards))
        depths[i] = 0.0
        if distance[0] > 0.0:
            depths_along(starts[i], towards / distance[0], distance, medium, depths[i : i + 1])


@kernel
def extinctions(points: NDArray[np.float64], medium: Medium, values: NDArray[np.float64]) -> None:
    """Extinction coefficient at each of many places (n, 3)."""
    for i in range(points.shape[0]):
        values[i] = extinction_at(points[i, 0], points[i, 1], points[i, 2], medium)
