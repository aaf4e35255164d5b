"""Stand-ins of few triangles for vehicles that are small in the picture, made from the shapes that they stand for.

A stand-in is a stack of few zones of height. In each zone, from each side, it has as much paint as the shape shows
from there, under the same light, and what is not paint in one panel of its mean colour; its outline encloses the same
area. So it has the mean radiance of the shape in any paint, from the rear, the front and the sides. Lamps and plates
are those of the shape.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.bodies.lamp_patches import lamp_quads, used
from fogsim.scene.bodies.parts import contact_shadow
from fogsim.scene.bodies.seen import COLUMNS, ROWS, Seen, Size, light_of, placed, seen_from, totals, upwards_of
from fogsim.scene.bodies.zones import zones_of
from fogsim.scene.solids import PAINT, Material, grid_faces, merge, mesh, mirrored
from fogsim.values.scene import Mesh, Surface

Wide = NDArray[np.float64]
Mask = NDArray[np.bool_]

_NARROW = 0.03  # runs of columns and gaps between them, and edges of panels, that are left out [units of the box]
_BEHIND = 0.003  # how far panels stay behind lamps and plates [units of the box]
_NEAR = 0.01  # how deep in the shape lamps and plates may lie that show [units of the box]
_SIDES = ("rear", "front", "left")  # the right one is the mirror image of the left one
_UNEVEN = 0.06  # how far a surface may lie from a straight line [units of the box]
_ON_ROAD = 0.02  # height below which a level surface lies on the road [units of the box]
_ROUNDS, _FINE = 2, 2  # rounds of correction, and how many times as fine the body is looked at for them
_BREADTHS, _GAINS = (0.95, 1.05), (0.5, 2.0)  # bounds of corrections
_STEP = 0.9  # a zone whose footprint is smaller than this share of the one below it shows that one's top


@dataclass(frozen=True, slots=True)
class Detail:
    """How much of a body its stand-in shows.

    Attributes
    ----------
    zones : mapping from str to int
        Number of zones of height from the "rear", the "front" and the "left".
    little : float
        Share of a zone below which a material is left out there (of which there is more elsewhere, then).
    """

    zones: Mapping[str, int]
    little: float


@dataclass(frozen=True, slots=True)
class _Run:
    """Part of a zone without a gap, from one side.

    Attributes
    ----------
    zone : tuple of int
        First row and the one after the last.
    middle, breadth, depth : (2,) float64
        At its lower and upper edge [units of the box].
    split : tuple of float
        Where across it the panel of what is not paint begins and ends (0 … 1).
    colour : (3,) float64
        Reflectance of that panel.
    light : float
        Share of the sky's light on the paint beside it.
    normals : tuple of (3,) float64
        Mean normals of what is not paint, and of paint.
    """

    zone: tuple[int, int]
    middle: Wide
    breadth: Wide
    depth: Wide
    split: tuple[float, float]
    colour: Wide
    light: float
    normals: tuple[Wide, Wide]


@dataclass(frozen=True, slots=True)
class _Look:
    """A body from one side: all of it but its shadow, and of that what its stand-ins keep."""

    side: str
    seen: Seen
    over: Seen


@dataclass(frozen=True, slots=True)
class _Gain:
    """Factors by which a side's panels are made broader, and those of paint and of other materials brighter."""

    breadth: float
    paint: float
    own: Wide


def stand_ins(shape: Mesh, size: Size, details: Sequence[Detail], shadow: float) -> list[Mesh]:
    """Stand-ins of a body, with its lamps and plates.

    Parameters
    ----------
    shape : Mesh
        The body in full in a unit box.
    size : tuple of float
        Its length, width and height [m].
    details : sequence of Detail
        How much each of them shows.
    shadow : float
        Half the breadth of the darkness under it [units of its width].
    """
    body, kept = _without_shadow(shape), merge((lamp_quads(shape), _sheeting(shape)))
    looks = {side: _look(side, body, kept, size) for side in _SIDES}
    top, rest = seen_from("top", body, size), merge((kept, _shadow(size, shadow)))
    wanted = {side: _totals(side, shape, size) for side in _SIDES}
    return [_matched(looks, wanted, top, detail, rest, size) for detail in details]


def _matched(
    looks: Mapping[str, _Look],
    wanted: Mapping[str, Sequence[float]],
    top: Seen,
    detail: Detail,
    rest: Mesh,
    size: Size,
) -> Mesh:
    """Stand-in that covers as much as the body from each side, with as much light: built, looked at and corrected."""
    left = looks["left"].seen
    runs: dict[str, list[_Run]] = {}
    for side, look in looks.items():
        zones = zones_of(side, look.seen, left, size, detail.zones[side])
        own = [run for zone in zones for run in _runs(look, zone, detail.little)]
        runs[side] = own if side != "left" else [_within(run, looks["rear"].seen) for run in own]
    gains = dict.fromkeys(looks, _Gain(1.0, 1.0, np.ones(3)))
    rest = merge((_tops(top, runs["left"], runs["rear"]), rest))
    for _ in range(_ROUNDS):
        whole = _built(runs, gains, rest, size)
        gains = {side: _corrected(gain, wanted[side], _totals(side, whole, size)) for side, gain in gains.items()}
    return _built(runs, gains, rest, size)


def _built(
    runs: Mapping[str, Sequence[_Run]],
    gains: Mapping[str, _Gain],
    rest: Mesh,
    size: Size,
) -> Mesh:
    panels = {
        side: merge([panel for run in own for panel in _panels(side, run, gains[side], size)])
        for side, own in runs.items()
    }
    return merge((*panels.values(), mirrored(panels["left"]), rest))


def _corrected(gain: _Gain, want: Sequence[float], got: Sequence[float]) -> _Gain:
    """Factors that would have given the area and the light (see `totals`) that the body has."""
    area, paint, *own = np.array(want) / np.maximum(got, 1e-9)
    # Broader panels have more light, too.
    return _Gain(
        float(np.clip(gain.breadth * area, *_BREADTHS)),
        float(np.clip(gain.paint * paint / area, *_GAINS)),
        np.clip(gain.own * own / area, *_GAINS),
    )


def _totals(side: str, shape: Mesh, size: Size) -> tuple[float, ...]:
    seen = seen_from(side, shape, size, _FINE)
    return totals(seen.depth, seen.normal, seen.paint, seen.own)


def _look(side: str, body: Mesh, kept: Mesh, size: Size) -> _Look:
    seen = seen_from(side, body, size)
    return _Look(side, seen, _over(side, kept, seen, size))


def _without_shadow(shape: Mesh) -> Mesh:
    """The shape without what lies on the road."""
    low, upwards = shape.positions[:, 2] < _ON_ROAD, shape.normals[:, 2] > 1.0 - 1e-6
    return used(replace(shape, faces=shape.faces[~(low & upwards)[shape.faces].all(axis=1)]))


def _over(side: str, kept: Mesh, seen: Seen, size: Size) -> Seen:
    """What is kept, where it is not hidden by the shape itself."""
    over = seen_from(side, kept, size)
    shown = over.depth <= seen.depth + _NEAR
    hidden = np.where(shown, over.depth, np.inf)
    return replace(over, depth=hidden, own=over.own * shown[..., None])


def _sheeting(shape: Mesh) -> Mesh:
    """Plates and other sheeting, which sends lamplight back."""
    own = shape.surface[shape.faces[:, 0]] == Surface.SHEETING
    return used(replace(shape, faces=shape.faces[own]))


def _runs(look: _Look, zone: tuple[int, int], little: float) -> list[_Run]:
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
    return [_run(look, zone, covered & (nearest == number), alone, little) for number in range(len(spans))]


def _run(look: _Look, zone: tuple[int, int], inside: Mask, alone: bool, little: float) -> _Run:
    """A run of samples; if it is not alone, it is upright lest it should meet the next one."""
    z: Wide = np.arange(len(inside), dtype=np.float64) + 0.5
    count = inside.sum(axis=1)
    centre = inside @ (np.arange(COLUMNS) + 0.5) / np.maximum(count, 1) / COLUMNS
    middle, breadth = np.full(2, count @ centre / count.sum()), np.full(2, count.mean() / COLUMNS)
    line = _line(z, count / COLUMNS, np.ones(len(z)), len(z))
    even = np.abs(count / COLUMNS - line[0] - (line[1] - line[0]) * z / len(z)).max() < _UNEVEN
    if alone and even and line.min() >= 0.0 and line.max() <= 1.0:
        breadth, middle = line, _line(z, centre, count, len(z))
    rows, full = slice(*zone), count > 0
    depth = _depth(np.where(inside, look.seen.depth[rows], np.inf)[full], z[full], count[full], len(z))
    before = look.over.depth[rows][inside & look.over.covered[rows]]
    if len(before):
        depth = np.maximum(depth, before.max() + _BEHIND)
    return _Run(zone, middle, breadth, np.clip(depth, 0.0, 1.0), *_materials(look, zone, inside, little))


def _depth(samples: Wide, z: Wide, count: NDArray[np.int64], height: int) -> Wide:
    """Depth of a run at its lower and upper edge: along a straight line if that is how it lies, else its median."""
    rows = np.take_along_axis(np.sort(samples, axis=1), (count // 2)[:, None], axis=1)[:, 0]
    line = _line(z, rows, count, height)
    if np.abs(rows - line[0] - (line[1] - line[0]) * z / height).max() > _UNEVEN:
        return np.full(2, np.median(samples[np.isfinite(samples)]))
    return line


def _within(run: _Run, rear: Seen) -> _Run:
    """The run of a flank no farther out at its edges than the body is broad there, lest it should show from behind."""
    breadth = rear.covered.mean(axis=1)
    edges = (breadth[run.zone[0] : run.zone[0] + 3].max(), breadth[run.zone[1] - 3 : run.zone[1]].max())
    return replace(run, depth=np.maximum(run.depth, 0.5 - 0.5 * np.array(edges)))


def _line(z: Wide, values: Wide, weights: NDArray[Any], height: int) -> Wide:
    """Values of the straight line of least squares at 0 and at a height."""
    whole = weights.sum()
    mean, level = weights @ z / whole, weights @ values / whole
    spread = weights @ (z - mean) ** 2
    slope = weights @ ((z - mean) * (values - level)) / spread if spread > 0.0 else 0.0
    return np.asarray(level + slope * (np.array([0.0, height]) - mean))


def _materials(
    look: _Look, zone: tuple[int, int], inside: Mask, little: float
) -> tuple[tuple[float, float], Wide, float, tuple[Wide, Wide]]:
    """Split, colour, light and normals of a run (see `_Run`) with which it shows the light of the body there."""
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


def _panels(side: str, run: _Run, gain: _Gain, size: Size) -> list[Mesh]:
    """Panels of a run: one of what is not paint, and behind it one of paint."""
    (start, end), broader = run.split, replace(run, breadth=run.breadth * gain.breadth)
    split = 0.0 < end - start < 1.0
    panels = []
    if end > start:
        red, green, blue = np.clip(gain.own * run.colour, 0.005, 0.9).tolist()
        normals = _normals(side, run.normals[0], run.normals[0][2], size)
        panels.append(_panel(side, broader, (start, end), Material((red, green, blue)), normals, size))
    if end - start < 1.0 and run.light > 0.0:
        normals = _normals(side, run.normals[1], upwards_of(gain.paint * run.light), size)
        behind = replace(broader, depth=broader.depth + _BEHIND * split)
        panels.append(_panel(side, behind, (0.0, 1.0), PAINT, normals, size))
    return panels


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


def _normals(side: str, mean: Wide, upwards: float, size: Size) -> Wide:
    """Normals at the lower and the upper edge of a panel (2, 3), in the box.

    Their mean is the given one with another z, which says how much light there is.
    """
    mean = mean.copy()
    mean[1 if side != "left" else 0] = 0.0  # the same on both sides of the body
    mean[2] = np.clip(upwards, -0.99, 0.99)
    level = float(np.hypot(mean[0], mean[1]))
    mean[:2] *= min(1.0, math.sqrt(1.0 - mean[2] ** 2) / max(level, 1e-9))
    level, length = max(float(np.hypot(mean[0], mean[1])), 1e-9), max(float(np.linalg.norm(mean)), 1e-9)
    # Turned up as much at the upper edge as down at the lower one, for normals are all of one length.
    upright = np.array([-mean[2] * mean[0] / level, -mean[2] * mean[1] / level, level]) / length
    turn = math.sqrt(max(1.0 - length**2, 0.0)) * upright
    both = np.array([mean - turn, mean + turn]) * np.array(size)
    return np.asarray(both / np.linalg.norm(both, axis=1, keepdims=True))


def _panel(side: str, run: _Run, part: tuple[float, float], material: Material, normals: Wide, size: Size) -> Mesh:
    """Part of a run, between two shares of its breadth."""
    across = run.middle[:, None] + (np.array(part) - 0.5) * run.breadth[:, None]
    up = np.repeat(np.array(run.zone)[:, None] / ROWS, 2, axis=1)
    points = placed(side, across, up, np.repeat(run.depth[:, None], 2, axis=1), size)
    return mesh(points, grid_faces(2, 2), np.repeat(normals, 2, axis=0), material)


def _tops(top: Seen, long: Sequence[_Run], wide: Sequence[_Run]) -> Mesh:
    """Level tops of the zones seen from the rear that reach farther than those above them."""
    parts: list[Mesh] = []
    area = 0.0
    for zone in sorted({run.zone for run in wide}, reverse=True):
        x, y = _upper_edge(long, zone[1]), _upper_edge(wide, zone[1])
        footprint = (x[1] - x[0]) * (y[1] - y[0])
        own = (top.depth <= 1.0 - zone[0] / ROWS) & (top.depth >= 1.0 - (zone[1] + 1) / ROWS)
        if area < _STEP * footprint and own.any():
            parts.append(_top(x, y, zone[1] / ROWS, top, own))
        area = max(area, footprint)
    return merge(parts)


def _upper_edge(runs: Sequence[_Run], row: int) -> tuple[float, float]:
    """Ends of what lies below a row's lower edge, from one side (0 … 1)."""
    ends = []
    for run in runs:
        first, last = run.zone
        if first < row <= last:
            share = (row - first) / (last - first)
            middle, half = ((1.0 - share) * pair[0] + share * pair[1] for pair in (run.middle, 0.5 * run.breadth))
            ends += [float(middle - half), float(middle + half)]
    return (min(ends), max(ends)) if ends else (0.5, 0.5)


def _top(x: tuple[float, float], y: tuple[float, float], height: float, top: Seen, own: Mask) -> Mesh:
    right, left = np.array([x, x]), np.array([y, y]).T
    points = placed("top", right, left, np.full((2, 2), 1.0 - height), (1.0, 1.0, 1.0))
    material = PAINT
    if top.paint[own].mean() < 0.5:
        red, green, blue = top.own[own & (top.paint < 0.5)].mean(axis=0).tolist()
        material = Material((red, green, blue))
    return mesh(points, grid_faces(2, 2), np.broadcast_to((0.0, 0.0, 1.0), (4, 3)), material)


def _shadow(size: Size, half_width: float) -> Mesh:
    """Darkness under the body, in its box."""
    shadow = contact_shadow(1.0, half_width, fine=False)
    scale = np.array([-1.0, 1.0, 1.0 / size[2]], np.float32)
    return replace(shadow, positions=shadow.positions * scale)
