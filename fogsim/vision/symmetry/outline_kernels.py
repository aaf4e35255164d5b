"""How much of an outline the edges of a picture bear out, and where it fits them best."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.vision.symmetry.edge_kernels import NX, NY, X, Y

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


_TIP_UP = ((0.0, -math.sqrt(0.75)), (1.0, math.sqrt(0.75)), (-1.0, math.sqrt(0.75)))
_TIP_DOWN = ((-1.0, -math.sqrt(0.75)), (1.0, -math.sqrt(0.75)), (0.0, math.sqrt(0.75)))

OUTLINES = np.stack(
    (
        _circle(),
        _regular(4, math.pi / 4, math.sqrt(2.0)),
        _regular(4, 0.0, 1.0),
        polygon_outline(_TIP_UP),
        polygon_outline(_TIP_DOWN),
    )
)
"""(5, SAMPLES, 4) float32: disc, square, square on its corner, triangles with their tip up and down. An octagon differs
from the disc by less than the edges of either do from a line."""
