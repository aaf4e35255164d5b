"""Memory of pictures that nobody holds any more, used again: to get new memory costs as much as to shade it."""

import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

_UNUSED = 2  # references to an array that only its list and the question itself hold
_MOST = 8  # arrays of a size that are kept


class Memory:
    """Gives arrays out, and again when nothing refers to them, neither themselves nor as a view.

    That is what Python's count of references says; an implementation without one gives new arrays only.
    """

    def __init__(self) -> None:
        self._arrays: dict[tuple[int, ...], list[NDArray[np.int32]]] = {}

    def empty(self, shape: tuple[int, ...], kind: type[np.float32] | type[np.int32]) -> NDArray[Any]:
        """Array of a shape with any contents; `kind` has 32 bits."""
        arrays = self._arrays.get(shape)
        if arrays is None:
            # What is kept is for pictures of one size.
            if len(self._arrays) > _MOST:
                self._arrays.clear()
            arrays = self._arrays[shape] = []
        for number in range(len(arrays)):
            if hasattr(sys, "getrefcount") and sys.getrefcount(arrays[number]) == _UNUSED:
                return arrays[number].view(kind)
        array = np.empty(shape, np.int32)
        if len(arrays) < _MOST:
            arrays.append(array)
        return array.view(kind)
