"""What numba works out again a hundred thousand times while it compiles, worked out once or not at all.

Each stands in for a function of numba, and answers as that does.
"""

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

from llvmlite.binding import ffi  # type: ignore[import-untyped]
from numba.core import base, cgutils, codegen, cpu, errors, ir, transforms, types
from numba.core.postproc import PostProcessor, VariableLifetime
from numba.core.runtime.context import NRTContext
from numba.core.targetconfig import ConfigStack, TargetConfig
from numba.core.types.functions import BaseFunction
from numba.extending import overload
from numba.np import arrayobj


class Shortcut(NamedTuple):
    """A function that stands in for one of numba's."""

    owner: Any  # Where that is found
    name: str  # By which it is
    function: Callable[..., Any]  # What stands in for it

    def take(self) -> Callable[[], None]:
        """Put it in place; what is returned puts numba's own back."""
        own = vars(self.owner)[self.name]
        setattr(self.owner, self.name, self.function)
        return lambda: setattr(self.owner, self.name, own)


class _UnobservedLock:
    """The lock of LLVM, taken and given back without the events by which numba times it.

    Each of 200,000 LLVM calls would be an event, passed to all functions being compiled in nested calls.
    """

    def take(self) -> Callable[[], None]:
        """Leave the events out; what is returned lets them in again."""
        listeners = ffi.lib._lock._cblist
        ffi.lib._lock._cblist = []

        def restore() -> None:
            ffi.lib._lock._cblist = listeners

        return restore


_call_type = BaseFunction.get_call_type
_size = base.BaseContext.get_abi_sizeof
_hash = TargetConfig.__hash__
_index = arrayobj.basic_indexing
_make_array = arrayobj.make_array


def _resolve_call(function: Any, context: Any, arguments: Any, keywords: Any) -> Any:
    """Signature of a built-in function for types of arguments: looked for once, as its templates stay the same."""
    options = ConfigStack()
    known = vars(function).setdefault("_fogsim_signatures", {})
    key = (context, tuple(arguments), tuple(keywords.items()), options.top() if options else None)
    signature = known.get(key)
    if signature is None:
        signature = known[key] = _call_type(function, context, arguments, keywords)
    return signature


def compare_options(mine: Any, other: Any) -> Any:
    """Whether compiler options are the same: first by those that were set, which are few."""
    if not isinstance(other, TargetConfig):
        return NotImplemented
    if mine is other or (type(mine) is type(other) and mine._values == other._values):
        return True
    return _values(mine) == _values(other)


def _values(options: Any) -> dict[str, Any]:
    chosen = options._values
    return {name: chosen.get(name, option.default) for name, option in options.options.items()}


_hashes: dict[Any, int] = {}


def hash_options(options: Any) -> int:
    """Hash of compiler options: numba takes it of their names, so that it is the same for all of a kind."""
    kind = type(options)
    if kind not in _hashes:
        _hashes[kind] = _hash(options)
    return _hashes[kind]


def _reference_counts(runtime: Any, builder: Any, kind: Any, value: Any) -> list[tuple[Any, Any]]:
    """Types and counters of references in a value: only those of its parts are taken out that have any.

    numba takes out every number of every array of a named tuple, a fifth of all instructions, for LLVM to remove.
    """
    models = runtime._context.data_model_manager
    model = models[kind]
    if not _counts_references(models, kind):
        return []
    found = [(kind, model.get_nrt_meminfo(builder, value))] if model.has_nrt_meminfo() else []
    for part, taken_from in model.traverse(builder):
        # Asked here too: what is not asked for is not taken out.
        if _counts_references(models, part):
            found.extend(_reference_counts(runtime, builder, part, taken_from(value)))
    return found


def _counts_references(models: Any, kind: Any) -> bool:
    model = models[kind]
    counts = getattr(model, "_fogsim_counts_references", None)
    if counts is None:
        counts = model._fogsim_counts_references = model.contains_nrt_meminfo()
    return bool(counts)


_sizes: dict[str, int] = {}


def size_of(context: Any, kind: Any) -> int:
    """Size of a type [byte]: LLVM parses a module of its own for each question."""
    name = str(kind)
    if name not in _sizes:
        _sizes[name] = _size(context, kind)
    return _sizes[name]


def make_no_wrapper(*_: Any) -> None:
    """No way into a function for code in C: what kernels call is called by kernels alone."""


def variables_in(_: Any, value: Any) -> list[Any]:
    """Variables that a part of an instruction names; this is asked a million times."""
    if type(value) is ir.Var:
        return [value]
    if isinstance(value, ir.Inst):
        return list(value.list_vars())
    parts = value.values() if type(value) is dict else value if type(value) in (tuple, list) else ()
    found = []
    for part in parts:
        if type(part) is ir.Var:
            found.append(part)
        elif isinstance(part, tuple | list | dict | ir.Inst):
            found.extend(variables_in(_, part))
    return found


def _index_element(
    context: Any, builder: Any, kind: Any, array: Any, index_types: Any, indices: Any, boundscheck: Any = None
) -> Any:
    """Where an element of an array is: its shape is read once for all indices, its strides where they are needed."""
    if boundscheck or len(indices) != kind.ndim or not all(isinstance(one, types.Integer) for one in index_types):
        return _index(context, builder, kind, array, index_types, indices, boundscheck)
    shape = cgutils.unpack_tuple(builder, array.shape, kind.ndim)
    strides = () if kind.layout in "CF" else cgutils.unpack_tuple(builder, array.strides, kind.ndim)
    places = [
        arrayobj.fix_integer_index(context, builder, *index, length)
        for *index, length in zip(index_types, indices, shape, strict=True)
    ]
    element = cgutils.get_item_pointer2(
        context, builder, data=array.data, shape=shape, strides=strides, layout=kind.layout, inds=places
    )
    return element, [], []


@functools.lru_cache(1024)
def _plain_array(kind: Any) -> Any:
    class Plain(_make_array(kind)):  # type: ignore[misc] # numba is untyped
        """An array's fields; numba asks each time again what an array is as an array."""

        _make_refs = cgutils.create_struct_proxy(kind)._make_refs

    return Plain


def make_array(kind: Any) -> Any:
    """Class that describes an array's fields."""
    return _plain_array(kind) if type(kind) is types.Array else _make_array(kind)


_post_process = PostProcessor.run


def post_process(processor: Any, emit_dels: bool = False, extend_lifetimes: bool = False) -> None:
    """Update a function after a pass: the lives of its variables are worked out where they are used."""
    function = processor.func_ir
    if function.is_generator:
        _post_process(processor, emit_dels, extend_lifetimes)
        return
    function.blocks = transforms.canonicalize_cfg(function.blocks)
    function.variable_lifetime = VariableLifetime(function.blocks)
    function.generator_info = None
    if emit_dels:
        processor._insert_var_dels(extend_lifetimes=extend_lifetimes)


def raise_mismatch(assigned: Any, assigned_to: Any) -> None:
    """Refuse to assign an array to a slice of another shape."""


@overload(raise_mismatch)  # type: ignore[untyped-decorator] # numba is untyped
def _raise_mismatch(assigned: Any, assigned_to: Any) -> Callable[..., None]:  # noqa: ARG001 - their names are the kernel's
    def refuse(assigned: Any, assigned_to: Any) -> None:  # noqa: ARG001
        # numba's names both shapes, and compiles its strings for that: a second in each process.
        raise ValueError("cannot assign slice from input of different size")

    return refuse


_COLOURED = [scheme for name, scheme in vars(errors).items() if name == "HighlightColorScheme"]
"""What colours numba's messages, if colorama is installed."""


def leave_plain(_: Any, message: str, *_styles: Any) -> str:
    """Message without colours: numba makes hundreds that it drops, on the way to the signature that fits."""
    return message


SHORTCUTS: tuple[_UnobservedLock | Shortcut, ...] = (
    _UnobservedLock(),
    *(Shortcut(scheme, "_markup", leave_plain) for scheme in _COLOURED),
    Shortcut(BaseFunction, "get_call_type", _resolve_call),
    Shortcut(TargetConfig, "__eq__", compare_options),
    Shortcut(TargetConfig, "__hash__", hash_options),
    Shortcut(NRTContext, "get_meminfos", _reference_counts),
    Shortcut(base.BaseContext, "get_abi_sizeof", size_of),
    Shortcut(base, "_has_loc", functools.lru_cache(4096)(base._has_loc)),
    Shortcut(cpu.CPUContext, "create_cfunc_wrapper", make_no_wrapper),
    Shortcut(ir.Inst, "_rec_list_vars", variables_in),
    Shortcut(arrayobj, "basic_indexing", _index_element),
    Shortcut(arrayobj, "make_array", make_array),
    Shortcut(arrayobj, "raise_with_shape_context", raise_mismatch),
    Shortcut(codegen.CPUCodegen, "_check_llvm_bugs", functools.cache(codegen.CPUCodegen._check_llvm_bugs)),
    Shortcut(PostProcessor, "run", post_process),
)
"""All of them; each has `take`."""
