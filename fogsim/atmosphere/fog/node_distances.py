"""Where along the rays of a frustum grid nodes are needed: where the fog is uneven and still to be seen."""

import numpy as np
from numpy.typing import NDArray

from fogsim.atmosphere.fog.extinction import Medium
from fogsim.atmosphere.fog.koschmieder_kernels import ENDLESS
from fogsim.atmosphere.fog.optical_depth_kernels import extinctions_on_ray

NODES = 32
"""Nodes along a ray, with the eye and the end of the ray."""

FARTHEST = 20_000.0
"""What is farther than this and not endless is taken to be here [m]."""

_PROBES = np.concatenate(([0.0], np.geomspace(0.5, 0.9 * FARTHEST, 128)))
_SEEN = 7.0
"""Optical depth behind which a thousandth of the contrast is left [-]."""
_FOG_LEFT = 1e-3
"""Optical depth ahead that matters no more [-]."""
_EVEN_SHARE = 0.3
"""Share of the nodes that is spread whatever the fog, evenly in the logarithm of the distance."""


def node_distances(
    eye: NDArray[np.float64], directions: NDArray[np.float64], medium: Medium, count: int = NODES
) -> NDArray[np.float64]:
    """Distances of nodes such that linear interpolation of τ between them errs about equally everywhere.

    The error of the transmission in an interval Δ is T |dk/dr| Δ² / 8, so that nodes should be as dense as
    √(T |dk/dr|), of which some probing rays give the largest.

    Parameters
    ----------
    eye : (3,) float64
        Where the rays begin [m].
    directions : (..., 3) float64
        Unit vectors of the probing rays.
    medium : Medium
        The fog.
    count : int
        Number of nodes.

    Returns
    -------
    (count,) float64
        Ascending from 0; the last two are `FARTHEST` and `ENDLESS` [m].
    """
    probes = np.ascontiguousarray(directions.reshape(-1, 3))
    k = np.empty((len(probes), len(_PROBES)))
    for direction, values in zip(probes, k, strict=True):
        extinctions_on_ray(eye, direction, _PROBES, medium, values)
    step = np.diff(_PROBES)
    pieces = 0.5 * (k[:, 1:] + k[:, :-1]) * step
    depth = np.cumsum(pieces, axis=1)
    matters = (depth - pieces < _SEEN) & (depth[:, -1:] - depth + pieces > _FOG_LEFT)
    last = max(10, int(np.flatnonzero(matters.any(axis=0)).max(initial=0)) + 1)
    slope = np.abs(np.diff(k, axis=1)) / step * np.exp(-depth) * matters
    uneven = np.sqrt(slope.max(axis=0))[:last] * step[:last]
    even = step[:last] / (_PROBES[1 : last + 1] + 5.0)
    weight = _EVEN_SHARE * even / even.sum() + (1.0 - _EVEN_SHARE) * uneven / max(uneven.sum(), 1e-30)
    growth = np.concatenate(([0.0], np.cumsum(weight)))
    inner = np.interp(np.linspace(0.0, growth[-1], count - 2), growth, _PROBES[: last + 1])
    return np.append(inner, (FARTHEST, ENDLESS))
