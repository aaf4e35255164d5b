"""Levels of detail of vehicles that are small in the picture: of few triangles, made from the shapes in full.

A level is a stack of few zones of height. In each zone, from each side, it has as much paint as the shape shows
from there, under the same light, and what is not paint in one panel that is as bright at either edge; its outline
encloses the same area. So each zone has the mean radiance of the shape in any paint, from the rear, the front and the
sides, and what is dark stays dark. Lamps and plates are those of the shape.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.solids import Material, grid_faces, merge, mesh
from fogsim.values.scene import Mesh, Surface
from vehicle_bodies.lamp_patches import drop_unused, lamp_quads
from vehicle_bodies.parts import contact_shadow
from vehicle_bodies.projection import (
    COLUMNS,
    ROWS,
    Projection,
    Size,
    Wide,
    placed,
    project_shape,
    row_sums,
    upwards_of,
)
from vehicle_bodies.solids import PAINT, mirrored
from vehicle_bodies.spans import BEHIND, Part, SideView, Span, divide_into_zones, find_spans, within

Mask = NDArray[np.bool_]
Key = tuple[str, tuple[int, int]]  # side and zone

_NEAR = 0.01  # how deep in the shape lamps and plates may lie that show [units of the box]
_SIDES = ("rear", "front", "left")  # the right one is the mirror image of the left one
_ON_ROAD = 0.02  # height below which a level surface lies on the road [units of the box]
_ROUNDS, _FINE = 2, 2  # rounds of correction, and how many times as fine the body is looked at for them
_BREADTHS, _GAINS = (0.95, 1.05), (0.5, 2.0)  # bounds of corrections
_GREY, _OWN = np.full((2, 3), 0.5), Material((0.5, 0.5, 0.5))  # colours are those of the vertices
_LEVEL_TO = 4  # rows below the top of a zone where the body is still as high
_STEP = 0.9  # a zone whose footprint is smaller than this share of the one below it shows that one's top


@dataclass(frozen=True, slots=True)
class Detail:
    """How much of a body a level shows."""

    zones: Mapping[str, int]  # number of zones of height from the "rear", the "front" and the "left"
    little: float  # share of a zone below which a material is left out there (of which there is more elsewhere, then)


@dataclass(frozen=True, slots=True)
class _Gain:
    """Factors by which a side's panels are made broader, and those of paint and of other materials brighter."""

    breadth: float
    paint: float
    own: Wide


def levels_of_detail(shape: Mesh, size: Size, details: Sequence[Detail], shadow: float) -> list[Mesh]:
    """Levels of detail of a body, with its lamps and plates."""
    body, kept = _without_shadow(shape), merge((lamp_quads(shape), _sheeting(shape)))
    looks = {side: _side_view(side, body, kept, size) for side in _SIDES}
    top, rest = project_shape("top", body, size), merge((kept, _shadow(size, shadow)))
    wanted = {side: _row_sums(side, shape, size) for side in _SIDES}
    return [_matched(looks, wanted, top, detail, rest, size) for detail in details]


def _matched(
    looks: Mapping[str, SideView],
    wanted: Mapping[str, Wide],
    top: Projection,
    detail: Detail,
    rest: Mesh,
    size: Size,
) -> Mesh:
    """Level that covers as much as the body from each side, with as much light: built, looked at and corrected."""
    left = looks["left"].seen
    runs: dict[str, list[Span]] = {}
    for side, look in looks.items():
        zones = divide_into_zones(side, look.seen, left, size, detail.zones[side])
        own = [run for zone in zones for run in find_spans(look, zone, detail.little)]
        runs[side] = own if side != "left" else [within(run, looks["rear"].seen) for run in own]
    gains = {(side, run.zone): _Gain(1.0, 1.0, np.ones(3)) for side, own in runs.items() for run in own}
    rest = merge((_tops(top, runs["left"], runs["rear"]), rest))
    for _ in range(_ROUNDS):
        whole = _built(runs, gains, rest, size)
        got = {side: _row_sums(side, whole, size) for side in looks}
        for (side, zone), gain in gains.items():
            # What is seen where no zone is belongs to the next one below.
            end = min((run.zone[0] for run in runs[side] if run.zone[0] > zone[0]), default=ROWS)
            rows = slice(_FINE * zone[0], _FINE * end)
            gains[side, zone] = _corrected(gain, wanted[side][rows].sum(axis=0), got[side][rows].sum(axis=0))
    return _built(runs, gains, rest, size)


def _built(runs: Mapping[str, Sequence[Span]], gains: Mapping[Key, _Gain], rest: Mesh, size: Size) -> Mesh:
    panels = {
        side: merge([panel for run in own for panel in _panels(side, run, gains[side, run.zone], size)])
        for side, own in runs.items()
    }
    return merge((*panels.values(), mirrored(panels["left"]), rest))


def _corrected(gain: _Gain, want: Wide, got: Wide) -> _Gain:
    """Factors that would have given the area and the light (see `row_sums`) that the body has in a zone."""
    area, paint, *own = np.maximum(want, 1e-9) / np.maximum(got, 1e-9)
    # Broader panels have more light, too.
    return _Gain(
        float(np.clip(gain.breadth * area, *_BREADTHS)),
        float(np.clip(gain.paint * paint / area, *_GAINS)),
        np.clip(gain.own * own / area, *_GAINS),
    )


def _row_sums(side: str, shape: Mesh, size: Size) -> Wide:
    return row_sums(project_shape(side, shape, size, _FINE))


def _side_view(side: str, body: Mesh, kept: Mesh, size: Size) -> SideView:
    seen = project_shape(side, body, size)
    return SideView(side, seen, _over(side, kept, seen, size))


def _without_shadow(shape: Mesh) -> Mesh:
    """The shape without what lies on the road."""
    low, upwards = shape.positions[:, 2] < _ON_ROAD, shape.normals[:, 2] > 1.0 - 1e-6
    return drop_unused(replace(shape, faces=shape.faces[~(low & upwards)[shape.faces].all(axis=1)]))


def _over(side: str, kept: Mesh, seen: Projection, size: Size) -> Projection:
    """What is kept, where it is not hidden by the shape itself."""
    over = project_shape(side, kept, size)
    shown = over.depth <= seen.depth + _NEAR
    hidden = np.where(shown, over.depth, np.inf)
    return replace(over, depth=hidden, own=over.own * shown[..., None])


def _sheeting(shape: Mesh) -> Mesh:
    """Plates and other sheeting, which sends lamplight back."""
    own = shape.surface[shape.faces[:, 0]] == Surface.SHEETING
    return drop_unused(replace(shape, faces=shape.faces[own]))


def _panels(side: str, run: Span, gain: _Gain, size: Size) -> list[Mesh]:
    """Panels of a run, that behind first: one of what is not paint, and one of paint."""
    run = replace(run, breadth=run.breadth * gain.breadth)
    panels = []
    for place, (kind, part) in enumerate(reversed(run.parts.items())):
        colour, normal, upwards = np.clip(gain.own * run.colour, 0.005, 0.9), run.normals[0], run.normals[0][[2, 2]]
        if kind == "paint":
            colour, normal, upwards = _GREY, run.normals[1], upwards_of(gain.paint * run.light)
        behind = replace(run, depth=run.depth + place * BEHIND)
        panels.append(_panel(side, behind, part, kind == "paint", colour, _normals(side, normal, upwards, size), size))
    return panels


def _normals(side: str, mean: Wide, upwards: Wide, size: Size) -> Wide:
    """Normals at the lower and the upper edge of a panel (2, 3), in the box: to where the mean is, with these z."""
    level = mean[:2] * ((0.0, 1.0) if side == "left" else (1.0, 0.0))  # the same on both sides of the body
    level /= max(float(np.abs(level).sum()), 1e-9)
    z = np.clip(upwards, -0.99, 0.99)
    both = np.column_stack((np.sqrt(1.0 - z**2)[:, None] * level, z)) * np.array(size)
    return np.asarray(both / np.linalg.norm(both, axis=1, keepdims=True))


def _panel(side: str, run: Span, part: Part, painted: bool, colour: Wide, normals: Wide, size: Size) -> Mesh:
    """Part of a run, of the colour and with the normals that are given at the lower and upper edge of the run."""
    across, up = part
    middle, breadth, depth, row = (_between(pair, up) for pair in (run.middle, run.breadth, run.depth, run.zone))
    right = middle[:, None] + (np.array(across) - 0.5) * breadth[:, None]
    points = placed(side, right, np.repeat(row[:, None] / ROWS, 2, axis=1), np.repeat(depth[:, None], 2, axis=1), size)
    colours, directions = (
        np.repeat(np.stack([_between(column, up) for column in ends.T], axis=1), 2, axis=0)
        for ends in (colour, normals)
    )
    return mesh(points, grid_faces(2, 2), directions, PAINT if painted else _OWN, reflectance=colours)


def _between(ends: Wide | tuple[int, int], shares: tuple[float, float]) -> Wide:
    return np.interp(shares, (0.0, 1.0), ends)


def _tops(top: Projection, long: Sequence[Span], wide: Sequence[Span]) -> Mesh:
    """Level tops of the zones seen from the rear that reach farther than those above them."""
    parts: list[Mesh] = []
    area = 0.0
    for zone in sorted({run.zone for run in wide}, reverse=True):
        x, y = _upper_edge(long, zone[1]), _upper_edge(wide, zone[1])
        footprint = (x[1] - x[0]) * (y[1] - y[0])
        own = (top.depth <= 1.0 - zone[0] / ROWS) & (top.depth >= 1.0 - (zone[1] + 1) / ROWS)
        if area < _STEP * footprint and own.any():
            # Where the body is lower, as a cab is before its box, one would see the inner side of this from there.
            high = own & (top.depth <= 1.0 - (zone[1] - _LEVEL_TO) / ROWS)
            there = np.flatnonzero((high if high.any() else own).any(axis=0)) / COLUMNS
            x = max(x[0], there[0]), min(x[1], there[-1])
            parts.append(_top(x, y, zone[1] / ROWS, top, own))
        area = max(area, footprint)
    return merge(parts)


def _upper_edge(runs: Sequence[Span], row: int) -> tuple[float, float]:
    """Ends of what lies below a row's lower edge, from one side (0 … 1)."""
    ends = []
    for run in runs:
        first, last = run.zone
        if first < row <= last:
            share = (row - first) / (last - first)
            middle, half = ((1.0 - share) * pair[0] + share * pair[1] for pair in (run.middle, 0.5 * run.breadth))
            ends += [float(middle - half), float(middle + half)]
    return (min(ends), max(ends)) if ends else (0.5, 0.5)


def _top(x: tuple[float, float], y: tuple[float, float], height: float, top: Projection, own: Mask) -> Mesh:
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
