"""Compiled kernels: numba, cached on disk where a directory can be written, compiled again where none can.

And what lets two of them work at once on a picture's rows.
"""

import _thread
import functools
import gc
import hashlib
import logging
import multiprocessing
import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any, TypeVar, cast

import numpy as np
from numba.core import event, serialize

# Where Intel's vector functions are installed, numba would take them, and they round otherwise than the C library does.
os.environ["NUMBA_DISABLE_INTEL_SVML"] = "1"
import numba
from numba.core.types.misc import unliteral

from fogsim.core.compiling import begin_economy, prepare_economy
from fogsim.core.compiling.code_libraries import KeptCode
from fogsim.core.compiling.shipped_code import ShippedCache, shipped_cache, why_not_taken

prepare_economy()
# Else numba reads its variables again while it compiles, where `_CompileSpeedup` has changed one.
numba.config.reload_config()

# For the class of each array or named tuple that a kernel returns, numba calls this, and goes on whatever comes of it:
# an exception of a signal's handler in it is lost, or the process is. Nothing is interrupted within a cache in C.
serialize._numba_unpickle = functools.cache(serialize._numba_unpickle)

F = TypeVar("F", bound=Callable[..., Any])

_WORTHWHILE = 100_000
"""Pixels from which a second thread gains more than the 50 µs that its start costs."""

_GAIN = 0.05
"""How far the middle moves towards the slower band, over the picture's rows and the bands' relative difference."""

_UNROLLED = (
    *("fogsim.atmosphere.", "fogsim.camera.", "fogsim.render.", "fogsim.vision.light.", "fogsim.vision.lines."),
    *("fogsim.vision.region.", "fogsim.vision.restoration.", "fogsim.vision.sources.", "fogsim.vision.symmetry."),
)
"""Modules with loops over pixels, faster if unrolled; a fifth of LLVM's time is saved with the others."""

_PATIENCE = 0.5
"""Time that a process compiles before it says so [s]: one kernel more is no news, a first run is."""

_LOOKS_AGAIN = 0.05
"""Time between two looks for a kernel that another process compiles [s]."""

_NEWS_PERIOD = 10.0
"""Time between two lines on what has been compiled [s]."""

_FOGSIM = __package__.partition(".")[0]


class Announcement(event.Listener):  # type: ignore[misc] # numba is untyped
    """At the first run only, explains that the time goes into compiling, and shows its progress (`clock` [s])."""

    def __init__(self, print_line: Callable[[str], object], clock: Callable[[], float] = time.monotonic) -> None:
        self._print, self._clock = print_line, clock
        self._depth = self._compiled = 0
        self._spent = self._started = 0.0
        self._printed: float | None = None

    def on_start(self, _: Any) -> None:
        """Begin to count at the outermost kernel; those that it calls are compiled within it."""
        if self._depth == 0:
            self._started = self._clock()
            if self._printed is None and self._spent > _PATIENCE:
                self._printed = self._started
                why = why_not_taken()
                self._print(
                    "fogsim: compiling for this processor, a minute or two, the first time only "
                    f"(ahead of time and on all cores: fogsim compile{f'; {why}' if why else ''})"
                )
        self._depth += 1

    def on_end(self, compiling: Any) -> None:
        """Count a compiled kernel, and report the count now and then."""
        self._depth -= 1
        if self._depth == 0 and compiling.data["dispatcher"].py_func.__module__.startswith(f"{_FOGSIM}."):
            now = self._clock()
            self._compiled += 1
            self._spent += now - self._started
            if self._printed is not None and now - self._printed > _NEWS_PERIOD:
                self._printed = now
                self._print(f"fogsim: compiled {self._compiled} functions in {self._spent:.0f} s")


class _CompileSpeedup(event.Listener):  # type: ignore[misc] # numba is untyped
    """Leaves out what costs time while one of FogSim's kernels is compiled, with all that it calls.

    It pauses garbage collection, which finds little among millions of objects, and skips what numba is spared
    by `fogsim.core.compiling`. ``NUMBA_DISABLE_JIT``, by which users debug functions of their own, does not count.
    """

    def __init__(self) -> None:
        self._depth = 0
        self._collects, self._is_disabled = False, 0
        self._end: Callable[[], None] | None = None

    def on_start(self, compiling: Any) -> None:
        """Begin at the outermost kernel."""
        module = compiling.data["dispatcher"].py_func.__module__
        if self._depth == 0:
            self._is_disabled, numba.config.DISABLE_JIT = numba.config.DISABLE_JIT, 0
        if self._depth == 0 and module.startswith(f"{_FOGSIM}."):
            self._collects = gc.isenabled()
            gc.disable()
            self._end = begin_economy(unrolling=module.startswith(_UNROLLED))
        self._depth += 1

    def on_end(self, _: Any) -> None:
        """End where it began."""
        self._depth -= 1
        if self._depth == 0:
            numba.config.DISABLE_JIT = self._is_disabled
        if self._depth == 0 and self._end is not None:
            self._end()
            self._end = None
            if self._collects:
                gc.enable()


event.register("numba:compile", Announcement(logging.getLogger(_FOGSIM).warning))
event.register("numba:compile", _CompileSpeedup())


class CompilerProcess:
    """Another process that compiles kernels of some modules; whoever finds one of them not compiled waits for it."""

    def __init__(self) -> None:
        self._is_over: Callable[[], bool] | None = None
        self._packages: tuple[str, ...] = ()
        self._work: Callable[[], object] | None = None

    @contextmanager
    def compiles(
        self, is_over: Callable[[], bool], packages: Sequence[str], work: Callable[[], object] | None = None
    ) -> Iterator[None]:
        """Wait for another process from now on; `work` is done before the first wait."""
        self._is_over, self._packages, self._work = is_over, tuple(packages), work
        try:
            yield
        finally:
            self._is_over = None

    def may_bring(self, module: str) -> bool:
        """Whether a kernel of a module that was not on the disk is worth another look, after a short while."""
        if self._is_over is None or not module.startswith(self._packages):
            return False
        is_over, self._is_over = self._is_over, None
        if is_over():
            return True
        if self._work is None:
            time.sleep(_LOOKS_AGAIN)
        else:
            work, self._work = self._work, None
            # Nothing is waited for within.
            work()
        self._is_over = is_over
        return True


COMPILER_PROCESS = CompilerProcess()
"""What is compiled next to this process, in another one."""


def is_kept(compiled: object) -> bool | None:
    """Whether anything of a kernel is on the disk, or came with the installation; None where nothing can be kept."""
    shipped: ShippedCache | None = getattr(compiled, "shipped", None)
    if shipped is not None and shipped.is_there():
        return True
    file: Any = getattr(getattr(compiled, "_cache", None), "_cache_file", None)
    path = getattr(file, "_index_path", None)
    return None if path is None else Path(path).exists()


def kernel(function: F) -> F:
    """Compile a function on its first call, without Python's lock and without threads (forks must stay possible).

    Code that came compiled with the installation is used. Other code is kept next to the module or, for a read-only
    installation, in the user's cache directory; where neither can be written it is compiled again by each process.
    """
    options = {"nogil": True, "fastmath": False, "error_model": "numpy", "no_cfunc_wrapper": True}
    plain = cast("FunctionType", function)
    # numba names the file after the function, and compiles again when the function's module changes, but not when
    # another does that it calls or takes constants from: so the name that numba sees says what those were.
    name = plain.__qualname__
    plain.__qualname__ = f"{name}-{_fingerprint(plain)}"
    try:
        shipped = shipped_cache(plain)
        compiled = _compiled(function, cache=True, **options)
        KeptCode.take_over(compiled._cache)
    except RuntimeError:
        # numba found no place for its cache
        compiled = _compiled(function, cache=False, **options)
    finally:
        plain.__qualname__ = name
    compiled.shipped = shipped
    _look_elsewhere(compiled)

    def take_in(*types: Any) -> Any:
        # Other kernels take one in that Python cannot call and that is not kept: they are kept, and it is in them.
        inner = _compiled(function, cache=False, no_cpython_wrapper=True, **options)
        compiled.get_call_template, compiled.get_overload = (
            _without_literals(inner.get_call_template),
            inner.get_overload,
        )
        return compiled.get_call_template(*types)

    compiled.get_call_template = take_in
    return cast("F", compiled)


def _compiled(function: Callable[..., Any], **options: Any) -> Any:
    """A function by `numba.njit`, which leaves it as it is where ``NUMBA_DISABLE_JIT`` is set."""
    before, numba.config.DISABLE_JIT = numba.config.DISABLE_JIT, 0
    try:
        return numba.njit(**options)(function)
    finally:
        numba.config.DISABLE_JIT = before


def _without_literals(get_call_template: Callable[..., Any]) -> Callable[..., Any]:
    """Let a kernel be compiled for numbers of a type, and not for 0, for 1 and for other numbers each again."""

    def get(arguments: Sequence[Any], keywords: dict[str, Any]) -> Any:
        return get_call_template([unliteral(a) for a in arguments], {k: unliteral(a) for k, a in keywords.items()})

    return get


def _look_elsewhere(compiled: Any) -> None:
    """Look for a kernel that was never compiled here among those that came with the installation.

    If another process is compiling it, it is looked for on the disk again once that has ended.
    """
    load, module, shipped = compiled._cache.load_overload, compiled.py_func.__module__, compiled.shipped

    def load_overload(signature: Any, target: Any) -> Any:
        found = load(signature, target)
        if found is None and shipped is not None:
            found = shipped.load_overload(signature, target)
        while found is None and COMPILER_PROCESS.may_bring(module):
            found = load(signature, target)
        return found

    compiled._cache.load_overload = load_overload


def _fingerprint(function: FunctionType) -> str:
    """Digest of all that may be compiled into a function besides its own module: everything that module imports."""
    seen = function.__globals__
    return _digest_of(text for name in seen for text in _compiled_in(name, seen[name], seen))


@functools.cache
def _sources(function: FunctionType) -> str:
    """Digest of the module of a function, which has been imported, and of all that is compiled into the function."""
    names, known, pending = function.__globals__, {function}, [function]
    found = [_digest(function.__code__.co_filename)]
    for one in pending:  # grows on the way
        for name in one.__code__.co_names:
            called = getattr(names.get(name), "py_func", None)
            if called is None or called.__globals__ is not names:
                found += _compiled_in(name, names.get(name), names)
            elif called not in known:
                known.add(called)
                pending.append(called)
    return _digest_of(found)


def _compiled_in(name: str, value: object, names: Mapping[str, Any]) -> Iterator[str]:
    """Sources of what a module sees by a name, or its value, if kernels use that; nothing for the module's own."""
    called = getattr(value, "py_func", None)
    if called is not None:
        if called.__globals__ is not names:
            yield _sources(called)
    elif isinstance(value, ModuleType):
        if value.__name__.startswith(f"{_FOGSIM}."):
            yield _digest(str(value.__file__))
    elif isinstance(value, np.ndarray):
        yield f"{name} {value.dtype} {hashlib.sha256(value.tobytes()).hexdigest()}"
    elif not name.startswith("__") and _is_constant(value):
        yield f"{name} {value!r}"


def _digest_of(texts: Iterable[str]) -> str:
    return hashlib.sha256("\n".join(texts).encode()).hexdigest()[:12]


def _is_constant(value: object) -> bool:
    if isinstance(value, tuple):
        return all(map(_is_constant, value))
    return isinstance(value, int | float | complex | str | np.generic)


@functools.cache
def _digest(path: str) -> str:
    """Digest of a file, empty if it cannot be read."""
    try:
        return hashlib.sha256(Path(path).read_bytes()).hexdigest()
    except OSError:
        return ""


class Bands:
    """Divides the rows of pictures at a share `middle` between this thread and, for large pictures, a second one.

    No thread outlives a call, so that a process may fork between calls. Where the rows are divided depends on the time
    that the bands took before; so what is done to a row must not depend on it, and pictures are the same anywhere.
    """

    def __init__(self) -> None:
        self.middle = 0.5

    def work(self, task: Callable[[int, int, int], None], rows: int, columns: int) -> None:
        """Call a task for each band (`rows`, `columns` [px])."""
        middle = int(self.middle * rows)
        if rows * columns < _WORTHWHILE or not 0 < middle < rows or processors() < 2:
            task(0, 0, rows)
            return
        times, failures, ended = [0.0, 0.0], list[BaseException](), _thread.allocate_lock()

        def lower_band() -> None:
            started = time.thread_time()
            try:
                task(1, middle, rows)
            except BaseException as failure:  # noqa: BLE001 - raised again by the thread that asked
                failures.append(failure)
            times[1] = time.thread_time() - started
            ended.release()

        ended.acquire()
        # A Thread of the module threading is started with 40 µs of ceremony, this one with 20.
        _thread.start_new_thread(lower_band, ())
        started = time.thread_time()
        try:
            task(0, 0, middle)
        finally:
            times[0] = time.thread_time() - started
            ended.acquire()
        if failures:
            raise failures[0]
        difference = (times[1] - times[0]) / max(sum(times), 1e-9)
        self.middle = min(max(self.middle + _GAIN * difference, 0.1), 0.9)


def processors() -> int:
    """Processors that this process may use: 1 for a worker (``OMP_NUM_THREADS=1``) next to others that draw."""
    if multiprocessing.parent_process() is not None or os.environ.get("OMP_NUM_THREADS") == "1":
        return 1
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
