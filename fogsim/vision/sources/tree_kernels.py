"""Compiled flooding of a picture from its brightest spots downward: what the tree of sources is made of.

Every kernel is called with the dtypes named in its docstring and C-contiguous arrays, so that it compiles once.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

AREA, SUM_U, SUM_V, SUM_UU, SUM_VV, SUM_UV, LEFT, RIGHT, TOP, BOTTOM = range(10)
"""Columns of what is known of a component: number of pixels, sums of their columns and rows and of the products of
these, first and last column and row."""

MEASURES = 10
"""How many columns there are."""

_FREE = np.int32(0)
"""Label of pixels that belong to no component; components count from 1."""

_WAITING = np.int32(-1)
"""Label of pixels that have been found and wait for their level."""


@kernel
def brightest_channel(image: NDArray[np.generic], shift: int) -> NDArray[np.uint8]:
    """Largest channel of every pixel in 8 bits: tail lamps are as bright in red as head lamps in white.

    Takes `image` (rows, cols, channels) uint8.
    """
    rows, cols, channels = image.shape
    out = np.empty((rows, cols), np.uint8)
    for row in range(rows):
        # Channel by channel with a fixed stride, which is compiled into vector instructions.
        for col in range(cols):
            out[row, col] = image[row, col, 0] >> shift
        for channel in range(1, channels):
            for col in range(cols):
                out[row, col] = max(out[row, col], np.uint8(image[row, col, channel] >> shift))
    return out


@kernel
def _begin(measures: NDArray[np.float64]) -> None:
    measures[:] = 0.0
    measures[LEFT], measures[TOP], measures[RIGHT], measures[BOTTOM] = 1e9, 1e9, -1.0, -1.0


@kernel
def _add(measures: NDArray[np.float64], u: int, v: int) -> None:
    measures[AREA] += 1.0
    measures[SUM_U] += u
    measures[SUM_V] += v
    measures[SUM_UU] += u * u
    measures[SUM_VV] += v * v
    measures[SUM_UV] += u * v
    measures[LEFT], measures[RIGHT] = min(measures[LEFT], u), max(measures[RIGHT], u)
    measures[TOP], measures[BOTTOM] = min(measures[TOP], v), max(measures[BOTTOM], v)


@kernel
def _join(into: NDArray[np.float64], other: NDArray[np.float64]) -> None:
    for column in (AREA, SUM_U, SUM_V, SUM_UU, SUM_VV, SUM_UV):
        into[column] += other[column]
    into[LEFT], into[RIGHT] = min(into[LEFT], other[LEFT]), max(into[RIGHT], other[RIGHT])
    into[TOP], into[BOTTOM] = min(into[TOP], other[TOP]), max(into[BOTTOM], other[BOTTOM])


@kernel
def find_components(
    level: NDArray[np.uint8], threshold: int, most: int, most_pixels: int
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Components of neighbouring pixels, corners too, that are not below a threshold (`level` (rows, cols) uint8)."""
    rows, cols = level.shape
    label = np.zeros((rows, cols), np.int32)
    measures = np.empty((most, MEASURES))
    stack = np.empty(most_pixels, np.int64)
    count, pixels = 0, 0
    for row in range(rows):
        for col in range(cols):
            if level[row, col] < threshold or label[row, col] != _FREE:
                continue
            if count == most or pixels == most_pixels:
                return label, measures[: count if pixels < most_pixels else 0]
            count += 1
            one = measures[count - 1]
            _begin(one)
            label[row, col] = count
            stack[0], waiting, pixels = row * cols + col, 1, pixels + 1
            while waiting:
                waiting -= 1
                v, u = stack[waiting] // cols, stack[waiting] % cols
                _add(one, u, v)
                for dv in range(-1, 2):
                    for du in range(-1, 2):
                        y, x = v + dv, u + du
                        if not (0 <= y < rows and 0 <= x < cols) or level[y, x] < threshold:
                            continue
                        if label[y, x] == _FREE and pixels < most_pixels:
                            label[y, x] = count
                            stack[waiting] = y * cols + x
                            waiting += 1
                            pixels += 1
    return label, measures[: count if pixels < most_pixels else 0]


class _Flood(NamedTuple):
    """What flooding from sources finds, level by level."""

    # What is known of each source's component at each level; of merged ones, that of the component it is part of
    nodes: NDArray[np.float64]
    # (n,) int64: Last level at which each source's component was its own and had not leaked; −1 if there was none
    last: NDArray[np.int64]
    # (n,) int64: The source into whose branch each merged, itself where it merged into none
    merged_into: NDArray[np.int64]
    leaked: NDArray[np.bool_]  # (n,) bool: Whether each branch ended because it grew too fast or too large


@kernel
def _root(parent: NDArray[np.int64], source: int) -> int:
    while parent[source] != source:
        source = parent[source]
    return source


class _Front(NamedTuple):
    """Pixels that wait, a list for each level: the first one of each list, and of each pixel in turn the next one."""

    first: NDArray[np.int64]  # (levels,) int64: Numbers of the first, −1 for none
    # following, pixel, source (most,) int64: the next in the same list, which pixel it is and from which source it was
    # found
    following: NDArray[np.int64]
    pixel: NDArray[np.int64]
    source: NDArray[np.int64]
    used: NDArray[np.int64]  # (1,) int64: How many there are


@kernel
def _find(
    front: _Front, level: NDArray[np.uint8], label: NDArray[np.int32], of_level: NDArray[np.int64], at: int, source: int
) -> None:
    """Let the free neighbours of a pixel wait for their levels."""
    rows, cols = level.shape
    now, row, col = of_level[level[at // cols, at % cols]], at // cols, at % cols
    for step in range(4):
        v, u = row + (step == 0) - (step == 1), col + (step == 2) - (step == 3)
        if not (0 <= v < rows and 0 <= u < cols) or label[v, u] != _FREE:
            continue
        when, number = max(of_level[level[v, u]], now), front.used[0]
        if when >= len(front.first) or number >= len(front.pixel):
            continue
        label[v, u] = _WAITING
        front.pixel[number], front.source[number] = v * cols + u, source
        front.following[number], front.first[when] = front.first[when], number
        front.used[0] += 1


class _Branches(NamedTuple):
    """What becomes of the sources' components."""

    now: NDArray[np.float64]  # What is known of each
    parent: NDArray[np.int64]  # (n,) int64: The one with which each merged, itself where it did with none
    last: NDArray[np.int64]  # (n,) int64: Last threshold at which each was its own
    # ended, leaked (n,) bool: whether each grows no more, and whether that is because it grew too fast or too large
    ended: NDArray[np.bool_]
    leaked: NDArray[np.bool_]


@kernel
def _find_borders(
    front: _Front,
    level: NDArray[np.uint8],
    label: NDArray[np.int32],
    of_level: NDArray[np.int64],
    sources: NDArray[np.float64],
) -> None:
    """Let the neighbours of all sources wait."""
    cols = level.shape[1]
    for number in range(len(sources)):
        one = sources[number]
        for v in range(int(one[TOP]), int(one[BOTTOM]) + 1):
            for u in range(int(one[LEFT]), int(one[RIGHT]) + 1):
                if label[v, u] == number + 1:
                    _find(front, level, label, of_level, v * cols + u, number)


@kernel
def _merge_neighbours(label: NDArray[np.int32], branches: _Branches, v: int, u: int, at: int, minor: float) -> None:
    """Join the components that touch at a pixel that has just been met."""
    rows, cols = label.shape
    now, parent, last, ended, _ = branches
    for step in range(4):
        y, x = v + (step == 0) - (step == 1), u + (step == 2) - (step == 3)
        if not (0 <= y < rows and 0 <= x < cols) or label[y, x] <= 0:
            continue
        own, other = _root(parent, label[v, u] - 1), _root(parent, label[y, x] - 1)
        if own == other:
            continue
        into, gone = (own, other) if now[own, AREA] >= now[other, AREA] else (other, own)
        if now[gone, AREA] > minor * now[into, AREA]:
            last[into] = min(last[into], at - 1)
            ended[into] |= ended[gone]
        last[gone] = min(last[gone], at - 1)
        _join(now[into], now[gone])
        parent[gone] = into
        ended[gone] = True


@kernel
def _fill(
    front: _Front,
    level: NDArray[np.uint8],
    label: NDArray[np.int32],
    of_level: NDArray[np.int64],
    branches: _Branches,
    at: int,
    minor: float,
) -> None:
    """Give the pixels that wait for a threshold to the components from which they were found."""
    cols = level.shape[1]
    while front.first[at] >= 0:
        number = front.first[at]
        front.first[at] = front.following[number]
        pixel, owner = front.pixel[number], _root(branches.parent, front.source[number])
        v, u = pixel // cols, pixel % cols
        if branches.ended[owner]:
            label[v, u] = _FREE
            continue
        label[v, u] = owner + 1
        _add(branches.now[owner], u, v)
        _merge_neighbours(label, branches, v, u, at, minor)
        _find(front, level, label, of_level, pixel, owner)


class Limits(NamedTuple):
    """Where branches end."""

    # A component that grows by more from one threshold to the next has leaked into something bright; one that meets
    # another that is smaller by more goes on as its own
    growth: float
    largest: float  # Pixels from which on a component is no halo
    budget: int  # Pixels that are looked at in all; where they are used up, all branches end


@kernel
def flood(
    level: NDArray[np.uint8],
    label: NDArray[np.int32],
    sources: NDArray[np.float64],
    of_level: NDArray[np.int64],
    limits: Limits,
) -> _Flood:
    """Let components grow from sources while the threshold falls, until they merge, leak, or have all been followed.

    Takes `level` (rows, cols) uint8, `label` (rows, cols) int32, `of_level` (256,) int64.
    """
    count, thresholds = len(sources), of_level.max()
    front = _Front(
        np.full(thresholds, -1, np.int64),
        np.empty(limits.budget, np.int64),
        np.empty(limits.budget, np.int64),
        np.empty(limits.budget, np.int64),
        np.zeros(1, np.int64),
    )
    branches = _Branches(
        sources.copy(),
        np.arange(count),
        np.full(count, thresholds - 1, np.int64),
        np.zeros(count, np.bool_),
        np.zeros(count, np.bool_),
    )
    now, parent, last, ended, leaked = branches
    nodes = np.zeros((thresholds, count, MEASURES))
    _find_borders(front, level, label, of_level, sources)
    for at in range(thresholds):
        before = now[:, AREA].copy()
        _fill(front, level, label, of_level, branches, at, 1.0 / limits.growth)
        for number in range(count):
            root = _root(parent, number)
            nodes[at, number] = now[root]
            grown = now[number, AREA] > min(limits.growth * before[number], limits.largest)
            if root == number and not ended[number] and grown:
                leaked[number] = last[number] >= at
                ended[number], last[number] = True, min(last[number], at - 1)
        if front.used[0] == limits.budget:
            last[:] = np.minimum(last, at - 1)
        if front.used[0] == limits.budget or ended.all():
            break
    return _Flood(nodes, last, parent, leaked)
