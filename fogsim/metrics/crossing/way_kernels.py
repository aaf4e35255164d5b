"""Where straight pieces of ways cross: compiled, as each is compared with all others of its junction."""

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel

Floats = NDArray[np.float64]
Numbers = NDArray[np.intp]

_ROUNDING = 1e-9


@kernel
def crossing_pieces(begin: Floats, way: Floats, junction: Numbers, vehicle: Numbers, least_sine: float) -> Floats:
    """Pairs of pieces of different vehicles in the same junction that cross.

    Returns numbers of the two pieces, and at which part of either, 0 … 1, the other crosses it (k, 4). Takes `begin`,
    `way` (n, 2) [m], `junction`, `vehicle` (n,) int.
    """
    found, count = np.empty((64, 4)), 0
    length = np.sqrt(way[:, 0] ** 2 + way[:, 1] ** 2)
    for i in range(len(begin)):
        for j in range(i + 1, len(begin)):
            if junction[j] != junction[i]:
                break
            reach = length[i] + length[j]
            x, y = begin[j, 0] - begin[i, 0], begin[j, 1] - begin[i, 1]
            if abs(x) > reach or abs(y) > reach or vehicle[j] == vehicle[i]:
                continue
            cross = way[i, 0] * way[j, 1] - way[i, 1] * way[j, 0]
            if abs(cross) <= least_sine * length[i] * length[j]:
                continue
            at = (x * way[j, 1] - y * way[j, 0]) / cross
            other = (x * way[i, 1] - y * way[i, 0]) / cross
            # A crossing where one piece ends and the next begins is in both, rather than by rounding in neither.
            if min(at, other) >= -_ROUNDING and max(at, other) <= 1.0 + _ROUNDING:
                if count == len(found):
                    grown = np.empty((2 * count, 4))
                    grown[:count] = found
                    found = grown
                found[count, 0], found[count, 1], found[count, 2], found[count, 3] = i, j, at, other
                count += 1
    return found[:count]
