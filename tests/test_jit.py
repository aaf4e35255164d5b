"""Compiled code that is kept on disk is never older than the sources it came from."""

import os
import sys
from pathlib import Path

import pytest
from numba.core import codegen

import fogsim.core.jit  # noqa: F401 - lets numba use LinkedLibrary
from fogsim.core.compiling.code_libraries import LinkedLibrary
from tests.helpers.command import run_python

CALLED = """
from fogsim.core.jit import kernel

FACTOR = {factor}

@kernel
def twice(x):
    return {twice} * x
"""

CALLER = """
import {called}
from fogsim.core.jit import kernel
from {called} import FACTOR, twice

@kernel
def middle(x):
    return twice(x)

@kernel
def answer(x):
    return middle(x) + FACTOR
"""

CALLED_LATER = """
from fogsim.core.jit import kernel
from {called} import FACTOR, twice

@kernel
def answer(x):
    return middle(x)

@kernel
def middle(x):
    return twice(x) + FACTOR
"""

ASK = "from caller import answer; print(answer(10.0), answer.__name__, sum(answer.stats.cache_hits.values()))"


def write(folder: Path, twice: float, factor: float) -> None:
    """Write the module that is called; the caller stays as it is."""
    (folder / "called.py").write_text(CALLED.format(twice=twice, factor=factor))


def ask(folder: Path) -> list[str]:
    """What a new process gets."""
    path = os.pathsep.join((str(folder), *sys.path))
    environment = {"PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1", "NUMBA_CACHE_DIR": ""}
    return run_python("-c", ASK, environment=environment).stdout.split()


@pytest.mark.parametrize("caller", [CALLER, CALLED_LATER])
def test_what_one_process_compiled_the_next_one_loads_until_a_source_that_is_called_changes(
    tmp_path: Path, caller: str
) -> None:
    """Neither numba's stamp of the caller's own file nor its time says that a module it calls has changed."""
    (tmp_path / "caller.py").write_text(caller.format(called="called"))
    write(tmp_path, 2.0, 1.0)
    assert ask(tmp_path) == ["21.0", "answer", "0"]
    assert ask(tmp_path) == ["21.0", "answer", "1"]
    write(tmp_path, 3.0, 5.0)
    assert ask(tmp_path)[0] == "35.0"


@pytest.mark.nightly
def test_an_index_that_names_types_of_an_older_version_is_compiled_anew(tmp_path: Path) -> None:
    module = tmp_path / "renamed.py"
    text = (
        "from typing import NamedTuple\n\nfrom fogsim.core.jit import kernel\n\n\n"
        "class Old(NamedTuple):\n    x: float\n\n\n"
        "@kernel\ndef doubled(value):\n    return 2.0 * value.x\n\n\nprint(doubled(Old(21.0)))\n"
    )
    for name in ("Old", "New"):
        module.write_text(text.replace("Old", name), encoding="utf-8")
        assert run_python(module).stdout.strip() == "42.0"


INTERRUPTED = """
import signal
from collections import Counter

import numpy as np

from fogsim.vision.light.medians import span_medians

def interrupt(*_):
    raise KeyboardInterrupt

signal.signal(signal.SIGALRM, interrupt)
image, ends = np.ones((4, 4), np.float32), np.zeros(4, np.int64)
work = (image, np.ones((4, 4), np.uint8), ends, ends + 3, 4, 1)
span_medians(*work)
raised = Counter()
for number in range(5000):
    try:
        signal.setitimer(signal.ITIMER_REAL, 1e-4 + 1e-8 * number)
        while True:
            span_medians(*work)
    except BaseException as error:
        raised[type(error).__name__] += 1
print(dict(raised))
"""
"""A kernel that returns a named tuple, interrupted at any moment of its calls."""


def test_a_signal_in_a_kernels_call_is_a_keyboard_interrupt_and_no_crash() -> None:
    assert run_python("-c", INTERRUPTED).stdout.strip() == "{'KeyboardInterrupt': 5000}"


SCRATCH = """
import gc

import numpy as np

import fogsim.core.jit
from fogsim.core.compiling.code_libraries import LinkedLibrary

fogsim.core.jit._FOGSIM = "scratch"

@fogsim.core.jit.kernel
def root(x):
    if x < 0.0:
        raise ValueError("less than nothing", x)
    return np.sqrt(np.array([x]))[0]

@fogsim.core.jit.kernel
def doubled_root(x):
    return 2.0 * root(x)

def failure(function):
    try:
        function(-1.0)
    except ValueError as error:
        return str(error.args)

made = []
make_code = LinkedLibrary._make_code
LinkedLibrary._make_code = lambda self: made.append(self.name) or make_code(self)
"""
"""A kernel that raises an error, and one that takes it in; both belong to a package that is taken for FogSim."""

DEFERS = codegen.JITCPUCodegen._library_class is LinkedLibrary
"""Whether this version of numba is one whose inner working is known: results are the same in others, too."""

WHAT_SCRATCH_DOES = """
from scratch.kernels import *
print(doubled_root(4.0), failure(doubled_root))
print([name for name in made if name != "nrt"])
print(root(9.0), failure(root), gc.isenabled(), LinkedLibrary.deferring)
"""


def test_a_kernel_within_another_gets_no_code_of_its_own_until_python_calls_it(tmp_path: Path) -> None:
    """Errors that it raises are the same within the other, compiled or from the disk."""
    (tmp_path / "scratch").mkdir()
    (tmp_path / "scratch" / "__init__.py").touch()
    (tmp_path / "scratch" / "kernels.py").write_text(SCRATCH)
    error = "('less than nothing', -1.0)"
    for compiled in ("['doubled_root']" if DEFERS else "[]", "[]"):
        path = os.pathsep.join((str(tmp_path), *sys.path))
        done = run_python("-c", WHAT_SCRATCH_DOES, environment={"PYTHONPATH": path})
        assert done.stdout.splitlines() == [f"4.0 {error}", compiled, f"3.0 {error} True False"]


OTHERS = """
import numba

import fogsim.core.jit
from fogsim.core.compiling.code_libraries import LinkedLibrary

made = []
make_code = LinkedLibrary._make_code
LinkedLibrary._make_code = lambda self: made.append(self.name) or make_code(self)

@numba.njit
def inner(x):
    return x + 1

@numba.vectorize
def each(x):
    return inner(x)

@numba.njit
def apply(function, x):
    return function(x)

@numba.cfunc("float64(float64)")
def callback(x):
    return inner(x)

import numpy as np
print(each(np.arange(3.0)).tolist(), apply(inner, 1.0), callback.ctypes(3.0), len(made) > 3)
"""


def test_functions_that_others_compile_with_numba_are_compiled_as_ever() -> None:
    assert run_python("-c", OTHERS).stdout.strip() == f"[1.0, 2.0, 3.0] 2.0 4.0 {DEFERS}"


LITERALS = """
from fogsim.core.jit import kernel

@kernel
def scaled(x, times, twice):
    return times * x if twice else x

@kernel
def answer(x, n):
    return scaled(x, 1, True) + scaled(x, 2, False) + scaled(x, n, n > 0)

print(answer(10.0, 3), len(scaled.get_overload.__self__.overloads))
"""


def test_a_kernel_is_compiled_once_for_all_numbers_of_a_type(tmp_path: Path) -> None:
    (tmp_path / "literals.py").write_text(LITERALS)
    kept = {"NUMBA_CACHE_DIR": str(tmp_path / "kept")}
    done = run_python("literals.py", cwd=tmp_path, environment=kept)
    assert done.stdout.split() == ["50.0", "1"]


DISABLED = """
import numba
import numpy as np
from fogsim.core.jit import kernel

@kernel
def total(values):
    return np.cumsum(values)[-1]

@numba.njit
def plain(x):
    return x

print(total(np.arange(3.0)), hasattr(total, "overloads"), type(plain).__name__, numba.config.DISABLE_JIT)
"""


def test_who_debugs_own_functions_without_compiling_has_the_kernels_compiled(tmp_path: Path) -> None:
    (tmp_path / "disabled.py").write_text(DISABLED)
    disabled = {"NUMBA_CACHE_DIR": str(tmp_path / "kept"), "NUMBA_DISABLE_JIT": "1"}
    done = run_python("disabled.py", cwd=tmp_path, environment=disabled)
    assert done.stdout.split() == ["3.0", "True", "function", "1"]
