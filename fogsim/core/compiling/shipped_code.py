"""Kernels that came with the installation, compiled when its wheel was built (``make wheel``): a first run finds them.

They are numba's own files, made by one version of Python and of numba, for any processor of a kind; where these are not
the same, or a source has changed since, nothing is found, and kernels are compiled as they are without.
"""

import functools
import platform
from dataclasses import dataclass
from pathlib import Path
from pickle import loads
from types import FunctionType
from typing import Any, cast

import llvmlite.binding as llvm  # type: ignore[import-untyped]
import numba
from numba.core import caching, config

from fogsim.core.compiling.code_libraries import KeptCode
from fogsim.core.files.user_cache import read_entry

PACKAGE = Path(__file__).parents[2]
FOLDER = PACKAGE / "_kernels"
"""Where a wheel has them, in folders named as those of the modules; a checkout has none."""


@dataclass(frozen=True)
class Processors:
    """A kind of processors that one machine code is for."""

    name: str  # LLVM's name
    features: frozenset[str]  # What LLVM must find in a processor for it to be of the kind


KINDS = {
    "x86_64": Processors(
        "x86-64-v3",
        frozenset(("cx16", "popcnt", "sahf", "sse3", "sse4.1", "sse4.2", "ssse3"))
        | frozenset(("avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe", "xsave")),
    )
}
"""By machine: the third level of the psABI of x86-64 (Intel since 2013, AMD since 2015).

It is as fast as code for the very processor; code for any x86-64 takes half as long again (`benchmarks/frames.py` with
``NUMBA_CPU_NAME``). Other machines compile for themselves.
"""


def compiled_for() -> dict[str, str] | None:
    """Variables with which numba compiles kernels to be shipped, for LLVM's processors; None if none are."""
    kind = KINDS.get(platform.machine())
    return None if kind is None else {"NUMBA_CPU_NAME": kind.name, "NUMBA_CPU_FEATURES": ""}


@functools.cache
def usable_kind() -> Processors | None:
    """The processor kind of this machine; None if it is not a known one, or if numba's target was configured."""
    kind = KINDS.get(platform.machine())
    is_configured = config.CPU_NAME is not None or config.CPU_FEATURES is not None or config.BOUNDSCHECK
    if kind is None or is_configured:
        return None
    try:
        features = llvm.get_host_cpu_features()
    except RuntimeError:
        return None
    return kind if kind.features <= {name for name, is_there in features.items() if is_there} else None


class _Locator(caching.InTreeCacheLocator):  # type: ignore[misc] # numba is untyped
    """Finds a module's folder in `FOLDER`, which need not be writable."""

    def ensure_cache_path(self) -> None:
        """Nothing is written."""

    def get_cache_path(self) -> str:
        return str(FOLDER / Path(self._py_file).parent.relative_to(PACKAGE))


class _Files(caching.CompileResultCacheImpl):  # type: ignore[misc] # numba is untyped
    _locator_classes = (_Locator,)


class ShippedCache(caching.Cache):  # type: ignore[misc] # numba is untyped
    """What of one function came with the installation."""

    _impl_class = _Files

    def __init__(self, py_func: FunctionType) -> None:
        super().__init__(py_func)
        KeptCode.take_over(self)

    def is_there(self) -> bool:
        """Whether anything of it did."""
        return Path(self._cache_file._index_path).exists()

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep it as it came."""

    def _index_key(self, sig: Any, codegen: Any) -> tuple[Any, ...]:
        signature, (triple, _, _), code = super()._index_key(sig, codegen)
        return signature, (triple, cast("Processors", usable_kind()).name, ""), code


def shipped_cache(function: FunctionType) -> ShippedCache | None:
    """What came of a function with the installation; None where nothing did, or it is not for this processor."""
    if not FOLDER.is_dir() or not Path(function.__code__.co_filename).is_relative_to(PACKAGE) or usable_kind() is None:
        return None
    return ShippedCache(function)


def why_not_taken() -> str | None:
    """Why what came with the installation is not for this one; None if it is, or if nothing came."""
    index = next(FOLDER.rglob("*.nbi"), None)
    if index is None:
        return None
    if usable_kind() is None:
        return f"those that came with it are for {KINDS[platform.machine()].name}"
    content = read_entry(index)
    if content is None:
        return "those that came with it cannot be read"
    version = loads(content)  # noqa: S301 - it came as all of the installation did
    if version != numba.__version__:
        return f"those that came with it are of numba {version}, and here is {numba.__version__}"
    return None
