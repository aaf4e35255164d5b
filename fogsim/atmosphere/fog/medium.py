"""A fog field at one time, as the arrays that compiled kernels read."""

import dataclasses
import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.values import FogBank, FogChange, FogField, FogShelter

FARTHEST = 1e5
"""What is farther is the sky [m]."""

_BELOW = 1.0
"""How far below its road a portal reaches [m]: what is drawn may lie a little lower."""

_Array = NDArray[np.float64]
_Picture = NDArray[np.float32]


@kernel
def ray(rays: _Array, u: int, v: int) -> tuple[float, float, float]:
    """Unit vector along a pixel's viewing ray (`rays` (3, 3), `u`, `v` [px])."""
    a = rays[0, 0] * u + rays[0, 1] * v + rays[0, 2]
    b = rays[1, 0] * u + rays[1, 1] * v + rays[1, 2]
    c = rays[2, 0] * u + rays[2, 1] * v + rays[2, 2]
    length = math.sqrt(a * a + b * b + c * c)
    return a / length, b / length, c / length


@kernel
def find_pixels_within(
    distance: _Picture, rays: _Array, eye: _Array, portals: _Array, within: NDArray[np.bool_]
) -> None:
    """Find the pixels whose rays pass through a tunnel's portal before they end.

    Takes `distance`, `rays`, `eye` [m], `portals` (n, 7) [m], `within` (rows, cols) bool.
    """
    for number in range(len(portals)):
        x, y, z = portals[number, 0] - eye[0], portals[number, 1] - eye[1], portals[number, 2] - eye[2]
        east, north, half_width, height = portals[number, 3:]
        ahead, aside = x * east + y * north, y * east - x * north
        for v in range(distance.shape[0]):
            for u in range(distance.shape[1]):
                a = rays[0, 0] * u + rays[0, 1] * v + rays[0, 2]
                b = rays[1, 0] * u + rays[1, 1] * v + rays[1, 2]
                c = rays[2, 0] * u + rays[2, 1] * v + rays[2, 2]
                reach = ahead / (a * east + b * north)
                is_through = reach > 0.0 and abs(reach * (b * east - a * north) - aside) < half_width
                is_before = reach * reach * (a * a + b * b + c * c) < distance[v, u] * distance[v, u]
                if is_through and is_before and -_BELOW < reach * c - z < height:
                    within[v, u] = True


EXTINCTION, BASE, BASE_EDGE, TOP, TOP_EDGE, GROUND, DECAY = range(7)
"""Places of the numbers in `Medium.layer`."""

_LEAST_REACH = 0.5
"""Fog does not end at a portal more sharply than over this [m]."""

_BESIDE_SHELTER, _SHELTER_SIDE = 30.0, 20.0
"""How far from a tunnel's walls there is no fog either, and over how much more it comes back [m]: no one sees it from
within, but rays to the walls are compared with neighbours that would pass through them."""

_TURN = 0.5
"""Angle between the patches' grid and the world's axes [rad], so that no road meets the same patches over and over."""

PATCH_CELLS = 5
"""Cells of the patches' grid in one correlation length: between them, linear interpolation loses little."""

_PATCH_SHAPE = (32, 128, 128)
"""Cells (z, y, x) of that grid before the pattern repeats: 25 correlation lengths horizontally, 6 vertically."""


class Medium(NamedTuple):
    """A field without time."""

    # (7,): Extinction outside the banks [1/m], height of base, thickness of its edge, height of top, thickness of its
    # edge, ground [m] and 1 / scale height [1/m]
    layer: NDArray[np.float64]
    banks: NDArray[np.float64]  # (n, 8): Origin (x, y), axis (x, y), start, end, edge [m], extra extinction [1/m]
    # (6,): From places to cells of the patches: cells per metre horizontally and vertically, cosine and sine of the
    # grid's turn, drift (x, y) [m]
    frame: NDArray[np.float64]
    # (z, y, x): Factors of the patches on their periodic grid; one cell where there are none
    factors: NDArray[np.float32]
    # (n, 9): Origin (x, y), axis (x, y), where fog is half gone beyond the first portal and before the last, the length
    # of these edges, where it is half back to the sides, and the length of those edges [m]
    shelters: NDArray[np.float64]


def field_at(field: FogField, time: float) -> FogField:
    """The field at a time, which no longer changes.

    Parameters
    ----------
    field : FogField
        The field.
    time : float
        Time since the run began [s].

    Returns
    -------
    FogField
        With banks and patches drifted, and density, base and top of the time; the same object if nothing changes.
    """
    if not field.changes and field.wind == (0.0, 0.0):
        return field
    density, base, top = _layer_at(field, time)
    drift = (field.wind[0] * time, field.wind[1] * time)
    patches = field.patches
    if patches is not None:
        offset = (patches.offset[0] + drift[0], patches.offset[1] + drift[1])
        patches = dataclasses.replace(patches, offset=offset)
    return dataclasses.replace(
        field,
        extinction=field.extinction * density,
        banks=tuple(_moved(bank, drift, density) for bank in field.banks),
        base=base,
        top=top,
        patches=patches,
        wind=(0.0, 0.0),
        changes=(),
    )


_SHORTEST_CHANGE = 1e-3
"""Time that a change of the fog at once takes [s]."""


def with_change(field: FogField, time: float, density: float, duration: float) -> FogField:
    """A fog that from a time on changes to another density, evenly, and stays there; its heights stay as they are then.

    Parameters
    ----------
    field : FogField
        The fog over time.
    time : float
        When the change begins [s]; what was to come later does not.
    density : float
        Factor of the extinction coefficient to come to [-].
    duration : float
        Time that it takes [s].
    """
    now, base, top = _layer_at(field, time)
    begun, done = FogChange(time, now, base, top), FogChange(time + max(duration, _SHORTEST_CHANGE), density, base, top)
    earlier = tuple(change for change in field.changes if change.time < time)
    return dataclasses.replace(field, changes=(*earlier, begun, done))


def _layer_at(field: FogField, time: float) -> tuple[float, float, float]:
    """Density, base and top at a time."""
    if not field.changes:
        return 1.0, field.base, field.top
    times = [change.time for change in field.changes]

    def now(values: list[float]) -> float:
        # An endless height is the same at all times, and has no way to be interpolated.
        return values[0] if math.isinf(values[0]) else float(np.interp(time, times, values))

    return (
        now([change.density for change in field.changes]),
        now([change.base for change in field.changes]),
        now([change.top for change in field.changes]),
    )


def _moved(bank: FogBank, drift: tuple[float, float], density: float) -> FogBank:
    return dataclasses.replace(
        bank,
        origin=(bank.origin[0] + drift[0], bank.origin[1] + drift[1]),
        extra_extinction=bank.extra_extinction * density,
    )


@lru_cache(maxsize=4)
def patch_factors(strength: float, seed: int) -> NDArray[np.float32]:
    """Log-normal factors with mean 1 over a periodic grid.

    Their logarithm is white noise through a Gaussian filter, so that it is Gaussian with the correlation
    e^(−(Δ/`PATCH_CELLS`)²) over Δ cells.

    Returns positive factors over (z, y, x); read-only.
    """
    white = np.random.default_rng(seed).standard_normal(_PATCH_SHAPE, dtype=np.float32)
    squares = [np.square(2.0 * np.pi * np.fft.fftfreq(n)) for n in _PATCH_SHAPE[:2]]
    squares.append(np.square(2.0 * np.pi * np.fft.rfftfreq(_PATCH_SHAPE[2])))
    wave_number_squared = squares[0][:, None, None] + squares[1][:, None] + squares[2]
    # The spectrum of e^(−(Δ/c)²) is e^(−(c κ/2)²); the filter of amplitudes is its root.
    amplitude = np.exp(-wave_number_squared * PATCH_CELLS**2 / 8.0)
    smooth = np.fft.irfftn(np.fft.rfftn(white) * amplitude, s=_PATCH_SHAPE, axes=(0, 1, 2))
    factors = np.exp(strength * (smooth - smooth.mean()) / smooth.std())
    factors = np.ascontiguousarray(factors / factors.mean(), dtype=np.float32)
    factors.setflags(write=False)
    return factors


@lru_cache(maxsize=8)
def medium_of(field: FogField) -> Medium:
    """Arrays of a field that does not change with time (see `field_at`)."""
    frame, factors = np.zeros(6), np.ones((1, 1, 1), dtype=np.float32)
    patches = field.patches
    if patches is not None and patches.strength > 0:
        cosine, sine = math.cos(_TURN), math.sin(_TURN)
        cells = (PATCH_CELLS / patches.correlation_length, PATCH_CELLS / patches.correlation_height)
        frame = np.array((*cells, cosine, sine, *patches.offset))
        factors = patch_factors(patches.strength, patches.seed)
    heights = (field.base, field.base_edge, field.top, field.top_edge, field.ground)
    layer = np.array((field.extinction, *heights, 1.0 / field.scale_height))
    banks = [(*b.origin, *b.axis, b.start, b.end, b.edge, b.extra_extinction) for b in field.banks]
    shelters = [_shelter_row(shelter) for shelter in field.shelters]
    return Medium(
        layer,
        np.array(banks, dtype=np.float64).reshape(-1, 8),
        frame,
        factors,
        np.array(shelters, dtype=np.float64).reshape(-1, 9),
    )


def _shelter_row(shelter: FogShelter) -> tuple[float, ...]:
    """A slab across the straight line between a tunnel's portals, wide enough for its bends."""
    (x, y, _), (end_x, end_y, _) = shelter.line[0], shelter.line[-1]
    length = math.hypot(end_x - x, end_y - y)
    east, north = (end_x - x) / length, (end_y - y) / length
    bend = max(abs((py - y) * east - (px - x) * north) for px, py, _ in shelter.line)
    reach = min(max(shelter.reach, _LEAST_REACH), 0.5 * length)
    aside = bend + shelter.half_width + _BESIDE_SHELTER + 0.5 * _SHELTER_SIDE
    return x, y, east, north, 0.5 * reach, length - 0.5 * reach, reach, aside, _SHELTER_SIDE


def has_closed_form(field: FogField) -> bool:
    """Whether only banks and a sharp top make a field uneven, so that τ has a closed form."""
    return (
        not field.shelters
        and (field.patches is None or field.patches.strength == 0)
        and math.isinf(field.scale_height)
        and math.isinf(field.base)
        and field.top_edge == 0
        and field.airlight_shading == 0
    )


def is_uniform_below(field: FogField, height: float) -> bool:
    """Whether fog is the same everywhere below a height (`height` [m])."""
    return has_closed_form(field) and not field.banks and height <= field.top
