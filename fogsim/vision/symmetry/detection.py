"""Signs in a picture: discs, octagons, squares and triangles, found by the symmetry of their outlines."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.vision.light.pixel_kernels import LinearPixels
from fogsim.vision.symmetry.edge_kernels import cut_luminance, edge_points, gradient_noise, gradients, shrunk
from fogsim.vision.symmetry.outline_kernels import fitted
from fogsim.vision.symmetry.outlines import OUTLINES
from fogsim.vision.symmetry.vote_kernels import pair_votes, peaks, triangle_votes

Floats = NDArray[np.float32]

USUAL = 8.0
"""Radius to which larger signs are shrunk, so that each costs the same [px]."""

SMALLER, LARGER = 0.75, 1.3
"""Radii of a sign in the picture over that which the map says [-]."""

EVEN = 0.4
"""Share of pixels whose gradient is taken for noise [-]."""

LEAST_NOISE = 0.08
"""Standard deviation of the gradient of a picture without noise: rounding to whole grey levels [grey levels/px]."""

LEAST_GRADIENT = 3.0
"""Gradient of an edge over its noise [-]."""

LEAST_SHARE = 0.7
"""Share of its outline that a sign must show [-]."""

CANDIDATES = 6
"""Middles that are looked at in each region by the votes of opposite sides."""

TILE = 96
"""Side of the tiles in which a whole picture is searched, in pixels of the shrunk picture."""


@dataclass(frozen=True, slots=True)
class SearchRegion:
    """Where a sign is looked for.

    Attributes
    ----------
    u, v : float
        Column and row of its middle [px].
    half_width, half_height : float
        How far from there the middle of the sign may be [px].
    radius : float
        Half of the diameter that the sign should have [px].
    """

    u: float
    v: float
    half_width: float
    half_height: float
    radius: float


@dataclass(frozen=True, slots=True)
class SignDetection:
    """What looks like a sign.

    Attributes
    ----------
    u, v : float
        Column and row of the middle of its face [px].
    radius : float
        Half of its diameter [px].
    strength : float
        Share of its outline that stands out of the picture's noise, 0 … 1 [-].
    """

    u: float
    v: float
    radius: float
    strength: float


def detect_signs(
    luminance: Floats | LinearPixels,
    regions: Iterable[SearchRegion] | None = None,
    *,
    least_strength: float = LEAST_SHARE,
    radii: tuple[float, float] = (4.0, 32.0),
) -> tuple[SignDetection, ...]:
    """Find signs by the symmetry of their outlines.

    Pairs of edge points with opposite gradients vote for the point between them, as in the Bilateral Chinese Transform
    of Belaroussi and Tarel (2009), whose weights we could not find: those here are our own. Own additions: two sides of
    a triangle, which have no such symmetry, vote for its middle; where votes are many, outlines of signs are fitted to
    the edges, and the share of the outline that is seen decides. Edges count from three times the gradient's noise,
    which is that of the region itself, so that signs faint in fog are found where the picture is as even.

    Parameters
    ----------
    luminance : (rows, cols) float32 or LinearPixels
        Luminance [linear grey levels], or an image of which only the regions are converted.
    regions : iterable of SearchRegion or None
        Where to look, and for what size; None looks all over the picture.
    least_strength : float
        Least share of an outline that must be seen [-].
    radii : tuple of float
        Least and greatest radius where there are no regions [px].

    Returns
    -------
    tuple of SignDetection
        The strongest first; of those in the same place one.
    """
    found = []
    for region, smaller, larger in _tiles(luminance, radii) if regions is None else _ranges(regions):
        found += _search(luminance, region, region.radius * smaller, region.radius * larger, least_strength)
    return _distinct(found)


def _ranges(regions: Iterable[SearchRegion]) -> Iterable[tuple[SearchRegion, float, float]]:
    return ((region, SMALLER, LARGER) for region in regions)


def _tiles(luminance: Floats | LinearPixels, radii: tuple[float, float]) -> Iterable[tuple[SearchRegion, float, float]]:
    """Tile the picture once for each octave of radii."""
    rows, cols = _size(luminance)
    octaves = max(math.ceil(math.log2(radii[1] / radii[0])), 1)
    ratio = (radii[1] / radii[0]) ** (0.5 / octaves)
    for octave in range(octaves):
        radius = radii[0] * ratio ** (2 * octave + 1)
        half = 0.5 * TILE * _factor(radius)
        for v in np.arange(half, rows + half, 2 * half):
            for u in np.arange(half, cols + half, 2 * half):
                yield SearchRegion(float(u), float(v), half, half, radius), 1.0 / ratio, ratio


def _factor(radius: float) -> int:
    return max(round(radius / USUAL), 1)


def _size(luminance: Floats | LinearPixels) -> tuple[int, int]:
    pixels = luminance.pixels if isinstance(luminance, LinearPixels) else luminance
    return pixels.shape[0], pixels.shape[1]


def _search(
    luminance: Floats | LinearPixels, region: SearchRegion, smallest: float, largest: float, least: float
) -> list[SignDetection]:
    """Detections within one region."""
    rows, cols = _size(luminance)
    factor = _factor(region.radius)
    margin = 1.5 * largest + 4 * factor
    top = max(int(region.v - region.half_height - margin), 0)
    left = max(int(region.u - region.half_width - margin), 0)
    bottom = min(int(region.v + region.half_height + margin) + 1, rows)
    right = min(int(region.u + region.half_width + margin) + 1, cols)
    if bottom - top < 9 * factor or right - left < 9 * factor:
        return []
    piece = shrunk(_cut(luminance, top, left, bottom - top, right - left), factor)
    shift = 0.5 * (factor - 1)
    # Places in the shrunk piece: its pixels are means over squares of the picture's.
    u, v = (region.u - left - shift) / factor, (region.v - top - shift) / factor
    wide, high = region.half_width / factor, region.half_height / factor
    box = (u - wide, u + wide, v - high, v + high)
    found = _in_piece(piece, box, smallest / factor, largest / factor)
    return [
        SignDetection(left + shift + factor * x, top + shift + factor * y, factor * radius, share)
        for x, y, radius, share, _ in found
        if share >= least and abs(x - u) <= wide + 1.0 and abs(y - v) <= high + 1.0
    ]


def _cut(luminance: Floats | LinearPixels, top: int, left: int, rows: int, cols: int) -> Floats:
    if isinstance(luminance, LinearPixels):
        return cut_luminance(luminance, top, left, rows, cols)
    return np.ascontiguousarray(luminance[top : top + rows, left : left + cols])


def _in_piece(
    piece: Floats, box: tuple[float, float, float, float], smallest: float, largest: float
) -> list[tuple[float, ...]]:
    """Fitted outlines (x, y, radius, share seen, shape) in a piece of a picture."""
    along, down, length = gradients(piece)
    noise = gradient_noise(length, EVEN, LEAST_NOISE)
    points, number = edge_points(along, down, length, noise, LEAST_GRADIENT)
    if len(points) < 6:
        return []
    middle, apart = math.sqrt(smallest * largest), max(round(0.4 * smallest), 1)
    rows, cols = piece.shape
    votes = [pair_votes(points, rows, cols, 1.8 * smallest, 2.9 * largest)]
    votes += [triangle_votes(points, rows, cols, middle, direction) for direction in (1.0, -1.0)]
    radii = np.geomspace(smallest, largest, 8).astype(np.float32)
    return [
        tuple(fitted(points, number, outlines, candidate[:2].copy(), radii).tolist())
        for accumulated, (outlines, most) in zip(votes, _SHAPES, strict=True)
        for candidate in peaks(accumulated, box, apart, 4.0, most)
    ]


_SHAPES = ((OUTLINES[:4].copy(), CANDIDATES), (OUTLINES[4:5].copy(), 3), (OUTLINES[5:].copy(), 3))
"""Outlines for which pairs of opposite and of triangles' sides vote, and how many middles are looked at for each."""


def _distinct(found: Sequence[SignDetection]) -> tuple[SignDetection, ...]:
    """Strongest of the detections in each place."""
    kept: list[SignDetection] = []
    for one in sorted(found, key=lambda each: (-each.strength, -each.radius, each.u, each.v)):
        if all(math.dist((one.u, one.v), (other.u, other.v)) > 0.7 * max(one.radius, other.radius) for other in kept):
            kept.append(one)
    return tuple(kept)
