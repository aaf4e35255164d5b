"""Division of a body into zones of height, and of these into spans without a gap, as seen from one side."""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import matrix_product
from vehicle_bodies.projection import COLUMNS, ROWS, Mask, Projection, Size, Wide, light_of

_NARROW = 0.03  # runs of columns and gaps between them, and edges of panels, that are left out [units of the box]
_UNEVEN = 0.06  # how far a surface may lie from a straight line [units of the box]
_LEAST = 4  # rows of a zone
BEHIND = 0.003  # how far panels stay behind lamps and plates [units of the box]


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
    split: tuple[float, float]  # where across it the panel of what is not paint begins and ends (0 … 1)
    colour: Wide  # reflectance of that panel
    light: float  # share of the sky's light on the paint next to it
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
    return Span(zone, middle, breadth, np.clip(depth, 0.0, 1.0), *_materials(look, zone, inside, little))


def _depth(samples: Wide, z: Wide, count: NDArray[np.int64], height: int) -> Wide:
    """Depth of a run at its lower and upper edge: along a straight line if that is how it lies, else its median."""
    rows = np.take_along_axis(np.sort(samples, axis=1), (count // 2)[:, None], axis=1)[:, 0]
    line = _line(z, rows, count, height)
    if np.abs(rows - line[0] - (line[1] - line[0]) * z / height).max() > _UNEVEN:
        return np.full(2, np.median(samples[np.isfinite(samples)]))
    return line


def within(run: Span, rear: Projection) -> Span:
    """The run of a flank no farther out at its edges than the body is broad there, lest it should show from behind."""
    breadth = rear.covered.mean(axis=1)
    edges = (breadth[run.zone[0] : run.zone[0] + 3].max(), breadth[run.zone[1] - 3 : run.zone[1]].max())
    return replace(run, depth=np.maximum(run.depth, 0.5 - 0.5 * np.array(edges)))


def _line(z: Wide, values: Wide, weights: NDArray[Any], height: int) -> Wide:
    """Values of the straight line of least squares at 0 and at a height."""
    whole = weights.sum()
    mean, level = matrix_product(weights, z) / whole, matrix_product(weights, values) / whole
    spread = matrix_product(weights, (z - mean) ** 2)
    slope = matrix_product(weights, (z - mean) * (values - level)) / spread if spread > 0.0 else 0.0
    return np.asarray(level + slope * (np.array([0.0, height]) - mean))


def _materials(
    look: SideView, zone: tuple[int, int], inside: Mask, little: float
) -> tuple[tuple[float, float], Wide, float, tuple[Wide, Wide]]:
    """Split, colour, light and normals of a run (see `Span`) with which it shows the light of the body there."""
    rows = slice(*zone)
    kept, normal = look.over.depth[rows] < np.inf, look.seen.normal[rows]
    free, paint = inside & ~kept, inside & (look.seen.paint[rows] > 0.5)
    own = inside & ~paint
    whole = max(int(free.sum()), 1)
    start, end = _place(look.side, free, own, 1.0 - paint.sum() / whole, little)
    room = whole * (end - start)
    means = _mean(normal[own]), _mean(normal[paint])
    # What is kept shows its own light, whatever it hides.
    light = look.seen.own[rows][own].sum(axis=0) - look.over.own[rows][inside & kept].sum(axis=0)
    colour = light / max(room, 1.0) / light_of(means[0][2])
    lit = float(paint.sum() * light_of(means[1][2])) / max(whole - room, 1.0)
    return (start, end), colour, lit, means


def _mean(normals: Wide) -> Wide:
    return np.asarray(normals.mean(axis=0)) if len(normals) else np.zeros(3)


def _place(side: str, free: Mask, own: Mask, share: float, little: float) -> tuple[float, float]:
    """Where across a run the panel of what is not paint begins and ends (0 … 1), for its share of the run."""
    if share > 1.0 - little:
        return 0.0, 1.0
    if share < little:
        return 1.0, 1.0
    if side != "left":
        return 0.5 - 0.5 * share, 0.5 + 0.5 * share
    across = np.concatenate(([0.0], np.cumsum(free.sum(axis=0)))) / max(free.sum(), 1)
    content = np.concatenate(([0.0], np.cumsum(own.sum(axis=0))))
    starts = np.linspace(0.0, 1.0 - share, 65)
    best = starts[np.argmax(np.interp(starts + share, across, content) - np.interp(starts, across, content))]
    if best < _NARROW:
        return 0.0, share
    return (1.0 - share, 1.0) if best + share > 1.0 - _NARROW else (float(best), float(best + share))


def divide_into_zones(side: str, seen: Projection, left: Projection, size: Size, count: int) -> list[tuple[int, int]]:
    """First rows of the zones of a body, and the rows after their last, from below.

    The sum of squares that straight lines through outlines and mean materials leave is the least.
    """
    materials = seen.paint.sum(axis=1) / np.maximum(seen.covered.sum(axis=1), 1)
    cost = _cost(_outlines(side, seen, left, size), straight=True) + _cost(materials[:, None], straight=False)
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
