"""Which sources have a halo, where it points, and how light falls off along it: gallen2014 section III-B, step 3."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.vision.light.pixel_kernels import Pixels
from fogsim.vision.sources import tree_kernels
from fogsim.vision.sources.tree_kernels import (
    AREA,
    BOTTOM,
    LEFT,
    MEASURES,
    RIGHT,
    SUM_U,
    SUM_UU,
    SUM_UV,
    SUM_V,
    SUM_VV,
    TOP,
)

_SEED_SHARE, _LEAST_SEED = 0.94, 160
"""First threshold over the brightest pixel of the picture [-], and the least that it may be [levels of 255]."""

_LAST_SHARE, _THRESHOLDS = 0.35, 32
"""Last threshold over the first [-], and how many there are, even in level as the paper's."""

_LEAST_AREA, _LARGEST_SHARE = 6.0, 0.06
"""Fewest pixels of a source, since noise makes specks of a few [px], and the most as a share of the picture [-]."""

_MOST_ELONGATED, _LEAST_COMPACT = 2.5, 0.75
"""Longest axis of a source over its shortest, and its area over that of an ellipse of the same second moments [-].

The border of a source is rough where noise carries pixels over the threshold, so that its length is meaningless.
"""

_MOST_COMPONENTS, _MOST_SOURCES = 256, 48
"""How many bright components are looked at, and how many of them, the largest, may be sources."""

_BRIGHT_SHARE = 0.08
"""Share of the picture from which on bright pixels are no lamps but daylight or a picture that is saturated [-]."""

GROWTH = 5.0
"""Growth from one threshold to the next from which on a component has met something bright (the paper's) [-]."""

_LARGEST_HALO, _BUDGET = 0.08, 0.12
"""Shares of the picture that one halo may cover, and that are looked at in all [-]."""


@dataclass(frozen=True, slots=True)
class SourceTree:
    """Sources of light, and how their components grow while the threshold falls."""

    level: NDArray[np.uint8]  # (rows, cols) uint8: The picture: its brightest channel in 8 bits
    thresholds: NDArray[np.int64]  # (t,) int64: Falling [levels of 255]
    # What is known of each source's component at each threshold (`fogsim.vision.sources.tree_kernels`); the first row
    # are the leaves
    nodes: NDArray[np.float64]
    # (n,) int64: Last threshold at which a source's component was its own and had not leaked into something bright; −1
    # for none
    last: NDArray[np.int64]
    # (n,) int64: Source with whose branch each source's merged, itself where it did with none
    merged_into: NDArray[np.int64]
    leaked: NDArray[np.bool_]  # (n,) bool: Whether a branch ended because it grew too fast or too large
    trouble: str = ""  # Why there can be no source, or nothing

    def __len__(self) -> int:
        """How many sources there are."""
        return len(self.last)

    def centres(self, source: int) -> NDArray[np.float64]:
        """Centres of gravity along a branch (t, 2), columns and rows [px]."""
        branch = self.nodes[: max(int(self.last[source]), 0) + 1, source]
        return branch[:, [SUM_U, SUM_V]] / branch[:, AREA, None]

    def areas(self, source: int) -> NDArray[np.float64]:
        """Areas along a branch (t,) [px]."""
        return self.nodes[: max(int(self.last[source]), 0) + 1, source, AREA]

    def box(self, source: int, threshold: int) -> tuple[float, float, float, float]:
        """Left, right, top and bottom of a source's component at a threshold [px]."""
        left, right, top, bottom = self.nodes[threshold, source, [LEFT, RIGHT, TOP, BOTTOM]].tolist()
        return left, right, top, bottom


def source_tree(image: Pixels, bits: int = 8) -> SourceTree:
    """Find what may be lamps in a picture, and follow their halos down (`image` (rows, cols))."""
    layers = np.ascontiguousarray(image if image.ndim == 3 else image[:, :, None])
    level = tree_kernels.brightest_channel(layers, bits - 8)
    brightest = int(level.max())
    first = math.ceil(_SEED_SHARE * brightest)
    if first < _LEAST_SEED:
        return _no_tree(level, f"no lamp: the brightest pixel has {brightest} levels of 255")
    most = int(_BRIGHT_SHARE * level.size)
    label, found = tree_kernels.find_components(level, first, _MOST_COMPONENTS, most)
    if not len(found):
        return _no_tree(
            level, f"more than {_BRIGHT_SHARE:.0%} of the picture is as bright as lamps: daylight, or saturated"
        )
    kept = _potential_sources(found, level.size)
    if not len(kept):
        return _no_tree(level, "nothing bright has the shape of a lamp")
    _renumber(label, found, kept)
    thresholds = np.unique(np.linspace(_LAST_SHARE * first, first, _THRESHOLDS).round().astype(np.int64))[::-1].copy()
    of_level = np.searchsorted(-thresholds, -np.arange(256), side="left")
    limits = tree_kernels.Limits(GROWTH, _LARGEST_HALO * level.size, int(_BUDGET * level.size))
    flooded = tree_kernels.flood(level, label, np.ascontiguousarray(found[kept]), of_level, limits)
    return SourceTree(level, thresholds, *flooded)


def _no_tree(level: NDArray[np.uint8], trouble: str) -> SourceTree:
    none = np.zeros(0, np.int64)
    return SourceTree(level, none, np.zeros((0, 0, MEASURES)), none, none, none > 0, trouble)


def _potential_sources(found: NDArray[np.float64], pixels: int) -> NDArray[np.int64]:
    """Numbers of the components that are small, round and whole enough for a lamp: the largest of them, in order."""
    area = found[:, AREA]
    fits = (area >= _LEAST_AREA) & (area <= _LARGEST_SHARE * pixels)
    fits &= (_elongation(found) <= _MOST_ELONGATED) & (_compactness(found) >= _LEAST_COMPACT)
    kept = np.flatnonzero(fits)
    return np.sort(kept[np.argsort(-area[kept], kind="stable")[:_MOST_SOURCES]])


def _axes(found: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Variances of components along their longest and shortest axes, by the second moments of their pixels [px²]."""
    area = found[:, AREA]
    u, v = found[:, SUM_U] / area, found[:, SUM_V] / area
    # A pixel is a square, with a variance of its own.
    uu = found[:, SUM_UU] / area - u * u + 1.0 / 12.0
    vv = found[:, SUM_VV] / area - v * v + 1.0 / 12.0
    uv = found[:, SUM_UV] / area - u * v
    middle, spread = 0.5 * (uu + vv), np.hypot(0.5 * (uu - vv), uv)
    return middle + spread, np.maximum(middle - spread, 1e-9)


def _elongation(found: NDArray[np.float64]) -> NDArray[np.float64]:
    """Longest over shortest axis of components [-]."""
    longest, shortest = _axes(found)
    return np.sqrt(longest / shortest)


def _compactness(found: NDArray[np.float64]) -> NDArray[np.float64]:
    """Area of components over that of ellipses with the same second moments: 1 for a disk, 0.95 for a square [-]."""
    longest, shortest = _axes(found)
    return np.asarray(found[:, AREA] / (4.0 * math.pi * np.sqrt(longest * shortest)))


def _renumber(label: NDArray[np.int32], found: NDArray[np.float64], kept: NDArray[np.int64]) -> None:
    """Number the sources from 1 on, and free the pixels of what is none."""
    numbers = np.zeros(len(found) + 1, np.int32)
    numbers[kept + 1] = np.arange(1, len(kept) + 1)
    # Boxes may overlap, so that each is written once: what is renumbered goes below zero first.
    boxes = [(slice(int(one[TOP]), int(one[BOTTOM]) + 1), slice(int(one[LEFT]), int(one[RIGHT]) + 1)) for one in found]
    for number, box in enumerate(boxes, 1):
        part = label[box]
        part[part == number] = -numbers[number]
    for box in boxes:
        np.abs(label[box], out=label[box])


UP = (0.0, -1.0)
"""Direction of a halo that drifts nowhere: away from the road [px]."""

_LEAST_DRIFT = 0.5
"""Drift of the centre below which a halo has no direction of its own [px]."""

_JUMP, _STRAIGHTNESS = 0.5, 0.4
"""Step of a centre over the radius of its component, and its drift over its way: where a step is larger and this less
a centre wanders [-]."""

_LEAST_FALL = 0.2
"""How far the threshold falls at least before a source leaks or merges with a much larger one, over the first [-]."""

REACH = 0.12
"""Length of a profile over the width of the picture [-]."""

_RISE = 8.0
"""A profile ends where it has risen by so much above its lowest: there is another source [levels of 255]."""

_SATURATED = 0.98
"""Level over the largest along a profile down to which a sensor counts as saturated [-]."""

_MOST_HEIGHT = 127.5
"""H50 of a lamp that saturates before the dark [levels of 255]."""

_NARROWEST = 0.25
"""Width below which no flank is resolved [px]."""


@dataclass(frozen=True, slots=True)
class Halo:
    """One source's halo."""

    source: int  # Its number in the tree
    # u, v: centre of the source [px]
    u: float
    v: float
    direction: tuple[float, float]  # Unit vector along which the halo points [px]
    profile: NDArray[np.float64]  # (n,): Level at whole pixels from the centre along it [levels of 255]
    height: float  # H50, half of the decrease [levels of 255]
    width: float  # W50, from the end of saturation to where half of the decrease is reached [px]

    @property
    def steepness(self) -> float:
        """Br50 = H50 / W50 [levels of 255 a pixel]: small in fog."""
        return self.height / self.width

    @property
    def sharpness(self) -> float:
        """Br50 times H50 over what that can be [levels of 255 a pixel]: large for lamps that stand out of the dark."""
        return self.steepness * self.height / _MOST_HEIGHT


def halos_of(tree: SourceTree) -> tuple[Halo, ...]:
    """Halos of the sources that are selected."""
    found = (_halo_of(tree, source) for source in range(len(tree)) if is_selected(tree, source))
    return tuple(one for one in found if one is not None)


def is_selected(tree: SourceTree, source: int) -> bool:
    """Whether a branch is that of a lamp: it grows in small steps, and its centre stays or drifts one way."""
    last = int(tree.last[source])
    if last < 0:
        return False
    soon = tree.thresholds[last] > (1.0 - _LEAST_FALL) * tree.thresholds[0]
    if soon and (tree.leaked[source] or _is_satellite(tree, source)):
        return False
    centres = tree.centres(source)
    steps = np.hypot(*np.diff(centres, axis=0).T)
    radius = np.sqrt(tree.areas(source)[1:] / math.pi)
    jumps = bool((steps > np.maximum(_JUMP * radius, _LEAST_DRIFT)).any())
    return not jumps or math.dist(centres[-1], centres[0]) >= _STRAIGHTNESS * float(steps.sum())


def _is_satellite(tree: SourceTree, source: int) -> bool:
    """Whether a source is a speck, of noise say, next to a much larger one in whose branch it ends."""
    into, last = int(tree.merged_into[source]), int(tree.last[source])
    return into != source and tree.nodes[last, source, AREA] * GROWTH < tree.nodes[last, into, AREA]


def direction_of(tree: SourceTree, source: int) -> tuple[float, float]:
    """Direction into which the centre of a branch drifts, by regression; `UP` where it stays."""
    centres = tree.centres(source)
    if math.dist(centres[-1], centres[0]) < _LEAST_DRIFT:
        return UP
    u, v = (centres - centres.mean(axis=0)).T
    # The longest axis of the centres' scatter: a regression in which neither coordinate is the one without error.
    angle = 0.5 * math.atan2(2.0 * float((u * v).sum()), float((u * u).sum() - (v * v).sum()))
    along = math.cos(angle), math.sin(angle)
    drift = centres[-1] - centres[0]
    sign = 1.0 if along[0] * drift[0] + along[1] * drift[1] >= 0.0 else -1.0
    return sign * along[0], sign * along[1]


def _halo_of(tree: SourceTree, source: int) -> Halo | None:
    u, v = tree.centres(source)[0].tolist()
    along = direction_of(tree, source)
    profile = _falling(_level_along(tree.level, u, v, *along, round(REACH * tree.level.shape[1])))
    if len(profile) < 3:
        return None
    half = half_of(profile)
    return None if half is None else Halo(source, u, v, along, profile, *half)


@kernel
def _level_along(
    level: NDArray[np.uint8], u: float, v: float, along_u: float, along_v: float, count: int
) -> NDArray[np.float64]:
    """Level at whole pixels along a line, interpolated between four pixels; it ends at the picture's border.

    Takes `level` (rows, cols) uint8, `u`, `v` [px], `along_u`, `along_v` [px].
    """
    rows, cols = level.shape
    out = np.empty(count)
    for step in range(count):
        x, y = u + step * along_u, v + step * along_v
        if not (0.0 <= x <= cols - 1.001 and 0.0 <= y <= rows - 1.001):
            return out[:step]
        i, j = int(x), int(y)
        a, b = x - i, y - j
        upper = (1.0 - a) * level[j, i] + a * level[j, i + 1]
        lower = (1.0 - a) * level[j + 1, i] + a * level[j + 1, i + 1]
        out[step] = (1.0 - b) * upper + b * lower
    return out


def _falling(profile: NDArray[np.float64]) -> NDArray[np.float64]:
    """The profile up to where it is lowest before it rises again."""
    if not len(profile):
        return profile
    risen = np.flatnonzero(profile > np.minimum.accumulate(profile) + _RISE)
    before = profile[: risen[0]] if len(risen) else profile
    return before[: int(np.argmin(before)) + 1]


def half_of(profile: NDArray[np.float64]) -> tuple[float, float] | None:
    """H50 [levels of 255] and W50 [px] of a profile that begins in a source; None if it does not fall.

    Takes `profile` (n,) [levels of 255].
    """
    top = float(profile.max())
    height = 0.5 * (top - float(profile[-1]))
    if height <= 0.0:
        return None
    end = _crossing(profile, _SATURATED * top)
    return height, max(_crossing(profile, top - height) - end, _NARROWEST)


def _crossing(profile: NDArray[np.float64], threshold: float) -> float:
    """Where a profile falls below a threshold for good [px]."""
    above = int(np.flatnonzero(profile >= threshold)[-1])
    if above + 1 == len(profile):
        return float(above)
    high, low = float(profile[above]), float(profile[above + 1])
    return above + (high - threshold) / max(high - low, 1e-9)
