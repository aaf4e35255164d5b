"""Division of a body into zones of height, and of these into spans without a gap, as seen from one side."""

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import matrix_product
from vehicle_bodies.projection import COLUMNS, ROWS, Mask, Projection, Size, Wide, light_of

_NARROW = 0.03  # runs of columns and gaps between them that are left out [units of the box]
_UNEVEN = 0.06  # how far a surface may lie from a straight line [units of the box]
_DARK, _OWN_LIGHT = 0.02, 0.7  # light below which parts look alike, and weight of its logarithm in the division
_HOLLOW = 0.8  # share of its outline that a row without a gap covers
_LEAST = 4  # rows of a zone
BEHIND = 0.003  # how far panels stay behind lamps and plates [units of the box]


Part = tuple[tuple[float, float], tuple[float, float]]  # where a panel begins and ends across a run, and up (0 … 1)
WHOLE: Part = ((0.0, 1.0), (0.0, 1.0))


@dataclass(frozen=True, slots=True)
class SideView:
    """A body from one side: all of it but its shadow, and of that what its levels of detail keep."""

    side: str
    seen: Projection
    over: Projection


@dataclass(frozen=True, slots=True)
class Span:
    """Part of a zone without a gap, from one side."""

    zone: tuple[int, int]  # first row and the one after the last
    middle: Wide  # at its lower and upper edge [units of the box]
    breadth: Wide
    depth: Wide
    parts: dict[str, Part]  # where the panels of "paint" and of what is its "own" lie in it, from behind
    colour: Wide  # reflectance of what is not paint, at the lower and upper edge of the run (2, 3)
    light: Wide  # share of the sky's light on the paint, at the lower and upper edge of the run (2,)
    normals: tuple[Wide, Wide]  # mean normals of what is not paint, and of paint


def find_spans(look: SideView, zone: tuple[int, int], little: float) -> list[Span]:
    """Runs of columns of a zone that are covered for the most part, each with the samples nearest to it."""
    covered = look.seen.covered[zone[0] : zone[1]]
    columns = covered.sum(axis=0)
    full = columns >= 0.5 * max(columns.max(), 1)
    edges = np.flatnonzero(np.diff(np.concatenate(([False], full, [False]))))
    spans: list[list[int]] = []
    for first, last in edges.reshape(-1, 2).tolist():
        if spans and first - spans[-1][1] < _NARROW * COLUMNS:
            spans[-1][1] = last
        elif last - first >= _NARROW * COLUMNS:
            spans.append([first, last])
    if not spans and columns.any():
        seen_at = np.flatnonzero(columns)
        spans = [[int(seen_at[0]), int(seen_at[-1]) + 1]]
    if not spans:
        return []
    middles = np.arange(COLUMNS) + 0.5
    away = np.array([np.maximum(first - middles, middles - last) for first, last in spans])
    nearest = np.argmin(away, axis=0)
    alone = len(spans) == 1
    return [_fitted_span(look, zone, covered & (nearest == number), alone, little) for number in range(len(spans))]


def _fitted_span(look: SideView, zone: tuple[int, int], inside: Mask, alone: bool, little: float) -> Span:
    """A run of samples; if it is not alone, it is upright lest it should meet the next one."""
    z: Wide = np.arange(len(inside), dtype=np.float64) + 0.5
    count = inside.sum(axis=1)
    centre = matrix_product(inside, np.arange(COLUMNS) + 0.5) / np.maximum(count, 1) / COLUMNS
    middle, breadth = np.full(2, matrix_product(count, centre) / count.sum()), np.full(2, count.mean() / COLUMNS)
    line = _line(z, count / COLUMNS, np.ones(len(z)), len(z))
    even = np.abs(count / COLUMNS - line[0] - (line[1] - line[0]) * z / len(z)).max() < _UNEVEN
    if alone and even and line.min() >= 0.0 and line.max() <= 1.0:
        breadth, middle = line, _line(z, centre, count, len(z))
    rows, full = slice(*zone), count > 0
    depth = _depth(np.where(inside, look.seen.depth[rows], np.inf)[full], z[full], count[full], len(z))
    before = look.over.depth[rows][inside & look.over.covered[rows]]
    if len(before):
        depth = np.maximum(depth, before.max() + BEHIND)
    share = (z / len(z))[:, None]
    start, width = (
        pair[0] + share * (pair[1] - pair[0]) for pair in (middle - 0.5 * breadth, np.maximum(breadth, 1e-3))
    )
    across = ((np.arange(COLUMNS) + 0.5) / COLUMNS - start) / width
    return Span(zone, middle, breadth, np.clip(depth, 0.0, 1.0), *_materials(look, zone, inside, across, little))


def _depth(samples: Wide, z: Wide, count: NDArray[np.int64], height: int) -> Wide:
    """Depth of a run at its lower and upper edge: along a straight line if that is how it lies, else its median."""
    rows = np.take_along_axis(np.sort(samples, axis=1), (count // 2)[:, None], axis=1)[:, 0]
    line = _line(z, rows, count, height)
    if np.abs(rows - line[0] - (line[1] - line[0]) * z / height).max() > _UNEVEN:
        return np.full(2, np.median(samples[np.isfinite(samples)]))
    return line


def within(run: Span, rear: Projection) -> Span:
    """The run of a flank no farther out at its edges than the body reaches there, lest it should show from behind."""
    rows = np.flatnonzero(rear.covered.any(axis=1))
    reach = np.interp(np.arange(ROWS), rows, np.argmax(rear.covered[rows], axis=1) / COLUMNS)
    edges = reach[run.zone[0] : run.zone[0] + 3].min(), reach[run.zone[1] - 3 : run.zone[1]].min()
    return replace(run, depth=np.maximum(run.depth, edges))


def _line(z: Wide, values: Wide, weights: NDArray[Any], height: int) -> Wide:
    """Values of the straight line of least squares at 0 and at a height."""
    whole = weights.sum()
    mean, level = matrix_product(weights, z) / whole, matrix_product(weights, values) / whole
    spread = matrix_product(weights, (z - mean) ** 2)
    slope = matrix_product(weights, (z - mean) * (values - level)) / spread if spread > 0.0 else 0.0
    return np.asarray(level + slope * (np.array([0.0, height]) - mean))


def _materials(
    look: SideView, zone: tuple[int, int], inside: Mask, across: Wide, little: float
) -> tuple[dict[str, Part], Wide, Wide, tuple[Wide, Wide]]:
    """Parts, colour, light and normals of a run (see `Span`) with which it shows the light of the body there.

    `across` (rows, columns) is where in the run each sample lies (0 … 1).
    """
    rows = slice(*zone)
    free, normal = inside & ~look.over.covered[rows], look.seen.normal[rows]
    paint = look.seen.paint[rows] > 0.5
    own, paint = free & ~paint, free & paint
    means = _mean(normal[own]), _mean(normal[paint])
    share = own.sum() / max(free.sum(), 1)
    parts: dict[str, Part] = {"paint": WHOLE} if paint.any() else {}
    if share > 1.0 - little:
        parts = {"own": WHOLE}
    elif share > little:
        (first, tight), (second, other) = _part(across, own, share), _part(across, paint, 1.0 - share)
        # What lies more densely is before the other.
        parts = {"paint": WHOLE, "own": first} if tight >= other else {"own": WHOLE, "paint": second}
    colour = _ends(look.seen.own[rows], own) / light_of(means[0][2])
    return parts, colour, _ends(light_of(normal[..., 2:]), paint)[:, 0], means


def _ends(values: Wide, own: Mask) -> Wide:
    """Straight lines through the means in each row of samples (rows, columns, channels), at both ends (2, channels)."""
    count = own.sum(axis=1)
    if not count.any():
        return np.zeros((2, values.shape[2]))
    means = (values * own[..., None]).sum(axis=1) / np.maximum(count, 1)[:, None]
    z: Wide = np.arange(len(own), dtype=np.float64) + 0.5
    lines = np.stack([_line(z, column, count, len(own)) for column in means.T], axis=1)
    return np.clip(lines, means[count > 0].min(axis=0), means[count > 0].max(axis=0))


def _mean(normals: Wide) -> Wide:
    return np.asarray(normals.mean(axis=0)) if len(normals) else np.zeros(3)


def _part(across: Wide, own: Mask, share: float) -> tuple[Part, float]:
    """Rectangle of a share of a run, about the middle of samples and in their proportions, and how densely they lie."""
    up = np.broadcast_to((np.arange(len(own)) + 0.5)[:, None] / len(own), own.shape)[own]
    places = np.clip(across[own], 0.0, 1.0), up
    broad, tall = (max(math.sqrt(12.0) * float(place.std()), 1e-3) for place in places)
    tight = share / (broad * tall)
    broad = float(np.clip(broad * math.sqrt(tight), share, 1.0))
    sides = []
    for place, size in zip(places, (broad, share / broad), strict=True):
        low = float(np.clip(place.mean() - 0.5 * size, 0.0, 1.0 - size))
        sides.append((low, low + size))
    return (sides[0], sides[1]), tight


def divide_into_zones(side: str, seen: Projection, left: Projection, size: Size, count: int) -> list[tuple[int, int]]:
    """First rows of the zones of a body, and the rows after their last, from below.

    The sum of squares that straight lines through outlines and mean materials leave is the least.
    """
    covered, paint = seen.covered.sum(axis=1), seen.paint.sum(axis=1)
    light = np.log(_DARK + seen.own.mean(axis=2).sum(axis=1) / np.maximum(covered - paint, 1))
    cost = _cost(np.column_stack((_outlines(side, seen, left, size), _OWN_LIGHT * light)), straight=True)
    cost += _cost((paint / np.maximum(covered, 1))[:, None], straight=False)
    if side != "left":
        # Between the wheels one sees the road, and nothing of the other end.
        hollow = covered < _HOLLOW * (COLUMNS - 2 * np.argmax(seen.covered, axis=1))
        clear = int(np.argmin(hollow))
        if clear >= _LEAST:
            cost[:clear, clear + 1 :] = np.inf
    best, cut = cost[0].copy(), np.zeros((count, ROWS + 1), np.int64)
    for zone in range(1, count):
        total = best[:, None] + cost
        cut[zone], best = np.argmin(total, axis=0), np.min(total, axis=0)
    edges = [ROWS]
    for zone in range(count - 1, -1, -1):
        edges.append(int(cut[zone, edges[-1]]))
    edges.reverse()
    return [(low, high) for low, high in pairwise(edges) if high > low]


def _outlines(side: str, seen: Projection, left: Projection, size: Size) -> Wide:
    """Breadth of each row, and its ends (only that one from where the body is seen) in its widths (rows, 2 or 3)."""
    rear, front = np.argmax(left.covered, axis=1), np.argmax(left.covered[:, ::-1], axis=1)
    ends = {"rear": (rear,), "front": (front,), "left": (rear, front)}[side]
    weight = (1.0 if side == "left" else 2.0) * seen.covered.mean(axis=1)
    return np.column_stack((weight, *(0.5 * size[0] / size[1] / COLUMNS * end for end in ends)))


def _cost(values: Wide, *, straight: bool) -> Wide:
    """Sum of squares left in rows i … j − 1 (ROWS + 1, ROWS + 1), infinite where those are too few."""
    z = np.arange(ROWS) / ROWS

    def between(column: Wide) -> Wide:
        total = np.concatenate((np.zeros((1, *column.shape[1:])), np.cumsum(column, axis=0)))
        return np.asarray(total[None, :] - total[:, None])

    n = np.maximum(np.arange(ROWS + 1)[None, :] - np.arange(ROWS + 1)[:, None], 1)
    y, yy = between(values), between(values**2)
    left = yy - y**2 / n[..., None]
    if straight:
        spread = between(z**2) - between(z) ** 2 / n
        slope = between(z[:, None] * values) - between(z)[..., None] * y / n[..., None]
        left = left - slope**2 / np.maximum(spread, 1e-9)[..., None]
    rows = np.arange(ROWS + 1)[None, :] - np.arange(ROWS + 1)[:, None]
    return np.where(rows >= _LEAST, np.maximum(left, 0.0).sum(axis=2), np.inf)
