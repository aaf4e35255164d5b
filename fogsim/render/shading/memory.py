"""Memory of pictures that are no longer referred to, used again: to allocate a picture takes as long as to shade it."""

import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

_UNUSED = 2  # references to an array that only its list and the question itself hold
_MOST = 8  # arrays of a size that are kept


class Memory:
    """A pool of arrays: one is used again when no other reference to it or to a view of it exists.

    This relies on CPython's reference counts; on an implementation without them every array is new.
    """

    def __init__(self) -> None:
        self._arrays: dict[tuple[int, ...], list[NDArray[np.int32]]] = {}

    def empty(self, shape: tuple[int, ...], kind: type[np.float32] | type[np.int32]) -> NDArray[Any]:
        """Give an array with any contents."""
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
