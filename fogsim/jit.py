"""Compiled kernels: numba, cached on disk where a directory can be written, compiled anew where none can."""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., Any])


def kernel(function: F) -> F:
    """Compile a function on its first call, without Python's lock and without threads (forks must stay possible).

    The compiled code is kept beside the module or, for a read-only installation, in the user's cache directory; where
    neither can be written it is compiled again by each process.
    """
    options = {"nogil": True, "fastmath": False, "error_model": "numpy"}
    try:
        return cast("F", numba.njit(cache=True, **options)(function))
    except RuntimeError:
        # numba found no place for its cache
        return cast("F", numba.njit(cache=False, **options)(function))
