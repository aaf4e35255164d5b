"""The per-pixel loops of Koschmieder's law, row by row so that they run on vector units.

A row's optical depths are gathered first, then turned into transmittances, then mixed with the airlight: each step is a
plain loop over float32 that compiles to vector instructions, which a call of the exponential function would prevent.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

ENDLESS = 1e7
"""Length that stands for an endless ray [m]."""

_LEVEL = np.float32(1e-12)
_LOG2_E = np.float32(math.log2(math.e))
_LEAST = np.float32(-100.0)
_ONE = np.float32(1.0)
# 2^f − 1 = f · P(f) on (−1, 0]: Remez-like weighted least squares, error 6·10⁻⁸; exact at 0, where clear air is.
_P0, _P1, _P2, _P3, _P4 = (np.float32(c) for c in (0.69314442, 0.24018671, 0.05531669, 0.00922838, 0.00095403))
_ALONG = np.float32(0.1)
_NEXT = np.uint32(1)
_FIRST, _SECOND, _THREE = np.uint64(1), np.uint64(2), np.uint64(3)


@kernel
def transmittances(depth: NDArray[np.float32], power: NDArray[np.int32], out: NDArray[np.float32]) -> None:
    """e^(−τ) for a row of optical depths, to 2·10⁻⁷; exactly 1 for 0 (`depth` (n,), `power` (n,) int32, `out` (n,))."""
    as_float = power.view(np.float32)
    for u in range(depth.shape[0]):
        y = max(-depth[u] * _LOG2_E, _LEAST)
        i = np.int32(y)
        f = y - np.float32(i)
        depth[u] = ((((_P4 * f + _P3) * f + _P2) * f + _P1) * f + _P0) * f + _ONE
        power[u] = (i + np.int32(127)) << np.int32(23)
    for u in range(depth.shape[0]):
        out[u] = depth[u] * as_float[u]


@kernel
def repeat_channels(values: NDArray[np.float32], out: NDArray[np.float32]) -> None:
    """Each value of a row for each of three interleaved channels (`values` (n,), `out` (3 · n,))."""
    for u in range(values.shape[0]):
        out[3 * u] = values[u]
        out[3 * u + 1] = values[u]
        out[3 * u + 2] = values[u]


@kernel
def fill_channels(colour: NDArray[np.float32], out: NDArray[np.float32]) -> None:
    """A colour in each of a row's pixels of three interleaved channels (`colour` (3,), `out` (3 · n,))."""
    for j in range(out.shape[0]):
        out[j] = colour[j % 3]


@kernel
def interpolate_rows(
    low: NDArray[np.float32], high: NDArray[np.float32], share: np.float32, out: NDArray[np.float32]
) -> None:
    """A row that lies between two rows of a coarser grid (`low`, `high`, `out` (n,))."""
    for j in range(out.shape[0]):
        out[j] = low[j] + (high[j] - low[j]) * share


@kernel
def bilinear(table: NDArray[np.float32], row: np.float32, column: np.float32) -> np.float32:
    """Value of a table at a place within it (`table` (rows, cols))."""
    a, b = np.uint32(row), np.uint32(column)
    down, aside = row - np.float32(a), column - np.float32(b)
    low = table[a, b] + (table[a, b + _NEXT] - table[a, b]) * aside
    high = table[a + _NEXT, b] + (table[a + _NEXT, b + _NEXT] - table[a + _NEXT, b]) * aside
    value: np.float32 = low + (high - low) * down
    return value


@kernel
def add_airlight(
    luminance: NDArray[np.float32],
    transmittance: NDArray[np.float32],
    airlight: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """L = L0 T + L∞ (1 − T) over a row: L0 exactly where T is 1.

    Takes `luminance`, `transmittance`, `airlight`, `out` (3 · n,) [cd/m²].
    """
    for j in range(out.shape[0]):
        out[j] = luminance[j] * transmittance[j] + airlight[j] * (_ONE - transmittance[j])


@kernel
def _mix_with_airlight(
    luminance: NDArray[np.float32],
    transmittance: NDArray[np.float32],
    airlight: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """As `add_airlight`, but of transmittances (n,) and of one airlight (3,)."""
    red, green, blue = airlight[0], airlight[1], airlight[2]
    for u in range(np.uint64(transmittance.shape[0])):
        kept, at = transmittance[u], _THREE * u
        lost = _ONE - kept
        out[at] = luminance[at] * kept + red * lost
        out[at + _FIRST] = luminance[at + _FIRST] * kept + green * lost
        out[at + _SECOND] = luminance[at + _SECOND] * kept + blue * lost


@kernel
def _smoothstep(station: np.float32, edge: np.float32) -> np.float32:
    t = min(max(station / edge + np.float32(0.5), np.float32(0.0)), _ONE)
    return t * t * (np.float32(3.0) - np.float32(2.0) * t)


@kernel
def _smoothstep_integral(station: np.float32, edge: np.float32) -> np.float32:
    t = min(max(station / edge + np.float32(0.5), np.float32(0.0)), _ONE)
    beyond = max(station - np.float32(0.5) * edge, np.float32(0.0))
    return edge * t * t * t * (_ONE - np.float32(0.5) * t) + beyond


@kernel
def _add_bank(
    bank: NDArray[np.float32], towards: NDArray[np.float32], length: NDArray[np.float32], depth: NDArray[np.float32]
) -> None:
    """Add a bank to a row's optical depths.

    `bank` holds how far the eye is beyond the bank's start and end, the edge [m] and the extra extinction [1/m];
    `towards` the change of the station with distance.
    """
    start, end, edge, extra = bank[0], bank[1], bank[2], bank[3]
    here = _smoothstep_integral(start, edge) - _smoothstep_integral(end, edge)
    for u in range(depth.shape[0]):
        span = towards[u] * length[u]
        difference = _smoothstep_integral(start + span, edge) - _smoothstep_integral(end + span, edge) - here
        # Across the axis the station hardly changes: there the profile half-way is the mean.
        half = np.float32(0.5) * span
        middle = _smoothstep(start + half, edge) - _smoothstep(end + half, edge)
        along = abs(span) > _ALONG
        share = difference / (span if along else _ONE)
        depth[u] += extra * length[u] * (share if along else middle)


class BankedFog(NamedTuple):
    """Fog whose optical depth has a closed form, as it lies about an eye."""

    headroom: np.float32  # Height of the fog's top above the eye [m]
    extinction: np.float32  # Extinction coefficient outside the banks [1/m]
    # (n, 6): Axis (x, y), how far the eye is beyond start and end, edge [m], extra extinction [1/m]
    banks: NDArray[np.float32]
    airlight: NDArray[np.float32]  # (3,): L∞ per channel [cd/m²]


@kernel
def fog_rows(
    luminance: NDArray[np.float32],
    distance: NDArray[np.float32],
    ray_map: NDArray[np.float32],
    fog: BankedFog,
    top: int,
    bottom: int,
    out: NDArray[np.float32],
) -> None:
    """Fog rows of an image, with τ exact through banks and up to a top.

    Takes `luminance`, `out` (rows, cols · 3) [cd/m²], `distance` (rows, cols) [m], `ray_map` (3, 3).
    """
    headroom, extinction, banks = fog.headroom, fog.extinction, fog.banks
    columns, has_top = distance.shape[1], headroom < np.float32(np.inf)
    length, towards = np.empty(columns, np.float32), np.empty(columns, np.float32)
    depth, transmittance = np.empty(columns, np.float32), np.empty(columns, np.float32)
    power = np.empty(columns, np.int32)
    right_x, right_y, right_z = ray_map[0, 0], ray_map[1, 0], ray_map[2, 0]
    for v in range(top, bottom):
        first_x = ray_map[0, 1] * np.float32(v) + ray_map[0, 2]
        first_y = ray_map[1, 1] * np.float32(v) + ray_map[1, 2]
        first_z = ray_map[2, 1] * np.float32(v) + ray_map[2, 2]
        # An endless path through fog shows nothing but airlight; through clear air, everything.
        for u in range(0 if has_top else columns):
            length[u] = min(distance[v, u], np.float32(ENDLESS))
            depth[u] = length[u] * extinction
        for u in range(columns if has_top else 0):
            x = first_x + right_x * np.float32(u)
            y = first_y + right_y * np.float32(u)
            z = first_z + right_z * np.float32(u)
            below_top = headroom * math.sqrt(x * x + y * y + z * z) / max(z, _LEVEL)
            length[u] = min(distance[v, u], np.float32(ENDLESS), below_top)
            depth[u] = length[u] * extinction
        for bank in banks:
            for u in range(columns):
                x = first_x + right_x * np.float32(u)
                y = first_y + right_y * np.float32(u)
                z = first_z + right_z * np.float32(u)
                towards[u] = (x * bank[0] + y * bank[1]) / math.sqrt(x * x + y * y + z * z)
            _add_bank(bank[2:], towards, length, depth)
        transmittances(depth, power, transmittance)
        _mix_with_airlight(luminance[v], transmittance, fog.airlight, out[v])
