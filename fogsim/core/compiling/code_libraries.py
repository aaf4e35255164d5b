"""Machine code for what Python calls, and none for what is compiled into it.

numba makes machine code of each function that another one calls, though the caller has a copy of its own, and optimises
that copy again in each caller of a caller. What is linked is simplified here, once, and optimised where it arrives.
"""

import contextlib
import glob
import hashlib
import io
import pickle
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

from llvmlite.binding import (  # type: ignore[import-untyped]
    ModuleRef,
    create_new_function_pass_manager,
    create_pass_builder,
    create_pipeline_tuning_options,
)
from numba.core import caching, codegen, config
from numba.core.environment import lookup_environment

from fogsim.core.files.user_cache import read_entry, write_entry


class KeptCode(caching.IndexDataCacheFile):  # type: ignore[misc] # numba is untyped
    """Index and data files of one kernel, as numba writes them, each followed by its checksum."""

    @classmethod
    def take_over(cls, cache: caching.Cache) -> None:
        """Let a cache read and write these files in place of numba's own."""
        locator = cache._impl.locator
        cache._cache_file = cls(cache.cache_path, cache._impl.filename_base, locator.get_source_stamp())

    def save(self, key: Any, data: Any) -> None:
        """Keep a kernel; where it cannot be written, as on a full disk, the next process compiles again.

        The code is written first, into a file named after its digest, so that no index points to other code, whenever
        this process ends and whatever others write meanwhile.
        """
        with contextlib.suppress(OSError):
            overloads = self._load_index()
            number = int.from_bytes(hashlib.sha256(self._dump(data)).digest()[:8])
            self._save_data(overloads.setdefault(key, self._data_name(number)), data)
            self._save_index(overloads)
            # Code of earlier sources.
            own, kept = self._index_name.removesuffix("nbi"), {*overloads.values()}
            for file in Path(self._index_path).parent.glob(f"{glob.escape(own)}*.nbc"):
                if file.name not in kept:
                    file.unlink()

    def _load_index(self) -> Any:
        if read_entry(Path(self._index_path)) is None:
            return {}
        try:
            return super()._load_index()
        except Exception:  # noqa: BLE001 - an older version's index names classes that are gone or have changed
            return {}

    def _load_data(self, name: str) -> Any:
        content = read_entry(Path(self._data_path(name)))
        try:
            return pickle.loads(content or b"")  # noqa: S301 - in the user's own cache, or part of the installation
        except Exception as error:
            # numba takes this for a file that has been removed.
            raise OSError(f"{name} is missing, damaged or of an older version") from error

    @contextlib.contextmanager
    def _open_for_write(self, filepath: str) -> Iterator[io.BytesIO]:
        content = io.BytesIO()
        yield content
        write_entry(Path(filepath), content.getvalue())


_ENVIRONMENT = "_ZN08NumbaEnv"
"""Begins the name of the place where a function's code finds what belongs to it in Python, as errors that it raises."""

_CALLED_FROM_PYTHON = "_ZN7cpython"
"""Begins the name of a function that takes Python's objects."""


_NAMED = "named"
"""Marks FogSim's way to keep a library, among numba's own."""


class LinkedLibrary(codegen.JITCodeLibrary):  # type: ignore[misc] # numba is untyped
    """Compiled functions that others link; machine code is made of them when it is asked for."""

    # Whether what is compiled is put off so: within FogSim's kernels, and not within anybody else's
    deferring: ClassVar[bool] = False

    # Whether loops are unrolled: it makes drawing faster, and other kernels only larger
    unrolling: ClassVar[bool] = True

    _put_off = _is_own = False

    def add_ir_module(self, ir_module: Any) -> None:
        """Take a module in and apart: its instructions name each other, which garbage collection would have to find."""
        super().add_ir_module(ir_module)
        if self.deferring:
            self._is_own = True
            for function in ir_module.functions:
                for block in function.blocks:
                    block.instructions.clear()

    def _optimize_functions(self, ll_module: ModuleRef) -> None:
        """Simplify what is defined in a module, lightly: it is optimised once more where it arrives."""
        if not self.deferring:
            super()._optimize_functions(ll_module)
            return
        ll_module.data_layout = self._codegen._data_layout
        builder, passes = self._codegen._pass_builder(opt=1), create_new_function_pass_manager()
        passes.add_sroa_pass()
        passes.add_simplify_cfg_pass()
        passes.add_instruction_combine_pass()
        passes.add_simplify_cfg_pass()
        passes.add_refprune_pass()
        for function in ll_module.functions:
            if not function.is_declaration:
                passes.run(function, builder)

    def _optimize_final_module(self) -> None:
        if not self.deferring:
            super()._optimize_final_module()
        elif not self._is_linked_only():
            self._optimize_linked()

    def _optimize_linked(self) -> None:
        """As numba does, but once and at level 2: more makes nothing faster here, and takes longer."""
        options = create_pipeline_tuning_options(2)
        options.loop_vectorization, options.slp_vectorization = bool(config.LOOP_VECTORIZE), bool(config.SLP_VECTORIZE)
        options.loop_unrolling = options.loop_interleaving = self.unrolling
        builder = create_pass_builder(self._codegen._tm, options)
        passes = builder.getModulePassManager()
        passes.add_refprune_pass(codegen._parse_refprune_flags())
        passes.run(self._final_module, builder)

    def _is_linked_only(self) -> bool:
        return self.deferring and not any(
            function.name.startswith(_CALLED_FROM_PYTHON) and not function.is_declaration
            for function in self._final_module.functions
        )

    def _finalize_final_module(self) -> None:
        if self._object_caching_enabled and self._compiled_object:
            # It comes from the disk with its machine code.
            super()._finalize_final_module()
        elif self._is_linked_only():
            self._finalize_dynamic_globals()
            self._verify_declare_only_symbols()
            self._put_off = self._finalized = True
        else:
            self._make_code()

    def _make_code(self) -> None:
        if self._put_off:
            self._optimize_linked()
        self._put_off = False
        super()._finalize_final_module()
        # What is linked has its places here alone.
        for variable in self._final_module.global_variables:
            if variable.name.startswith(_ENVIRONMENT):
                environment = lookup_environment(variable.name)
                if environment is not None:
                    self._codegen.set_env(variable.name, environment)

    def serialize_using_object_code(self) -> Any:
        """Machine code and the names in it; numba keeps them with all that others would link, and a load reads that."""
        if not self._is_own:
            return super().serialize_using_object_code()
        parts = (self._final_module.functions, self._final_module.global_variables)
        names = [one.name for part in parts for one in part if not one.is_declaration]
        return self.name, _NAMED, (self._get_compiled_object(), names)

    @classmethod
    def _unserialize(cls, owner: codegen.Codegen, state: Any) -> Any:
        name, kind, (code, names) = state
        if kind != _NAMED:
            return super()._unserialize(owner, state)
        library = owner.create_library(name)
        library.enable_object_caching()
        library._set_compiled_object(code)
        library._finalize_final_module()
        owner._engine._defined_symbols.update(names)
        return library

    def get_pointer_to_function(self, name: str) -> int:
        """Address of a function, whose machine code is made now if it was put off; 0 if it is not defined here."""
        self._ensure_finalized()
        if self._put_off:
            if all(function.name != name or function.is_declaration for function in self._final_module.functions):
                return 0
            self._make_code()
        return int(super().get_pointer_to_function(name))

    def _get_compiled_object(self) -> Any:
        if self._put_off:
            self._make_code()
        return super()._get_compiled_object()


def defer_code() -> None:
    """Let numba use `LinkedLibrary`."""
    if codegen.JITCPUCodegen._library_class is LinkedLibrary:
        return
    codegen.JITCPUCodegen._library_class = LinkedLibrary
    set_env = codegen.JITCPUCodegen.set_env

    def set_env_if_there(self: Any, name: str, environment: Any) -> None:
        """Do without the place that code has which was not made."""
        if self._engine.get_global_value_address(name):
            set_env(self, name, environment)

    codegen.JITCPUCodegen.set_env = set_env_if_there
