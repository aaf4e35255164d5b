"""How bright the face of a sign is in a picture: the light that all of it sends, and what its reflectance adds."""

import math
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.linear_algebra import inverse_of, matrix_product, times

Floats = NDArray[np.float64]

_WHITE, RED, _DARK, YELLOW, _BLUE = 0.66, 0.107, 0.022, 0.42, 0.076
"""Luminous reflectance of the sheeting of signs by day [-]."""


class Outline(Enum):
    """Shape of a face, as the directions of its sides' normals, to the right and down [rad]; a disc has none."""

    DISC = None  # not (), since Python 3.11.2 takes that for no value
    OCTAGON = tuple(math.pi / 4 * i for i in range(8))
    SQUARE = (0.0, math.pi / 2, math.pi, -math.pi / 2)
    DIAMOND = tuple(math.pi / 4 + math.pi / 2 * i for i in range(4))
    TIP_UP = (math.pi / 2, -math.pi / 6, -5 * math.pi / 6)
    TIP_DOWN = (-math.pi / 2, math.pi / 6, 5 * math.pi / 6)


@dataclass(frozen=True, slots=True)
class Layout:
    """A face: areas one within the other, and where a symbol may be that the layout does not know."""

    outline: Outline  # Shape of all areas
    # (float, float): Size relative to the face's and reflectance of each [-], the largest first
    areas: tuple[tuple[float, float], ...]
    # Width and height of the box around the symbol, relative to the face's diameter, and the mean reflectance there
    # beyond that of what it is printed on [-]; about so, for what is printed differs
    symbol: tuple[float, float, float] | None = None


def _disc(
    symbol: tuple[float, float, float], *, field: float = _WHITE, frame: float = RED, ring: float = 0.78
) -> Layout:
    return Layout(Outline.DISC, ((1.0, _WHITE), (0.965, frame), (ring, field)), symbol)


def _warning(symbol: tuple[float, float, float]) -> Layout:
    return Layout(Outline.TIP_UP, ((1.0, _WHITE), (0.965, RED), (0.72, _WHITE)), symbol)


LAYOUTS = {
    "speed_limit": _disc((0.62, 0.46, -0.28)),
    "end_of_speed_limit": _disc((0.64, 0.64, -0.3), frame=_DARK, ring=0.93),
    "end_of_limits": _disc((0.64, 0.64, -0.25), frame=_DARK, ring=0.93),
    "no_overtaking": _disc((0.57, 0.22, -0.45)),
    "no_entry": _disc((0.74, 0.16, _WHITE - RED), field=RED, ring=0.93),
    "variable_speed_limit": Layout(Outline.SQUARE, ((1.0, _DARK),), (0.92, 0.92, 0.3)),
    "stop": Layout(Outline.OCTAGON, ((1.0, _WHITE), (0.94, RED)), (0.8, 0.34, 0.22)),
    "yield": Layout(Outline.TIP_DOWN, ((1.0, _WHITE), (0.965, RED), (0.6, _WHITE))),
    "priority_road": Layout(Outline.DIAMOND, ((1.0, _DARK), (0.97, _WHITE), (0.72, YELLOW))),
    "motorway": Layout(Outline.SQUARE, ((1.0, _WHITE), (0.92, _BLUE)), (0.7, 0.7, 0.15)),
    "warning": _warning((0.09, 0.41, -0.5)),
    **dict.fromkeys(("fog_warning", "slippery", "curve_left", "curve_right", "queue"), _warning((0.4, 0.4, -0.2))),
}
"""Faces by the kind of the sign; an unknown kind is taken for a plain disc."""

UNKNOWN_SIGN = Layout(Outline.DISC, ((1.0, _WHITE),), (0.8, 0.8, 0.0))


def layout_of(kind: str) -> Layout:
    """Face of a kind of sign."""
    return LAYOUTS.get(kind.removeprefix("xodr."), UNKNOWN_SIGN)


_SHARE_STEPS = 0.05
_SHARE_TABLE = np.array([0.5 * math.erfc(-x / math.sqrt(2.0)) for x in np.arange(-5.0, 5.0 + 1e-9, _SHARE_STEPS)])


def _inside(edge_distance: Floats, blur: float) -> Floats:
    """Share of each pixel within an edge that is blurred [-]."""
    return np.asarray(np.interp(edge_distance / blur, np.arange(-5.0, 5.0 + 1e-9, _SHARE_STEPS), _SHARE_TABLE))


def _reach(layout: Layout, right: Floats, down: Floats) -> Floats:
    """Size of the outline through each point over that of the face [-], times the face's radius."""
    directions = layout.outline.value
    if not directions:
        return np.hypot(right, down)
    sides = [right * math.cos(angle) + down * math.sin(angle) for angle in directions]
    # The map's diameter of a triangle is its side, of which the distance of a side from the middle is 1/√12; that of a
    # diamond its diagonal.
    per_radius = {Outline.TIP_UP: math.sqrt(3.0), Outline.TIP_DOWN: math.sqrt(3.0), Outline.DIAMOND: math.sqrt(2.0)}
    return np.asarray(np.max(sides, axis=0) * per_radius.get(layout.outline, 1.0))


def face_maps(
    layout: Layout, right: Floats, down: Floats, radius: float, blur: float, narrowed: float
) -> tuple[Floats, Floats, Floats | None]:
    """Share of each pixel that a face covers, its reflectance there times that, and the share of its symbol's box.

    Takes `right`, `down` (n,) [px], `radius` [px], `blur` [px].
    """
    if layout.outline in (Outline.TIP_UP, Outline.TIP_DOWN):
        # The map's height is that of the middle between tip and base, a quarter of the inscribed circle off its middle.
        down = down + radius * (1.0 if layout.outline is Outline.TIP_DOWN else -1.0) / math.sqrt(12.0)
    reach = _reach(layout, right / narrowed, down)
    covered = _inside(radius - reach, blur)
    light = np.zeros_like(reach)
    for (size, reflectance), (_, outer) in zip(layout.areas, ((0.0, 0.0), *layout.areas), strict=False):
        light += (reflectance - outer) * _inside(size * radius - reach, blur)
    if layout.symbol is None:
        return covered, light, None
    width, height, difference = layout.symbol
    box = _inside(width * radius - np.abs(right) / narrowed, blur) * _inside(height * radius - np.abs(down), blur)
    return covered, light + difference * box, box


_ROUNDS, MARGIN = 2, 1.35
"""Rounds in which the place is refined, and how far around the face the background is seen, over its radius [-]."""

_LEAST_NOISE = 0.15
"""Least standard deviation of a pixel [linear grey levels]."""

_MOST_PIXELS = 1600
"""Pixels that are compared, about; larger faces are sampled."""


EDGES = 0.3
"""Standard deviation of where an edge is seen in single pixels: sampling, sharpening, compression [px]."""

_FIRST_NOISE = 1.0
"""Standard deviation of a pixel before it is measured [linear grey levels]."""

_SYMBOL = 0.12
"""Standard deviation of a symbol's mean light, relative to the picture's there [-]."""

UNKNOWN = 1e6
"""Variance that a face leaves unexplained [linear grey levels²]."""

# Place [px], relative size and blur [px].
_LEAST, _MOST = np.array([-1.5, -1.5, 0.9, 0.3]), np.array([1.5, 1.5, 1.1, 2.0])
_LOOSE = (np.array([0.0, 0.0, 1.0, 0.5]), np.array([0.7, 0.7, 0.03, 0.15]))
"""Place [px], relative size and blur [px] by detection, map and distance, and their standard deviations. The blur has
the pixels' own size in it."""

_PLACED = np.array([0.15, 0.15, 0.015, 0.1])
"""Their standard deviations once the face has been fitted."""

_SEPARABLE = 8.0
"""Radius from which the areas of a face are distinguished [px]; of smaller ones only the mean luminance counts."""

_LAYOUT = 0.005
"""Deviation of a face's reflectance from its layout's, over that of white [-]."""


@dataclass(frozen=True, slots=True)
class Face:
    """What is fitted: a layout, half of its diameter [px], and width over height of a face that is turned [-]."""

    layout: Layout
    radius: float
    narrowed: float

    @property
    def is_even(self) -> bool:
        """Whether it has one reflectance."""
        return len(self.layout.areas) == 1

    def columns(self, right: Floats, down: Floats, state: Floats) -> Floats:
        """What the picture is a sum of: face, background and its slopes, reflectance, symbol; state as in `_LOOSE`."""
        u, v, size, blur = state.tolist()
        radius, blur = size * self.radius, max(blur, 0.2)
        covered, shine, box = face_maps(self.layout, right - u, down - v, radius, blur, self.narrowed)
        bare = 1.0 - covered
        found = [covered, bare, bare * right / self.radius, bare * down / self.radius]
        found += [] if self.is_even else [shine]
        found += [] if box is None else [box]
        return np.stack(found, axis=1)

    def prior(self, seen: Floats, columns: Floats) -> Floats:
        """Inverse variances of the columns' shares before the picture is seen."""
        known = np.zeros(columns.shape[1])
        if self.layout.symbol is not None:
            known[-1] = (_SYMBOL * max(float(np.median(seen)), 1.0)) ** -2.0
        return known


@dataclass(frozen=True, slots=True)
class FaceLight:
    """Luminance of a face as a line through its reflectance: L = black + slope · ρ."""

    # black, slope: luminance at reflectance 0, and what a reflectance of 1 adds [linear grey levels]
    black: float
    slope: float
    variance: tuple[float, ...]  # Variances of both and their covariance
    # Whether the face was too small for its areas to be distinguished, so that only its mean luminance was measured
    is_mean: bool = False


def face_light(
    light: NDArray[np.float32],
    place: tuple[float, float],
    radius: float,
    layout: Layout,
    narrowed: float,
    noise: float,
) -> FaceLight | None:
    """Fit a face of known layout, before a background with an even slope, to a part of a picture.

    By Koschmieder's law the fog turns L0 = E ρ into L = A (1 − T) + E ρ T whatever the reflectance, so white, red and
    dark parts of a face lie on one line; its height and its slope each give the transmittance T.

    Returns None if too little of it is in the picture. Takes `light` (rows, cols) [linear grey levels], `place` (float,
    float) [px], `radius` [px].
    """
    rows, cols = np.mgrid[: light.shape[0], : light.shape[1]].astype(np.float64)
    right, down = (cols - place[0]).ravel(), (rows - place[1]).ravel()
    reach = MARGIN * radius + 2.0
    # Below the face stands its post.
    near = (np.hypot(right, down) < reach) & ~((np.abs(right) < 0.25 * radius + 1.0) & (down > 0.9 * radius))
    picked = np.flatnonzero(near)[:: max(1, round(near.sum() / _MOST_PIXELS))]
    if picked.size < 20:
        return None
    right, down, seen = right[picked], down[picked], light.ravel()[picked].astype(np.float64)
    state, weight = _LOOSE[0], np.full(picked.size, _FIRST_NOISE**-2.0)
    face = Face(layout, radius, narrowed)
    for _ in range(_ROUNDS):
        fit = _placed(seen, right, down, face, state, weight, _LOOSE)
        weight, state = _weights(fit.residual, np.hypot(right, down) / radius, 0.0 * fit.steep, noise), fit.state
    weight = _weights(fit.residual, np.hypot(right, down) / radius, fit.steep, noise)
    fit = _placed(seen, right, down, face, state, weight, (state, _PLACED))
    columns = face.columns(right, down, state)
    # An error of the layout is the same in many pixels: it does not average out as noise does.
    unsure = _LAYOUT * abs(float(fit.solved[1] - fit.solved[0] if face.is_even else fit.solved[4]))
    wider = 1.0 + unsure**2 * float((weight * columns[:, 0]).sum())
    return _line(face, columns, fit.solved, wider * fit.covariance)


def _weights(residual: Floats, reach: Floats, steep: Floats, least: float) -> Floats:
    """Inverse variances of the pixels: what lies behind a sign is less even than its face, and edges are not sharp."""
    inner, outer = (reach < 0.9) & (steep < np.median(steep)), reach > 1.1
    noise = max(float(np.sqrt(np.mean(residual[inner] ** 2))) if inner.any() else 0.0, _LEAST_NOISE, least)
    behind = max(float(np.sqrt(np.mean(residual[outer] ** 2))) if outer.any() else noise, noise)
    return np.asarray(1.0 / (np.where(reach > 1.0, behind, noise) ** 2 + (EDGES * steep) ** 2))


class _Fit(NamedTuple):
    """Shares of the columns and their covariance, residuals, better place, size and blur, and steepness [levels/px]."""

    solved: Floats
    covariance: Floats
    residual: Floats
    state: Floats
    steep: Floats


def _placed(
    seen: Floats,
    right: Floats,
    down: Floats,
    face: Face,
    state: Floats,
    weight: Floats,
    known: tuple[Floats, Floats],
) -> _Fit:
    """Fit the face, and what would place it better; known are its place, size and blur and their deviations."""
    columns = face.columns(right, down, state)
    prior = face.prior(seen, columns)
    first = _least_squares(columns, seen, weight, prior, np.zeros(len(prior)))[0]
    now = times(columns, first)
    changes = []
    for i, by in enumerate((0.1, 0.1, 0.01, 0.05)):
        moved = state.copy()
        moved[i] += by
        changes.append((times(face.columns(right, down, moved), first) - now) / by)
    usual, deviation = known
    target = np.concatenate([np.zeros(len(first)), usual - state])
    whole = np.column_stack([columns, *changes])
    solved, covariance = _least_squares(whole, seen, weight, np.concatenate([prior, deviation**-2.0]), target)
    better = np.clip(state + solved[-4:], _LEAST, _MOST)
    return _Fit(solved, covariance, seen - times(whole, solved), better, np.hypot(changes[0], changes[1]))


def _line(face: Face, columns: Floats, solved: Floats, covariance: Floats) -> FaceLight:
    """Line of luminance over reflectance; only a point of it for even faces, or those too small to separate areas."""
    is_small = face.radius < _SEPARABLE
    if not face.is_even and not is_small:
        return FaceLight(float(solved[0]), float(solved[4]), tuple(covariance[[0, 4, 0], [0, 4, 4]].tolist()))
    # What its areas send together: the mean over all that the face covers.
    shares = np.zeros(len(solved))
    shares[0], areas = 1.0, columns[:, 4:].sum(axis=0) / columns[:, 0].sum()
    shares[4 : columns.shape[1]] = areas
    mean, variance = float((shares * solved).sum()), float((shares * times(covariance, shares)).sum())
    reflectance = face.layout.areas[0][1] if face.is_even else float(areas[0])
    unknown = (variance + reflectance**2 * UNKNOWN, UNKNOWN, -reflectance * UNKNOWN)
    return FaceLight(mean, 0.0, unknown, is_small)


def _least_squares(
    columns: Floats, seen: Floats, weight: Floats, prior: Floats, target: Floats
) -> tuple[Floats, Floats]:
    weighted = columns * weight[:, None]
    normal = np.asarray(matrix_product(weighted.T, columns)) + np.diag(prior)
    covariance = inverse_of(normal)
    return times(covariance, times(weighted.T, seen) + prior * target), covariance
