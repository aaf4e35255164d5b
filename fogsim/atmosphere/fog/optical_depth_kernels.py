"""Extinction at a place and optical depth along a line: the one integral that everything in the fog goes by.

The extinction is a product of cubics (soft edges of banks, of the layer and of tunnels), an exponential (scale height)
and the patches' factor. Between the places where a line crosses an edge the cubics are plain polynomials, of degree 6
at most together, which Gauss's rule with four points integrates exactly, as it does the exponential over two scale
heights to 3·10⁻⁷ and the patches over two cells of theirs to a thousandth. At portals within a bank's edge the degree
is 9.
"""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.medium import BASE, BASE_EDGE, DECAY, EXTINCTION, GROUND, TOP, TOP_EDGE, Medium
from fogsim.core.jit import kernel

MOST_PIECES = 400
"""A line is cut into no more pieces than this between two edges: very long lines see no single patch."""

_FADED = 20.0
"""Scale heights above which nothing is left of ground fog."""

_BESIDE_EDGE = 1e-3
"""So far from an edge of a bank or layer all or nothing of it is there, however numbers are rounded [m]."""

_LEAST_RATE = 1e-12
"""A line that comes nearer to an edge more slowly than this goes along it [-]."""

_CELLS_IN_PIECE = 2.0
_NODES = np.array((0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970263))
_WEIGHTS = np.array((0.17392742256872692, 0.32607257743127307, 0.32607257743127307, 0.17392742256872692))


@kernel
def _smoothstep(value: float, middle: float, edge: float) -> float:
    """Smoothstep from 0 to 1 over an edge; a plain step where the edge has no length."""
    if edge <= 0.0:
        return 1.0 if value > middle else 0.0
    t = min(max((value - middle) / edge + 0.5, 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)


@kernel
def _patch_factor(across: float, along: float, up: float, factors: NDArray[np.float32]) -> float:
    """Trilinear interpolation on the periodic grid, whose sizes are powers of two; places are in cells."""
    i, j, k = math.floor(across), math.floor(along), math.floor(up)
    a, b, c = np.float32(across - i), np.float32(along - j), np.float32(up - k)
    most_i, most_j, most_k = factors.shape[2] - 1, factors.shape[1] - 1, factors.shape[0] - 1
    i0, j0, k0 = int(i) & most_i, int(j) & most_j, int(k) & most_k
    i1, j1, k1 = (i0 + 1) & most_i, (j0 + 1) & most_j, (k0 + 1) & most_k
    south, north = factors[k0, j0, i0], factors[k0, j1, i0]
    high_south, high_north = factors[k1, j0, i0], factors[k1, j1, i0]
    south += (factors[k0, j0, i1] - south) * a
    north += (factors[k0, j1, i1] - north) * a
    high_south += (factors[k1, j0, i1] - high_south) * a
    high_north += (factors[k1, j1, i1] - high_north) * a
    low = south + (north - south) * b
    high = high_south + (high_north - high_south) * b
    return float(low + (high - low) * c)


@kernel
def _height_profile(z: float, base: float, base_edge: float, top: float, top_edge: float) -> float:
    """Share of the extinction that is left at a height between base and top, 0 … 1."""
    return _smoothstep(z, base, base_edge) - _smoothstep(z, top, top_edge)


@kernel
def _is_within_layer(height: float, other: float, layer: NDArray[np.float64]) -> bool:
    """Whether all of the extinction is left between two heights."""
    is_above_base = min(height, other) > layer[BASE] + 0.5 * layer[BASE_EDGE] + _BESIDE_EDGE
    is_below_top = max(height, other) < layer[TOP] - 0.5 * layer[TOP_EDGE] - _BESIDE_EDGE
    return bool(is_above_base and is_below_top)


@kernel
def _leave_out_shelters(
    x: float,
    y: float,
    dx: float,
    dy: float,
    at: NDArray[np.float64],
    shelters: NDArray[np.float64],
    values: NDArray[np.float64],
) -> None:
    """Take from values at distances along a ray what is not there in tunnels."""
    for b in range(shelters.shape[0]):
        shelter = shelters[b]
        station = (x - shelter[0]) * shelter[2] + (y - shelter[1]) * shelter[3]
        aside = (y - shelter[1]) * shelter[2] - (x - shelter[0]) * shelter[3]
        rate, aside_rate = dx * shelter[2] + dy * shelter[3], dy * shelter[2] - dx * shelter[3]
        for i in range(at.shape[0]):
            here, beside = station + rate * at[i], abs(aside + aside_rate * at[i])
            inside = _smoothstep(here, shelter[4], shelter[6]) - _smoothstep(here, shelter[5], shelter[6])
            values[i] *= 1.0 - inside * (1.0 - _smoothstep(beside, shelter[7], shelter[8]))


@kernel
def extinctions_on_ray(
    start: NDArray[np.float64],
    towards: NDArray[np.float64],
    at: NDArray[np.float64],
    medium: Medium,
    values: NDArray[np.float64],
) -> None:
    """Extinction coefficient at distances along a ray.

    Takes `start` (3,) [m], `towards` (3,), `at` (n,) [m], `values` (n,) [1/m].
    """
    layer, banks = medium.layer, medium.banks
    x, y, z = start[0], start[1], start[2]
    dx, dy, dz = towards[0], towards[1], towards[2]
    values[:] = layer[EXTINCTION]
    # Here, while the rest has functions of its own: handing arrays over for every ray takes as long as most banks do.
    for b in range(banks.shape[0]):
        here = (x - banks[b, 0]) * banks[b, 2] + (y - banks[b, 1]) * banks[b, 3]
        rate = dx * banks[b, 2] + dy * banks[b, 3]
        first, last, edge, extra = banks[b, 4], banks[b, 5], banks[b, 6], banks[b, 7]
        beside, one, other = 0.5 * edge + _BESIDE_EDGE, here + rate * at[0], here + rate * at[at.shape[0] - 1]
        low, high = min(one, other), max(one, other)
        if high < min(first, last) - beside or low > max(first, last) + beside:
            continue
        if first + beside < low and high < last - beside:
            for i in range(at.shape[0]):
                values[i] += extra
            continue
        for i in range(at.shape[0]):
            station = here + rate * at[i]
            values[i] += extra * (_smoothstep(station, first, edge) - _smoothstep(station, last, edge))
    # Clearings may cross beyond a bend.
    for i in range(at.shape[0]):
        values[i] = max(values[i], 0.0)
    if layer[DECAY] > 0.0 or not _is_within_layer(z + dz * at[0], z + dz * at[at.shape[0] - 1], layer):
        _thin_with_height(z, dz, at, layer, values)
    if medium.shelters.shape[0] > 0:
        _leave_out_shelters(x, y, dx, dy, at, medium.shelters, values)
    if medium.factors.size > 1:
        _make_patchy(start, towards, at, medium, values)


@kernel
def _thin_with_height(
    z: float, dz: float, at: NDArray[np.float64], layer: NDArray[np.float64], values: NDArray[np.float64]
) -> None:
    """Leave of values along a ray, which begins at a height [m] and rises by so much a metre, what is left there."""
    base, base_edge, top, top_edge = layer[BASE], layer[BASE_EDGE], layer[TOP], layer[TOP_EDGE]
    ground, decay = layer[GROUND], layer[DECAY]
    for i in range(at.shape[0]):
        values[i] *= _height_profile(z + dz * at[i], base, base_edge, top, top_edge)
    if decay > 0.0:
        for i in range(at.shape[0]):
            values[i] *= math.exp(-max(z + dz * at[i] - ground, 0.0) * decay)


@kernel
def _make_patchy(
    start: NDArray[np.float64],
    towards: NDArray[np.float64],
    at: NDArray[np.float64],
    medium: Medium,
    values: NDArray[np.float64],
) -> None:
    """Multiply values at distances along a ray by the factors of the patches there."""
    frame, factors = medium.frame, medium.factors
    x, y, z = start[0], start[1], start[2]
    dx, dy, dz = towards[0], towards[1], towards[2]
    level, upright, cosine, sine = frame[0], frame[1], frame[2], frame[3]
    across = ((x - frame[4]) * cosine + (y - frame[5]) * sine) * level
    along = ((y - frame[5]) * cosine - (x - frame[4]) * sine) * level
    across_rate, along_rate = (dx * cosine + dy * sine) * level, (dy * cosine - dx * sine) * level
    for i in range(at.shape[0]):
        values[i] *= _patch_factor(
            across + across_rate * at[i], along + along_rate * at[i], (z + dz * at[i]) * upright, factors
        )


@kernel
def _mark(cuts: NDArray[np.float64], count: int, here: float, rate: float, value: float, length: float) -> int:
    """Insert the distance at which a coordinate takes a value, in order; returns the new count."""
    if abs(rate) < _LEAST_RATE or math.isinf(value):
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
def _portals_crossed(
    start: NDArray[np.float64],
    towards: NDArray[np.float64],
    length: float,
    shelters: NDArray[np.float64],
    cuts: NDArray[np.float64],
    count: int,
) -> int:
    """Insert the distances at which a line crosses edges of shelters; returns the new count."""
    for shelter in shelters:
        x, y = start[0] - shelter[0], start[1] - shelter[1]
        along, along_rate = x * shelter[2] + y * shelter[3], towards[0] * shelter[2] + towards[1] * shelter[3]
        across, across_rate = y * shelter[2] - x * shelter[3], towards[1] * shelter[2] - towards[0] * shelter[3]
        for side in (-0.5, 0.5):
            for middle in (shelter[4], shelter[5]):
                count = _mark(cuts, count, along, along_rate, middle + side * shelter[6], length)
            for hand in (-1.0, 1.0):
                count = _mark(cuts, count, across, across_rate, hand * (shelter[7] + side * shelter[8]), length)
    return count


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
        count = _mark(cuts, count, start[2], towards[2], layer[GROUND] + _FADED / layer[DECAY], length)
    for bank in medium.banks:
        here = (start[0] - bank[0]) * bank[2] + (start[1] - bank[1]) * bank[3]
        rate = towards[0] * bank[2] + towards[1] * bank[3]
        for middle in (bank[4], bank[5]):
            for side in (-0.5, 0.5):
                count = _mark(cuts, count, here, rate, middle + side * bank[6], length)
    return _portals_crossed(start, towards, length, medium.shelters, cuts, count)


@kernel
def _pieces_per_metre(towards: NDArray[np.float64], medium: Medium) -> float:
    """Pieces in a metre into which a line must be cut between edges, for scale height and patches [1/m]."""
    pieces: float = 0.5 * abs(towards[2]) * medium.layer[DECAY]
    if medium.factors.size > 1:
        level = math.sqrt(towards[0] * towards[0] + towards[1] * towards[1])
        pieces = max(pieces, max(level * medium.frame[0], abs(towards[2]) * medium.frame[1]) / _CELLS_IN_PIECE)
    return pieces


@kernel
def _is_banks_alone(height: float, other: float, medium: Medium) -> bool:
    """Whether nothing but banks makes the fog uneven between two heights [m]."""
    is_even = medium.layer[DECAY] == 0.0 and medium.factors.size == 1 and len(medium.shelters) == 0
    return bool(is_even and _is_within_layer(height, other, medium.layer))


@kernel
def _banks_depth(
    x: float, y: float, dx: float, dy: float, near: float, far: float, outside: float, banks: NDArray[np.float64]
) -> float:
    """`_piece_depth` where there are banks alone, digit for digit: numbers are handled faster than arrays."""
    step = far - near
    at = (near + _NODES[0] * step, near + _NODES[1] * step, near + _NODES[2] * step, near + _NODES[3] * step)
    first_k = second_k = third_k = fourth_k = outside
    for b in range(banks.shape[0]):
        here = (x - banks[b, 0]) * banks[b, 2] + (y - banks[b, 1]) * banks[b, 3]
        rate = dx * banks[b, 2] + dy * banks[b, 3]
        first, last, edge, extra = banks[b, 4], banks[b, 5], banks[b, 6], banks[b, 7]
        first_k += extra * _within(here + rate * at[0], first, last, edge)
        second_k += extra * _within(here + rate * at[1], first, last, edge)
        third_k += extra * _within(here + rate * at[2], first, last, edge)
        fourth_k += extra * _within(here + rate * at[3], first, last, edge)
    depth: float = _WEIGHTS[0] * max(first_k, 0.0)
    depth += _WEIGHTS[1] * max(second_k, 0.0)
    depth += _WEIGHTS[2] * max(third_k, 0.0)
    depth += _WEIGHTS[3] * max(fourth_k, 0.0)
    depth *= step
    return depth


@kernel
def _depth_through_banks(
    x: float, y: float, dx: float, dy: float, length: float, outside: float, banks: NDArray[np.float64]
) -> float:
    """Optical depth of a line that begins at (x, y) [m] and goes (dx, dy) a metre, where there are banks alone [-]."""
    total, here = 0.0, 0.0
    # Seldom does a line cross an edge; where it does, the next one is looked for, so that none need be kept.
    while True:
        there = length
        for b in range(banks.shape[0]):
            station = (x - banks[b, 0]) * banks[b, 2] + (y - banks[b, 1]) * banks[b, 3]
            rate = dx * banks[b, 2] + dy * banks[b, 3]
            if abs(rate) < _LEAST_RATE:
                continue
            for end in (banks[b, 4], banks[b, 5]):
                for side in (-0.5, 0.5):
                    at = (end + side * banks[b, 6] - station) / rate
                    if here < at < there:
                        there = at
        total += _banks_depth(x, y, dx, dy, here, there, outside, banks)
        if there == length:
            return total
        here = there


@kernel
def _within(station: float, first: float, last: float, edge: float) -> float:
    """How much of a bank there is at a place along its axis, 0 … 1."""
    beside = 0.5 * edge + _BESIDE_EDGE
    if first + beside < station < last - beside:
        return 1.0
    if station < first - beside or station > last + beside:
        return 0.0
    return _smoothstep(station, first, edge) - _smoothstep(station, last, edge)


@kernel
def _piece_depth(
    start: NDArray[np.float64],
    towards: NDArray[np.float64],
    near: float,
    far: float,
    pieces: float,
    medium: Medium,
    scratch: NDArray[np.float64],
) -> float:
    """Optical depth of the part of a line between two edges [-]; `scratch` is (2, 4 MOST_PIECES)."""
    count = int(min(max(math.ceil((far - near) * pieces), 1.0), MOST_PIECES))
    step = (far - near) / count
    at, values = scratch[0, : 4 * count], scratch[1, : 4 * count]
    for piece in range(count):
        for n in range(4):
            at[4 * piece + n] = near + (piece + _NODES[n]) * step
    extinctions_on_ray(start, towards, at, medium, values)
    depth = 0.0
    for piece in range(count):
        for n in range(4):
            depth += _WEIGHTS[n] * values[4 * piece + n]
    return depth * step


@kernel
def depths_along(
    start: NDArray[np.float64],
    towards: NDArray[np.float64],
    distances: NDArray[np.float64],
    medium: Medium,
    depths: NDArray[np.float64],
    scratch: NDArray[np.float64],
    enough: float,
) -> int:
    """Optical depth from a point to places along one direction.

    Returns how many places have been looked at. Takes `start` (3,) [m], `towards` (3,), `distances` (n,) [m], `depths`
    (n,).
    """
    cuts = np.empty(8 + 4 * medium.banks.shape[0] + 8 * medium.shelters.shape[0])
    total, here, next_cut = 0.0, 0.0, 0
    count = _edges_crossed(start, towards, distances[-1], medium, cuts)
    pieces, outside, banks = _pieces_per_metre(towards, medium), medium.layer[EXTINCTION], medium.banks
    is_banks_alone = _is_banks_alone(start[2], start[2] + towards[2] * distances[-1], medium)
    i = 0
    while i < len(distances):
        is_cut = next_cut < count and cuts[next_cut] < distances[i]
        there = cuts[next_cut] if is_cut else distances[i]
        if is_banks_alone:
            total += _banks_depth(start[0], start[1], towards[0], towards[1], here, there, outside, banks)
        else:
            total += _piece_depth(start, towards, here, there, pieces, medium, scratch)
        here = there
        if is_cut:
            next_cut += 1
            continue
        depths[i] = total
        i += 1
        if total >= enough:
            break
    return i


@kernel
def depths_between(
    starts: NDArray[np.float64],
    ends: NDArray[np.float64],
    medium: Medium,
    depths: NDArray[np.float64],
    scratch: NDArray[np.float64],
) -> None:
    """Optical depth of each of many straight lines (`starts`, `ends` (n, 3) [m])."""
    distance, towards = np.empty(1), np.empty(3)
    for i in range(starts.shape[0]):
        towards[:] = ends[i] - starts[i]
        length = math.sqrt(towards[0] ** 2 + towards[1] ** 2 + towards[2] ** 2)
        depths[i] = 0.0
        if length > 0.0 and _is_banks_alone(starts[i, 2], ends[i, 2], medium):
            x, y, dx, dy = starts[i, 0], starts[i, 1], towards[0] / length, towards[1] / length
            depths[i] = _depth_through_banks(x, y, dx, dy, length, medium.layer[EXTINCTION], medium.banks)
        elif length > 0.0:
            distance[0] = length
            towards /= length
            depths_along(starts[i], towards, distance, medium, depths[i : i + 1], scratch, math.inf)


@kernel
def extinctions(points: NDArray[np.float64], medium: Medium, values: NDArray[np.float64]) -> None:
    """Extinction coefficient at each of many places (`points` (n, 3) [m], `values` (n,) [1/m])."""
    nowhere, here = np.zeros(3), np.zeros(1)
    for i in range(points.shape[0]):
        extinctions_on_ray(points[i], nowhere, here, medium, values[i : i + 1])
