"""Signs in a picture: discs, octagons, squares and triangles, found by the symmetry of their outlines."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.vision.symmetry.edge_kernels import (
    NX,
    NY,
    Picture,
    X,
    Y,
    clearest_gradients,
    edge_points,
    pair_votes,
    peaks,
    shrunk,
    triangle_votes,
)

Floats = NDArray[np.float32]

SAMPLES = 24
"""Places on an outline at which edges are looked for."""

_ALIGNED = 0.88
"""Least cosine between an edge's gradient and the normal of the outline: within 28° [-]."""

_MOST_CHANGES = 2
"""Changes between dark and bright surroundings along an outline that cost nothing: sky above, trees below."""

_HOPELESS, _GAIN = 0.35, 0.3
"""Share below which an outline is not fitted, and the most that fitting is thought to add to a share [-]."""

_BY_CHANCE = 0.35
"""Share of an outline that is no evidence for it [-]."""

_WITHOUT_QUARTER = 0.5
"""Largest share seen of an outline with one quarter unseen [-]."""

_ENOUGH = 6
"""Places seen from which on the outline is fitted."""


@kernel
def support(
    points: Floats, number: NDArray[np.int32], outline: Floats, x: float, y: float, radius: float, reach: int
) -> Floats:
    """Compare an outline with the edges near it.

    Returns share of the places that have a fitting edge, less where it fits worse [-], and how much farther right, down
    and larger the outline fits them best [px] (4,). Takes `x`, `y`, `radius` [px], `reach` [px].
    """
    tolerance = reach * min(max(0.13 * radius, 0.8), 1.5)
    seen, changes, last, near = 0, 0, 0.0, np.zeros(4)
    a = np.zeros((3, 3))
    b = np.zeros(3)
    for k in range(outline.shape[0]):
        nx, ny = outline[k, 2], outline[k, 3]
        px, py = x + radius * outline[k, 0], y + radius * outline[k, 1]
        off, polarity = _nearest_edge(points, number, (px, py), (nx, ny), reach)
        if abs(off) > tolerance:
            continue
        seen += 1
        near[4 * k // outline.shape[0]] += 1.0 - (off / tolerance) ** 2
        if last * polarity < 0.0:
            changes += 1
        last = polarity
        gains = (float(nx), float(ny), float(outline[k, 0] * nx + outline[k, 1] * ny))
        for i in range(3):
            b[i] += gains[i] * off
            for j in range(3):
                a[i, j] += gains[i] * gains[j]
    result = np.zeros(4, np.float32)
    share = (near.sum() - max(changes - _MOST_CHANGES, 0)) / outline.shape[0]
    # Three sides of a square are those of a gap between windows.
    result[0] = min(share, _WITHOUT_QUARTER + 4.0 * near.min() / outline.shape[0])
    if seen >= _ENOUGH:
        if a[0, 0] == 0.0 or a[1, 1] == 0.0:
            # One level side alone: along it the outline could lie anywhere.
            result[0] = 0.0
        else:
            _solve(a, b, result)
    return result


@kernel
def _nearest_edge(
    points: Floats,
    number: NDArray[np.int32],
    place: tuple[float, float],
    normal: tuple[float, float],
    reach: int,
) -> tuple[float, float]:
    """Offset along a normal [px], infinite if none is near, and direction of the edge nearest to a place."""
    off, polarity = math.inf, 0.0
    (x, y), (nx, ny) = place, normal
    row, col = math.floor(y + 0.5), math.floor(x + 0.5)
    for i in range(max(row - reach, 0), min(row + reach + 1, number.shape[0])):
        for j in range(max(col - reach, 0), min(col + reach + 1, number.shape[1])):
            at = number[i, j]
            if at >= 0:
                along = points[at, NX] * nx + points[at, NY] * ny
                across = (points[at, X] - x) * nx + (points[at, Y] - y) * ny
                if abs(along) > _ALIGNED and abs(across) < abs(off):
                    off, polarity = across, along
    return off, polarity


@kernel
def _solve(a: NDArray[np.float64], b: NDArray[np.float64], result: Floats) -> None:
    """Solve three equations by Cramer's rule into the last three places of a result; nothing if they are singular."""
    whole = _determinant(a)
    if whole < 1e-3 * a[0, 0] * a[1, 1] * a[2, 2]:
        return
    for k in range(3):
        changed = a.copy()
        changed[:, k] = b
        result[1 + k] = min(max(_determinant(changed) / whole, -1.5), 1.5)


@kernel
def _determinant(a: NDArray[np.float64]) -> float:
    return float(
        a[0, 0] * (a[1, 1] * a[2, 2] - a[1, 2] * a[2, 1])
        - a[0, 1] * (a[1, 0] * a[2, 2] - a[1, 2] * a[2, 0])
        + a[0, 2] * (a[1, 0] * a[2, 1] - a[1, 1] * a[2, 0])
    )


@kernel
def fitted(points: Floats, number: NDArray[np.int32], outlines: Floats, candidate: Floats, radii: Floats) -> Floats:
    """Outline that is borne out best about a candidate for its middle, fitted to the edges.

    Returns middle (x, y) and radius [px], share of the outline that is seen [-] and number of the outline. Takes
    `candidate` (2,) [px], `radii` (m,) [px].
    """
    best, most = np.zeros(5, np.float32), 0.0
    for shape in range(outlines.shape[0]):
        for k in range(radii.size):
            x, y, radius = float(candidate[0]), float(candidate[1]), float(radii[k])
            found = support(points, number, outlines[shape], x, y, radius, 2)
            if (found[0] + _GAIN - _BY_CHANCE) * radius < most or found[0] < _HOPELESS:
                continue
            for _ in range(3):
                x, y, radius = x + found[1], y + found[2], radius + found[3]
                found = support(points, number, outlines[shape], x, y, radius, 1)
            # Of two outlines that are seen alike, the larger one is the sign's, the other one that of its field.
            evidence = (found[0] - _BY_CHANCE) * radius
            if evidence > most and 0.9 * radii[0] <= radius <= 1.1 * radii[-1]:
                most = evidence
                best[0], best[1], best[2], best[3], best[4] = x, y, radius, found[0], shape
    return best


@kernel
def edge_density(number: NDArray[np.int32], x: float, y: float, reach: float) -> float:
    """Edge points over pixels in a square about a place [-].

    Takes `number` (rows, cols) int32, `x`, `y` [px], `reach` [px].
    """
    count = area = 0
    for row in range(max(int(y - reach), 0), min(int(y + reach) + 1, number.shape[0])):
        for col in range(max(int(x - reach), 0), min(int(x + reach) + 1, number.shape[1])):
            area += 1
            count += number[row, col] >= 0
    return count / max(area, 1)


def polygon_outline(corners: Sequence[tuple[float, float]]) -> NDArray[np.float32]:
    """Places at even distances along a convex polygon, none on a corner.

    Returns place and outward normal. Takes `corners` (x, y).
    """
    ends = list(zip(corners, [*corners[1:], corners[0]], strict=True))
    lengths = [math.dist(a, b) for a, b in ends]
    step = sum(lengths) / SAMPLES
    rows = []
    for k in range(SAMPLES):
        way = (k + 0.5) * step
        side = 0
        while way > lengths[side]:
            way -= lengths[side]
            side += 1
        (ax, ay), (bx, by) = ends[side]
        share, length = way / lengths[side], lengths[side]
        rows.append((ax + share * (bx - ax), ay + share * (by - ay), (by - ay) / length, (ax - bx) / length))
    return np.array(rows, np.float32)


def _circle() -> NDArray[np.float32]:
    angle = 2.0 * math.pi * np.arange(SAMPLES) / SAMPLES
    return np.column_stack((np.cos(angle), np.sin(angle), np.cos(angle), np.sin(angle))).astype(np.float32)


def _regular(sides: int, turn: float, radius: float) -> NDArray[np.float32]:
    angles = [turn + 2.0 * math.pi * k / sides for k in range(sides)]
    return polygon_outline([(radius * math.cos(angle), radius * math.sin(angle)) for angle in angles])


_UPRIGHT_TRIANGLE = ((0.0, -math.sqrt(0.75)), (1.0, math.sqrt(0.75)), (-1.0, math.sqrt(0.75)))
_INVERTED_TRIANGLE = ((-1.0, -math.sqrt(0.75)), (1.0, -math.sqrt(0.75)), (0.0, math.sqrt(0.75)))

OUTLINES = np.stack(
    (
        _circle(),
        _regular(4, math.pi / 4, math.sqrt(2.0)),
        _regular(4, 0.0, 1.0),
        polygon_outline(_UPRIGHT_TRIANGLE),
        polygon_outline(_INVERTED_TRIANGLE),
    )
)
"""(5, SAMPLES, 4) float32: disc, square, square on its corner, triangles with their tip up and down. An octagon differs
from the disc by less than the edges of either do from a line."""


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


_RADII = (4.0, 32.0)
"""Least and greatest radius of signs that are searched all over an image [px]."""


def detect_signs(
    image: Picture,
    regions: Iterable[SearchRegion] | None = None,
) -> tuple[SignDetection, ...]:
    """Find signs by the symmetry of their outlines.

    Pairs of edge points with opposite gradients vote for the point between them, as in the Bilateral Chinese Transform
    (Belaroussi and Tarel 2009), whose weights we could not find: those here are our own. Own additions: the gradient is
    that of the colour that shows it clearest; two sides of a triangle, which have no such symmetry, vote for its
    middle; where votes are many, outlines of signs are fitted to the edges, and how much of an outline is seen decides:
    so much must be, and no chance among as many edges may bear it out (a contrario: Desolneux, Moisan and Morel 2000).
    Edges count from four times the gradient's noise, which is that of the region itself: signs faint in fog are found
    where the picture is as even.

    Returns the surest first; of those in the same place one. Takes `image` (rows, cols).
    """
    # numba would compile all again for an array that cannot be written.
    pixels: NDArray[Any] = np.require(image if image.ndim == 3 else image[:, :, None], requirements=["C", "W"])
    if regions is None:
        searches = list(_tiles(pixels.shape[:2], _RADII))
        # So many tiles give chance as many occasions.
        surprise, share = _UNWARNED_SURPRISE + math.log(len(searches)), _UNWARNED_SHARE
    else:
        searches = [(region, SMALLER, LARGER) for region in regions]
        surprise, share = _SURPRISE, _LEAST_SHARE
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
