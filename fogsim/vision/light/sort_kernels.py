"""Compiled sorting of a few dozen numbers, which quicksort is slow for."""

import numpy as np
from numpy.typing import NDArray

from fogsim.jit import kernel


@kernel
def sort_few(values: NDArray[np.float32], out: NDArray[np.float32]) -> None:
    """Sort by counting for each number those that come before it: work that the processor does for many at once.

    Parameters
    ----------
    values : (n,) float32
        The numbers.
    out : (n,) float32
        The same in ascending order; is written.
    """
    # 32 bits, as the numbers have: else half as many fit into a register.
    for i in range(values.size):
        value, before = values[i], np.int32(0)
        for j in range(values.size):
            before += np.int32(values[j] < value)
        for j in range(i):
            before += np.int32(values[j] == value)
        out[before] = value


@kernel
def median_of_few(values: NDArray[np.float32], ordered: NDArray[np.float32]) -> float:
    """Median; `ordered` (n,) is written with the numbers in ascending order."""
    sort_few(values, ordered)
    return 0.5 * (float(ordered[(values.size - 1) // 2]) + float(ordered[values.size // 2]))
