"""Memory of pictures that nobody holds any more."""

import sys

import numpy as np
import pytest

from fogsim.render.shading.picture import Memory


@pytest.mark.skipif(not hasattr(sys, "getrefcount"), reason="without a count of references nothing is used again")
def test_memory_is_used_again_only_when_nothing_holds_it() -> None:
    memory = Memory()
    first = memory.empty((3, 4), np.float32)
    row, place = first[1], first.ctypes.data
    del first
    assert memory.empty((3, 4), np.float32).ctypes.data != place  # the row still holds it
    del row
    assert memory.empty((3, 4), np.int32).ctypes.data == place
