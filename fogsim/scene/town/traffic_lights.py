"""Traffic lights: posts that stand, heads whose lit lenses change, and the light of those."""

import math
from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.roadside import placed
from fogsim.scene.solids import Material, box, disc, merge, mesh
from fogsim.scene.town.persons import rod
from fogsim.units import luminance_of
from fogsim.values.light import (
    SIGNAL_COLOURS,
    SIGNAL_DIAMETER,
    SIGNAL_INTENSITY,
    Beam,
    LampLobes,
    LightSources,
    SignalLight,
)
from fogsim.values.road import SignalHead
from fogsim.values.scene import FAR, MIDDLE, SPECK, TINY, Batch, Instance, Mesh, Surface
from fogsim.values.traffic import SignalColour, SignalState

HEAD, _POST, _ARM, _WALK = "signal_head", "signal_post", "signal_arm", "signal_walk"
"""Names of the shapes: a head of lenses of 1 m, a post of 1 m height, an arm of 1 m length, a head for persons."""

_CELL = 1.5  # height and width of a lens's part of the housing, in diameters
_ABOVE = 0.25  # of posts over the middle of their head or arm [m]
_BESIDE = 0.3  # arms are for heads farther next to their post than this [m]
_BEHIND = 0.32  # from the lenses to posts and arms, which are behind the heads [m]
_IN_FRONT = 0.1  # of the light before the lens [m]

_BLACK, _STEEL = Material((0.018, 0.018, 0.018)), Material((0.17, 0.175, 0.18))
_RIM = Material((0.55, 0.55, 0.54))
_LENSES = (
    (SignalLight.RED, 1.0, Material((0.075, 0.008, 0.007), Surface.LENS_RED)),
    (SignalLight.YELLOW, 0.0, Material((0.080, 0.045, 0.006), Surface.LENS_YELLOW)),
    (SignalLight.GREEN, -1.0, Material((0.008, 0.055, 0.035), Surface.LENS_GREEN)),
)
"""Of each lens: its bit, its place in cells above the middle, and its material while dark."""


_FIGURE_SHARE = 0.3
"""Of a lens's face and light, what is the figure that persons see [-]."""

_BLINK = 1.0  # period of what blinks, which is lit in the first half [s]
_LIT = {
    SignalColour.RED: SignalLight.RED,
    SignalColour.RED_YELLOW: SignalLight.RED | SignalLight.YELLOW,
    SignalColour.YELLOW: SignalLight.YELLOW,
    SignalColour.GREEN: SignalLight.GREEN,
    SignalColour.GREEN_ARROW: SignalLight.RED,
    SignalColour.BLINKING: SignalLight.YELLOW,
    SignalColour.OFF: SignalLight.DARK,
}
"""Lit lenses; a green arrow is a plate next to the red light."""


def signal_shapes() -> dict[str, Mesh]:
    """Shapes of heads, which look to −x, and of posts and arms, with their levels of detail."""
    levels = (("", 20, True), (MIDDLE, 10, True), (FAR, 6, False), (TINY, 4, False))
    heads = {HEAD + ending: _head(sides, visors) for ending, sides, visors in levels}
    walks = {_WALK + ending: _walk(sides) for ending, sides, _ in (*levels, (SPECK, 4, False))}
    posts = {_POST + ending: _post(sides) for ending, sides in (("", 12), (MIDDLE, 6), (FAR, 4))}
    arms = {_ARM + ending: _arm(sides) for ending, sides in (("", 10), (MIDDLE, 6), (FAR, 4))}
    return {**heads, HEAD + SPECK: _head(4, False), **walks, **posts, **arms}


def _head(sides: int, visors: bool) -> Mesh:
    half, high = 0.5 * _CELL, 1.5 * _CELL
    # A contrast board with a light rim, so that the head stands out before sky and trees alike.
    parts = [
        box((0.0, -half, -high), (0.9, half, high), _BLACK),
        box((0.10, -1.25, -high - 0.45), (0.14, 1.25, high + 0.45), _BLACK),
        box((0.15, -1.36, -high - 0.56), (0.17, 1.36, high + 0.56), _RIM),
    ]
    for _, place, lens in _LENSES:
        centre = (-0.02, 0.0, place * _CELL)
        parts.append(disc(centre, 0.5, (0.0, -1.0, 0.0), (0.0, 0.0, 1.0), lens, sides=sides))
        if visors:
            parts.append(_visor(place * _CELL, sides))
    return merge(parts)


def _walk(sides: int) -> Mesh:
    """Head for persons: a standing red figure above a striding green one."""
    parts = [box((0.0, -0.5 * _CELL, -_CELL), (0.6, 0.5 * _CELL, _CELL), _BLACK)]
    for light, place, lens in _LENSES:
        if light is not SignalLight.YELLOW:
            middle, stride = 0.5 * place * _CELL, 0.2 if light is SignalLight.GREEN else 0.16
            parts.append(disc((-0.02, 0.0, middle + 0.33), 0.11, (0.0, -1.0, 0.0), (0.0, 0.0, 1.0), lens, sides=sides))
            corners = ((0.14, 0.18), (-0.14, 0.18), (-stride, -0.45), (stride, -0.45))
            points = np.array([(-0.02, y, middle + z) for y, z in corners])
            normals = np.tile((-1.0, 0.0, 0.0), (4, 1))
            parts.append(mesh(points, np.array([(0, 1, 2), (0, 2, 3)]), normals, lens))
    return merge(parts)


def _visor(middle: float, sides: int) -> Mesh:
    """Hood over a lens, open below."""
    angle = np.linspace(-0.15 * np.pi, 1.15 * np.pi, sides)
    rim = np.column_stack((np.zeros(sides), np.cos(angle), np.sin(angle)))
    rows = np.stack([(x, 0.0, middle) + 0.56 * rim for x in (0.0, -0.95)])
    corner = np.arange(sides - 1)
    faces = np.concatenate(
        [
            np.stack(own, axis=1)
            for own in ((corner, corner + 1, corner + sides), (corner + 1, corner + sides + 1, corner + sides))
        ]
    )
    return mesh(rows, faces, np.concatenate((rim, rim)), _BLACK)


def _post(sides: int) -> Mesh:
    return rod(((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), ((0.075, 0.075), (0.06, 0.06)), sides, _STEEL)


def _arm(sides: int) -> Mesh:
    return rod(((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), ((0.07, 0.07), (0.045, 0.045)), sides, _STEEL)


def signal_posts(heads: Sequence[SignalHead]) -> list[Batch]:
    """Posts of all heads, with arms where heads are above the road."""
    by_post: dict[tuple[float, float, float], list[SignalHead]] = {}
    for head in heads:
        by_post.setdefault(head.post, []).append(head)
    if not by_post:
        return []
    places, heights, arms = [], [], []
    for post, own in by_post.items():
        behind = _BEHIND * np.array([math.cos(own[0].heading), math.sin(own[0].heading)])
        foot = (post[0] + behind[0], post[1] + behind[1], post[2] - 0.3)
        places.append(foot)
        heights.append(max(head.position[2] for head in own) + _ABOVE - foot[2])
        farthest = max(own, key=lambda head: math.dist(head.position[:2], head.post[:2]))
        x, y = farthest.position[0] - post[0], farthest.position[1] - post[1]
        if math.hypot(x, y) > _BESIDE:
            arms.append((foot[0], foot[1], farthest.position[2], math.atan2(y, x), math.hypot(x, y) + 0.3))
    size = np.column_stack((np.ones((len(places), 2)), heights))
    batches = [placed(_POST, np.array(places), np.zeros(len(places)), size)]
    if arms:
        reach = np.array(arms)
        size = np.column_stack((reach[:, 4], np.ones((len(arms), 2))))
        batches.append(placed(_ARM, reach[:, :3], reach[:, 3], size))
    return batches


def signal_batches(signals: SignalState, time: float) -> tuple[Batch, ...]:
    """Heads of traffic lights with their lit lenses (`time` [s])."""
    if not signals.ids:
        return ()
    size, lit = np.repeat(signals.diameter[:, None], 3, axis=1), _lit(signals, time)
    on_foot = _on_foot(signals)
    batches = []
    for shape, rows in ((HEAD, np.flatnonzero(~on_foot)), (_WALK, np.flatnonzero(on_foot))):
        if len(rows):
            there = signals.position[rows], signals.heading[rows], size[rows]
            heads = placed(shape, *there, instance=Instance.TRAFFIC_LIGHT)
            batches.append(Batch(shape, heads.transforms, heads.paint, lit[rows], heads.instance))
    return tuple(batches)


def _on_foot(signals: SignalState) -> NDArray[np.bool_]:
    """Which heads speak to persons."""
    return signals.on_foot if len(signals.on_foot) else np.zeros(len(signals.ids), np.bool_)


def _lit(signals: SignalState, time: float) -> NDArray[np.int32]:
    """Lit lenses of each head, bits of `SignalLight`."""
    dark = {SignalColour.BLINKING} if time % _BLINK >= 0.5 * _BLINK else set()
    return np.array([0 if colour in dark else int(_LIT[colour]) for colour in signals.colour], np.int32)


def signal_light_sources(signals: SignalState, eye: NDArray[np.float64], time: float) -> LightSources:
    """Lit lenses that shine toward an eye (`eye` (3,) [m], `time` [s])."""
    lights = _lit(signals, time)
    ahead = np.column_stack((np.cos(signals.heading), np.sin(signals.heading), np.zeros(len(signals.ids))))
    parts = []
    for bit, place, _ in _LENSES:
        lit = np.flatnonzero(lights & int(bit))
        middle = signals.position[lit] - _IN_FRONT * ahead[lit]
        walked = _on_foot(signals)[lit]
        middle[:, 2] += np.where(walked, 0.5 * place, place) * _CELL * signals.diameter[lit]
        to_lens = middle - eye
        forward = np.einsum("ij,ij->i", to_lens, ahead[lit])
        left = to_lens[:, 1] * ahead[lit, 0] - to_lens[:, 0] * ahead[lit, 1]
        share = directed_share(np.arctan2(left, forward), np.arctan2(to_lens[:, 2], np.hypot(forward, left)))
        intensity = SIGNAL_INTENSITY * (signals.diameter[lit] / SIGNAL_DIAMETER) ** 2 * share
        face = np.where(walked, _FIGURE_SHARE, 1.0)
        intensity, surface = intensity * face, math.pi / 4.0 * face
        area = surface * signals.diameter[lit] ** 2 * np.maximum(forward, 0.0) / np.linalg.norm(to_lens, axis=1)
        seen = intensity > 1e-3
        colour = SIGNAL_COLOURS[bit]
        tint = np.tile(np.array(colour) / luminance_of(colour), (int(seen.sum()), 1))
        full = SIGNAL_INTENSITY * (signals.diameter[lit] / SIGNAL_DIAMETER) ** 2 * face
        parts.append((middle[seen], intensity[seen], tint, area[seen], full[seen], -ahead[lit][seen]))
    middle, intensity, tint, area, full, facing = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    lobes = LampLobes((_lens(),), np.zeros(len(full), np.int64), full / SIGNAL_INTENSITY, facing)
    return LightSources(middle, intensity, tint, area, lobes)


@cache
def _lens() -> Beam:
    """How a lens of 200 mm shines; directions above its axis count as its axis."""
    azimuth, elevation = np.radians(np.linspace(-90.0, 90.0, 61)), np.radians(np.linspace(-90.0, 30.0, 61))
    share = directed_share(*np.broadcast_arrays(azimuth, -elevation[:, None]))
    return Beam(azimuth, elevation, SIGNAL_INTENSITY * share)


def directed_share(aside: NDArray[np.float64], below: NDArray[np.float64]) -> NDArray[np.float64]:
    """Share of its full intensity that a lens shines in directions, for eyes in front of it [-].

    As ITE asks at least (VTCSH LED Circular Signal Supplement 2005, 4.1.1: horizontal and vertical factor), in full to
    eyes that are higher than 2.5° below the lens, as those of drivers far away are.

    Takes `aside`, `below` (n,) [rad].
    """
    beside, down = np.degrees(aside), np.degrees(below)
    horizontal = 0.05 + 0.95 * np.exp(-0.5 * (beside / 11.0) ** 2)
    vertical = np.where(down > 2.5, 0.26 - down / 143.0 + 0.76 * np.exp(-0.007 * (down - 2.5) ** 2), 1.0)
    return np.asarray(np.where(np.abs(beside) < 90.0, horizontal * np.clip(vertical, 0.0, 1.0), 0.0))
