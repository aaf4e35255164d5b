"""The tree of light sources in a picture: gallen2014 section III-B, steps 1 and 2."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
