"""What stands in for functions of numba answers as they do, and no longer than one of FogSim's kernels is compiled."""

import gc
from collections.abc import Iterator
from typing import Any, NamedTuple

import numba
import numpy as np
import pytest
from llvmlite.binding import ffi
from numba.core import base, compiler, ir, types
from numba.core.caching import NullCache
from numba.core.compiler import Flags
from numba.core.errors import TypingError
from numba.core.registry import cpu_target
from numba.core.runtime import _nrt_python, rtsys

from fogsim.core import compiling
from fogsim.core.compiling import shortcuts
from fogsim.core.compiling.code_libraries import LinkedLibrary
from fogsim.core.jit import kernel

pytestmark = pytest.mark.skipif(
    numba.version_info.short not in compiling.KNOWN, reason="nothing stands in for functions of this version of numba"
)


def fogsims(function: Any) -> Any:
    """Kernel of a function that is taken for one of FogSim's, compiled by each process anew."""
    function.__module__ = "fogsim.made_up"
    made: Any = kernel(function)
    made._cache = NullCache()
    return made


class Pair(NamedTuple):
    first: Any
    second: Any


def places() -> list[Any]:
    """What is in the places of numba's functions."""
    replaced = [one for one in shortcuts.SHORTCUTS if isinstance(one, shortcuts.Shortcut)]
    return [ffi.lib._lock._cblist, *(vars(one.owner)[one.name] for one in replaced)]


def test_numba_is_as_it_was_once_a_kernel_is_compiled() -> None:
    before, seen = places(), []
    own = shortcuts.make_no_wrapper

    @fogsims
    def compiled(x: float) -> float:
        return x + 1.0

    restore = shortcuts.Shortcut(compiler.CompilerBase, "compile_extra", lambda *a: seen.append(places()) or fail(a))

    def fail(_: Any) -> None:
        raise TypingError("as told")

    end = restore.take()
    try:
        with pytest.raises(TypingError, match="as told"):
            compiled(1.0)
    finally:
        end()
    assert seen
    assert all(mine is not numbas for mine, numbas in zip(seen[0], before, strict=True))
    assert own in seen[0]
    assert all(now is then for now, then in zip(places(), before, strict=True))
    assert not LinkedLibrary.deferring
    assert compiled(1) == 2.0
    assert all(now is then for now, then in zip(places(), before, strict=True))


def test_versions_of_numba_that_are_not_known_are_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiling, "KNOWN", set())
    before = places()
    end = compiling.begin_economy(unrolling=True)
    assert all(now is then for now, then in zip(places(), before, strict=True))
    assert not LinkedLibrary.deferring
    end()


def test_options_are_the_same_where_numba_says_so() -> None:
    plain, explicit, other = Flags(), Flags(), Flags()
    explicit.nrt = plain.nrt
    other.nrt = not plain.nrt
    for one in (plain, explicit, other):
        assert shortcuts.hash_options(one) == hash(one)
        for another in (plain, explicit, other):
            assert shortcuts.compare_options(one, another) is (one == another)
    assert shortcuts.compare_options(plain, "nrt") is NotImplemented


def statements() -> Iterator[ir.Inst]:
    def read(a: Any, *rest: Any) -> Any:
        total = 0
        for i in range(len(a)):
            if a[i] > 0.5 and rest:
                a[i], total = a[i - 1], (total, i, a[1:2])[1]
                total = max(total, i, key=abs)
        return [total, {"a": a}, (1, (a, total))]

    for block in compiler.run_frontend(read).blocks.values():
        yield from block.body


def test_variables_of_every_instruction_are_found_in_numbas_order() -> None:
    found = 0
    for statement in statements():
        for part in (statement, vars(statement), statement.list_vars(), [statement, (1, "a", None)]):
            expected = statement._rec_list_vars(part)
            assert shortcuts.variables_in(statement, part) == expected
            found += len(expected)
    assert found > 100


@pytest.mark.parametrize(
    "kind", [types.int64, types.Array(types.float64, 2, "C"), types.UniTuple(types.Array(types.int8, 1, "A"), 2)]
)
def test_only_what_holds_an_array_counts_references(kind: types.Type) -> None:
    models = cpu_target.target_context.data_model_manager
    assert shortcuts._counts_references(models, kind) is (kind is not types.int64)


def test_a_type_is_as_large_as_numba_says() -> None:
    context = cpu_target.target_context
    for kind in (types.int8, types.float64, types.UniTuple(types.int32, 3), types.Array(types.float32, 3, "C")):
        stored = context.get_value_type(kind)
        expected = base.BaseContext.get_abi_sizeof(context, stored)
        assert [shortcuts.size_of(context, stored) for _ in range(2)] == [expected, expected]


@fogsims
def rewrite(pair: Pair, i: int, j: int) -> Pair:
    a, b = pair.first, pair.second
    a[i, j] += a[-1, j] * b[j]
    b[-1] = a[i, -2]
    kept = Pair(a[1:, j], Pair(b, a).first[::2])
    return Pair(kept.first.copy(), np.outer(kept.second, b)[0, :] + a[:, 0].sum())


@pytest.mark.parametrize("arrange", [np.ascontiguousarray, np.asfortranarray, lambda a: a[::-1, ::-1]])
def test_elements_are_where_python_finds_them_and_memory_is_given_back(arrange: Any) -> None:
    numbers = np.random.default_rng(0).normal(size=(4, 5))
    mine, pythons = (Pair(arrange(numbers.copy()), np.arange(5.0)) for _ in range(2))
    rewrite(Pair(arrange(numbers.copy()), np.arange(5.0)), 1, 2)
    gc.collect()
    _nrt_python.memsys_enable_stats()
    try:
        before = rtsys.get_allocation_stats()
        got, expected = rewrite(mine, 1, 2), rewrite.py_func(pythons, 1, 2)
        for one, other in zip((*got, *mine), (*expected, *pythons), strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-15)
        del got, one
        gc.collect()
        after = rtsys.get_allocation_stats()
    finally:
        _nrt_python.memsys_disable_stats()
    assert after.mi_alloc - before.mi_alloc == after.mi_free - before.mi_free > 0
