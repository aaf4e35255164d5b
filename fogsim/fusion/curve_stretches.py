"""Stretches of the road ahead that a curve of optical depths describes one by one."""

import math

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.values.estimate import OpticalDepths

Floats = NDArray[np.float64]

CUTS = np.array([0.5, 1.0, 1.5, 2.0, 2.5, 3.0])
"""Range of optical depths in which a curve resolves stretches of its own [-]."""

SHORTEST, SHARED, GRAIN = 15.0, 0.8, 0.02
"""Shortest such stretch [m], correlation of a curve's errors at its ends, and least deviation of its depth [-]."""


def curve_stretches(curve: OpticalDepths, farthest: float) -> Floats:
    """(n, 4) float64: start and end [m], ln of the mean extinction, and its standard deviation [ln 1/m, -].

    Takes `farthest` [m].
    """
    return _cut(np.array(curve.distance), np.array(curve.depth), np.array(curve.standard_deviation), CUTS, farthest)


@kernel
def _cut(distance: Floats, depth: Floats, deviation: Floats, cuts: Floats, farthest: float) -> Floats:
    out, count = np.empty((cuts.size, 4)), 0
    start = reached = unsure = 0.0
    for cut in cuts:
        end = np.interp(cut, depth, distance) if cut < depth[-1] else distance[-1]
        if end - start >= SHORTEST:
            total, spread = np.interp(end, distance, depth), np.interp(end, distance, deviation)
            more = max(total - reached, 1e-4)
            apart = math.sqrt(max(spread**2 + unsure**2 - 2.0 * SHARED * spread * unsure, 0.0))
            out[count, 0], out[count, 1] = start, min(end, farthest)
            out[count, 2], out[count, 3] = math.log(more / (end - start)), math.hypot(apart, GRAIN) / more
            count += 1
            start, reached, unsure = end, total, spread
        if start >= farthest or cut >= depth[-1]:
            break
    return out[:count]
