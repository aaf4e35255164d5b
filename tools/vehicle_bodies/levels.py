"""Levels of detail of vehicles that are small in the picture: of few triangles, made from the shapes in full.

A level is a stack of few zones of height. In each zone, from each side, it has as much paint as the shape shows
from there, under the same light, and what is not paint in one panel of its mean colour; its outline encloses the same
area. So it has the mean radiance of the shape in any paint, from the rear, the front and the sides. Lamps and plates
are those of the shape.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.solids import Material, grid_faces, merge, mesh
from fogsim.values.scene import Mesh, Surface
from vehicle_bodies.lamp_patches import drop_unused, lamp_quads
from vehicle_bodies.parts import contact_shadow
from vehicle_bodies.projection import ROWS, Projection, Size, placed, project_shape, sum_light, upwards_of
from vehicle_bodies.solids import PAINT, mirrored
from vehicle_bodies.spans import BEHIND, SideView, Span, divide_into_zones, find_spans, within

Wide = NDArray[np.float64]
Mask = NDArray[np.bool_]

_NEAR = 0.01  # how deep in the shape lamps and plates may lie that show [units of the box]
_SIDES = ("rear", "front", "left")  # the right one is the mirror image of the left one
_ON_ROAD = 0.02  # height below which a level surface lies on the road [units of the box]
_ROUNDS, _FINE = 2, 2  # rounds of correction, and how many times as fine the body is looked at for them
_BREADTHS, _GAINS = (0.95, 1.05), (0.5, 2.0)  # bounds of corrections
_STEP = 0.9  # a zone whose footprint is smaller than this share of the one below it shows that one's top


@dataclass(frozen=True, slots=True)
class Detail:
    """How much of a body a level shows.

    Attributes
    ----------
    zones : mapping from str to int
        Number of zones of height from the "rear", the "front" and the "left".
    little : float
        Share of a zone below which a material is left out there (it is then more frequent elsewhere).
    """

    zones: Mapping[str, int]
    little: float


@dataclass(frozen=True, slots=True)
class _Gain:
    """Factors by which a side's panels are made broader, and those of paint and of other materials brighter."""

    breadth: float
    paint: float
    own: Wide


def levels_of_detail(shape: Mesh, size: Size, details: Sequence[Detail], shadow: float) -> list[Mesh]:
    """Levels of detail of a body, with its lamps and plates.

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
    looks = {side: _side_view(side, body, kept, size) for side in _SIDES}
    top, rest = project_shape("top", body, size), merge((kept, _shadow(size, shadow)))
    wanted = {side: _totals(side, shape, size) for side in _SIDES}
    return [_matched(looks, wanted, top, detail, rest, size) for detail in details]


def _matched(
    looks: Mapping[str, SideView],
    wanted: Mapping[str, Sequence[float]],
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
    gains = dict.fromkeys(looks, _Gain(1.0, 1.0, np.ones(3)))
    rest = merge((_tops(top, runs["left"], runs["rear"]), rest))
    for _ in range(_ROUNDS):
        whole = _built(runs, gains, rest, size)
        gains = {side: _corrected(gain, wanted[side], _totals(side, whole, size)) for side, gain in gains.items()}
    return _built(runs, gains, rest, size)


def _built(
    runs: Mapping[str, Sequence[Span]],
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
    """Factors that would have given the area and the light (see `sum_light`) that the body has."""
    area, paint, *own = np.array(want) / np.maximum(got, 1e-9)
    # Broader panels have more light, too.
    return _Gain(
        float(np.clip(gain.breadth * area, *_BREADTHS)),
        float(np.clip(gain.paint * paint / area, *_GAINS)),
        np.clip(gain.own * own / area, *_GAINS),
    )


def _totals(side: str, shape: Mesh, size: Size) -> tuple[float, ...]:
    seen = project_shape(side, shape, size, _FINE)
    return sum_light(seen.depth, seen.normal, seen.paint, seen.own)


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
        behind = replace(broader, depth=broader.depth + BEHIND * split)
        panels.append(_panel(side, behind, (0.0, 1.0), PAINT, normals, size))
    return panels


def _normals(side: str, mean: Wide, upwards: float, size: Size) -> Wide:
    """Normals at the lower and the upper edge of a panel (2, 3), in the box.

    Their mean is the given one with another z, which says how much light there is.
    """
    mean = mean.copy()
    mean[1 if side != "left" else 0] = 0.0  # the same on both sides of the body
    mean[2] = np.clip(upwards, -0.99, 0.99)
    level = float(np.hypot(mean[0], mean[1]))
    mean[:2] *= min(1.0, math.sqrt(1.0 - mean[2] ** 2) / max(level, 1e-9))
    level, length = max(float(np.hypot(mean[0], mean[1])), 1e-9), max(math.hypot(*mean), 1e-9)
    # Turned up as much at the upper edge as down at the lower one, for normals are all of one length.
    upright = np.array([-mean[2] * mean[0] / level, -mean[2] * mean[1] / level, level]) / length
    turn = math.sqrt(max(1.0 - length**2, 0.0)) * upright
    both = np.array([mean - turn, mean + turn]) * np.array(size)
    return np.asarray(both / np.linalg.norm(both, axis=1, keepdims=True))


def _panel(side: str, run: Span, part: tuple[float, float], material: Material, normals: Wide, size: Size) -> Mesh:
    """Part of a run, between two shares of its breadth."""
    across = run.middle[:, None] + (np.array(part) - 0.5) * run.breadth[:, None]
    up = np.repeat(np.array(run.zone)[:, None] / ROWS, 2, axis=1)
    points = placed(side, across, up, np.repeat(run.depth[:, None], 2, axis=1), size)
    return mesh(points, grid_faces(2, 2), np.repeat(normals, 2, axis=0), material)


def _tops(top: Projection, long: Sequence[Span], wide: Sequence[Span]) -> Mesh:
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
