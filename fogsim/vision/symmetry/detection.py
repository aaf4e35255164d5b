"""Signs in a picture: discs, octagons, squares and triangles, found by the symmetry of their outlines."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.vision.symmetry.edge_kernels import (
    Picture,
    clearest_gradients,
    edge_points,
    pair_votes,
    peaks,
    shrunk,
    triangle_votes,
)
from fogsim.vision.symmetry.outline_kernels import OUTLINES, SAMPLES, edge_density, fitted

Floats = NDArray[np.float32]

_USUAL = 7.0
"""Radius to which larger signs are shrunk, so that each costs the same [px]."""

SMALLER, LARGER = 0.65, 1.3
"""Radii of a sign in the picture over that which the map says [-]."""

_EVEN = 0.5
"""Share of pixels whose gradient is taken for noise [-]."""

_LEAST_NOISE = 0.08
"""Standard deviation of the gradient of a picture without noise: rounding to whole grey levels [grey levels/px]."""

_LEAST_GRADIENT = 4.0
"""Gradient of an edge over its noise [-]."""

_LEAST_SHARE, _UNWARNED_SHARE = 0.66, 0.85
"""Share of its outline that a sign must show where the map has one, and anywhere else [-]."""

_SURPRISE, _UNWARNED_SURPRISE = 9.0, 14.0
"""Negative logarithm of the probability that edges which lie at random bear an outline out as well [-]; in one of the
tiles of a whole picture, for any of them."""

_FITTING = 1.5
"""Area about a place on an outline in which an edge fits, times the share of directions that do [px]."""

_INDEPENDENT = 2.5
"""Distance along an outline from which edges are independent [px]."""

_CANDIDATES = 6
"""Middles that are looked at in each region by the votes of opposite sides."""

_TRIANGLES = (0.74, 0.81, 0.88)
"""Sizes for which triangles' sides vote for their middles, over the largest that is looked for [-]."""

_APART = 0.8
"""Least distance between the middles of two signs, over the sum of their radii [-]."""

_TILE = 96
"""Side of the tiles in which a whole picture is searched, in pixels of the shrunk picture."""


@dataclass(frozen=True, slots=True)
class SearchRegion:
    """Where a sign is looked for."""

    # u, v: column and row of its middle [px]
    u: float
    v: float
    # half_width, half_height: how far from there the middle of the sign may be [px]
    half_width: float
    half_height: float
    radius: float  # Half of the diameter that the sign should have [px]


@dataclass(frozen=True, slots=True)
class SignDetection:
    """What looks like a sign."""

    # u, v: column and row of the middle of its face [px]
    u: float
    v: float
    radius: float  # Half of its diameter [px]
    strength: float  # Share of its outline that stands out of the picture's noise, 0 … 1 [-]


def detect_signs(
    image: Picture,
    regions: Iterable[SearchRegion] | None = None,
    *,
    least_strength: float | None = None,
    radii: tuple[float, float] = (4.0, 32.0),
) -> tuple[SignDetection, ...]:
    """Find signs by the symmetry of their outlines.

    Pairs of edge points with opposite gradients vote for the point between them, as in the Bilateral Chinese Transform
    (Belaroussi and Tarel 2009), whose weights we could not find: those here are our own. Own additions: the gradient is
    that of the colour that shows it clearest; two sides of a triangle, which have no such symmetry, vote for its
    middle; where votes are many, outlines of signs are fitted to the edges, and how much of an outline is seen decides:
    so much must be, and no chance among as many edges may bear it out (a contrario: Desolneux, Moisan and Morel 2000).
    Edges count from four times the gradient's noise, which is that of the region itself: signs faint in fog are found
    where the picture is as even.

    Returns the surest first; of those in the same place one. Takes `image` (rows, cols), `radii` [px].
    """
    # numba would compile all again for an array that cannot be written.
    pixels: NDArray[Any] = np.require(image if image.ndim == 3 else image[:, :, None], requirements=["C", "W"])
    if regions is None:
        searches = list(_tiles(pixels.shape[:2], radii))
        # So many tiles give chance as many occasions.
        surprise, share = _UNWARNED_SURPRISE + math.log(len(searches)), _UNWARNED_SHARE
    else:
        searches = [(region, SMALLER, LARGER) for region in regions]
        surprise, share = _SURPRISE, _LEAST_SHARE
    share = share if least_strength is None else least_strength
    found: list[_Found] = []
    for region, smaller, larger in searches:
        found += _search(pixels, region, region.radius * smaller, region.radius * larger, share)
    return _distinct([one for one in found if one[0] >= surprise])


_Found = tuple[float, SignDetection]
"""How surprising it is, and a detection."""


def _tiles(size: tuple[int, ...], radii: tuple[float, float]) -> Iterable[tuple[SearchRegion, float, float]]:
    """Tile the picture once for each octave of radii."""
    octaves = max(math.ceil(math.log2(radii[1] / radii[0])), 1)
    ratio = (radii[1] / radii[0]) ** (0.5 / octaves)
    for octave in range(octaves):
        radius = radii[0] * ratio ** (2 * octave + 1)
        half = 0.5 * _TILE * _factor(radius)
        for v in np.arange(half, size[0] + half, 2 * half):
            for u in np.arange(half, size[1] + half, 2 * half):
                yield SearchRegion(float(u), float(v), half, half, radius), 1.0 / ratio, ratio


def _factor(radius: float) -> int:
    return max(round(radius / _USUAL), 1)


def _search(pixels: Picture, region: SearchRegion, smallest: float, largest: float, least: float) -> list[_Found]:
    """Detections within one region."""
    factor = _factor(region.radius)
    margin = 1.5 * largest + 4 * factor
    top = max(int(region.v - region.half_height - margin), 0)
    left = max(int(region.u - region.half_width - margin), 0)
    bottom = min(int(region.v + region.half_height + margin) + 1, pixels.shape[0])
    right = min(int(region.u + region.half_width + margin) + 1, pixels.shape[1])
    if bottom - top < 9 * factor or right - left < 9 * factor:
        return []
    piece = shrunk(pixels, top, left, (bottom - top) // factor, (right - left) // factor, factor)
    shift = 0.5 * (factor - 1)
    # Places in the shrunk piece: its pixels are means over squares of the picture's.
    u, v = (region.u - left - shift) / factor, (region.v - top - shift) / factor
    wide, high = region.half_width / factor, region.half_height / factor
    box = (u - wide, u + wide, v - high, v + high)
    return [
        (surprise, SignDetection(left + shift + factor * x, top + shift + factor * y, factor * radius, share))
        for surprise, x, y, radius, share in _in_piece(piece, box, smallest / factor, largest / factor)
        if share >= least and abs(x - u) <= wide + 1.0 and abs(y - v) <= high + 1.0
    ]


def _in_piece(
    piece: Floats, box: tuple[float, float, float, float], smallest: float, largest: float
) -> Iterable[tuple[float, float, float, float, float]]:
    """Outlines (surprise, x, y, radius, share seen) for which there is evidence in a piece of a picture."""
    points, number = edge_points(*clearest_gradients(piece, _EVEN, _LEAST_NOISE), _LEAST_GRADIENT)
    if len(points) < SAMPLES // 4:
        return
    apart = max(round(0.4 * smallest), 1)
    votes = [(pair_votes(points, number, 1.35 * smallest, 2.3 * largest), _EVEN_SIDED, _CANDIDATES)]
    sizes = (largest * np.array(_TRIANGLES)).astype(np.float32)
    for outlines, direction in ((_TIP_UP, 1.0), (_TIP_DOWN, -1.0)):
        votes += [(accumulated, outlines, 1) for accumulated in triangle_votes(points, number, sizes, direction)]
    radii = np.geomspace(smallest, largest, 8).astype(np.float32)
    for accumulated, outlines, most in votes:
        for candidate in peaks(accumulated, box, apart, 4.0, most):
            x, y, radius, share, _ = fitted(points, number, outlines, candidate[:2].copy(), radii).tolist()
            if share > 0.0:
                yield _surprise(share, radius, edge_density(number, x, y, 2.2 * radius)), x, y, radius, share


_EVEN_SIDED, _TIP_UP, _TIP_DOWN = OUTLINES[:3].copy(), OUTLINES[3:4].copy(), OUTLINES[4:].copy()


def _surprise(share: float, radius: float, density: float) -> float:
    """Negative logarithm of the chance that so much of an outline is borne out, by its Chernoff bound [-]."""
    chance = min(max(_FITTING * density, 0.01), 0.9)
    if share <= chance:
        return 0.0
    gain = share * math.log(share / chance)
    if share < 1.0:
        gain += (1.0 - share) * math.log((1.0 - share) / (1.0 - chance))
    return min(2.0 * math.pi * radius / _INDEPENDENT, SAMPLES) * gain


def _distinct(found: Sequence[_Found]) -> tuple[SignDetection, ...]:
    """Most surprising of the detections in each place."""
    kept: list[SignDetection] = []
    for _, one in sorted(found, key=lambda each: (-each[0], each[1].u, each[1].v)):
        if all(math.dist((one.u, one.v), (other.u, other.v)) > _APART * (one.radius + other.radius) for other in kept):
            kept.append(one)
    return tuple(kept)
