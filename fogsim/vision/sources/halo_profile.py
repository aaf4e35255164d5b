"""Which sources have a halo, where it points, and how light falls off along it: gallen2014 section III-B, step 3."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.vision.sources.source_tree import GROWTH, SourceTree
from fogsim.vision.sources.tree_kernels import AREA

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
    profile = _falling(level_along(tree.level, u, v, *along, round(REACH * tree.level.shape[1])))
    if len(profile) < 3:
        return None
    half = half_of(profile)
    return None if half is None else Halo(source, u, v, along, profile, *half)


@kernel
def level_along(
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
