"""numba's compiler with less work for the same machine code: a first run compiles hundreds of functions.

All of it is inner working of numba, known for the versions in `KNOWN`; others compile as they do, only longer. It holds
while one of FogSim's kernels is compiled, and for no one else's.
"""

from collections.abc import Callable

import numba

from fogsim.core.compiling.code_libraries import LinkedLibrary, defer_code
from fogsim.core.compiling.shortcuts import SHORTCUTS

__all__ = ["KNOWN", "begin_economy", "prepare_economy"]

KNOWN = {(0, 68)}
"""Versions of numba whose inner working is known to be as it is taken here."""


def prepare_economy() -> None:
    """Let numba keep compiled functions in `LinkedLibrary`, if this version is known."""
    if numba.version_info.short in KNOWN:
        defer_code()


def begin_economy(*, unrolling: bool) -> Callable[[], None]:
    """Save work, if this version of numba is known, and unroll loops or not; the result ends it."""
    if numba.version_info.short not in KNOWN:
        return lambda: None
    LinkedLibrary.deferring, LinkedLibrary.unrolling = True, unrolling
    restored = [shortcut.take() for shortcut in SHORTCUTS]

    def end() -> None:
        LinkedLibrary.deferring = False
        for restore in restored:
            restore()

    return end
