"""Networks in ONNX files: data that onnxruntime computes, never code, and no other file is read."""

import functools
import threading
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogsim.core.files.readers import read_bytes
from fogsim.core.registry.user_code import described
from fogsim.errors import InputError, MissingDependencyError, shown

_STANDARD = ("", "ai.onnx", "ai.onnx.ml")
"""Domains of ONNX's own operators; those of others may read files (``com.microsoft.EPContext``) or run anything."""

_MOST_MEMORY = 2**30
"""Memory for the tensors of all models of a process [bytes]; a small file can ask for any amount."""

LONGEST_TRIAL = 10.0
"""Time in which a model must answer when it is loaded [s]."""


@dataclass(frozen=True, slots=True)
class OnnxNetwork:
    """A network that is data; whoever uses it checks its inputs and outputs."""

    path: Path
    metadata: Mapping[str, str]
    session: Any  # What computes it

    def outputs(self, given: NDArray[Any], options: Any = None) -> list[Any]:
        """Outputs for its only input, not checked; `options` are a run's of onnxruntime."""
        found: list[Any] = self.session.run(None, {self.session.get_inputs()[0].name: given}, options)
        return found

    def check_output(self, given: NDArray[Any], what: str, expected: str, shapes: Collection[tuple[int, ...]]) -> None:
        """InputError unless one float32 output of one of `shapes` comes in `LONGEST_TRIAL` for an input, `what`."""
        options = _libraries()[1].RunOptions()
        timer = threading.Timer(LONGEST_TRIAL, setattr, (options, "terminate", True))
        timer.start()
        try:
            found = self.outputs(given, options)
        except Exception as error:  # onnxruntime's have no common base
            took = f" (after {LONGEST_TRIAL:g} s)" if options.terminate else ""
            raise InputError(f"{self.path}: the model fails on {what}{took}: {described(error, None)}") from error
        finally:
            timer.cancel()
        if not (len(found) == 1 and isinstance(found[0], np.ndarray)):
            got = ", ".join(shown(one.name) for one in self.session.get_outputs())
        elif found[0].dtype == np.float32 and found[0].shape in shapes:
            return
        else:
            got = f"{found[0].dtype} of shape {found[0].shape}"
        raise InputError(f"{self.path}: expected {expected}; got {got}")

    def wrong_input(self, expected: str) -> InputError:
        """An error that says what inputs there are in place of the expected one."""
        given = ", ".join(f"{shown(one.name)}: {one.type} {one.shape}" for one in self.session.get_inputs())
        return InputError(f"{self.path}: expected {expected}; got {given or 'none'}")


def read_network(path: Path) -> OnnxNetwork:
    """Read a network and check that it is data; InputError says what was expected and what came."""
    content = read_bytes(path)
    onnx, runtime = _libraries()
    try:
        model = onnx.load_model_from_string(content)
    except Exception as error:  # protobuf's, which is no dependency of its own
        raise InputError(f"{path}: expected an ONNX model, got another file: {described(error, None)}") from error
    metadata = {one.key: one.value for one in model.metadata_props}
    _refuse_reach(path, onnx, model)
    # Only what was checked goes on: no fields that this version does not know, no options for onnxruntime.
    model.DiscardUnknownFields()
    del model.metadata_props[:]
    try:
        return OnnxNetwork(path, metadata, _session(runtime, model.SerializeToString()))
    except Exception as error:  # onnxruntime's have no common base
        raise InputError(f"{path}: onnxruntime cannot run the model: {described(error, None)}") from error


def _libraries() -> tuple[Any, Any]:
    try:
        import onnx  # noqa: PLC0415 - an extra
        import onnxruntime  # noqa: PLC0415 - an extra
    except ImportError as error:
        raise MissingDependencyError(
            f"an ONNX model needs onnx and onnxruntime ({error}): pip install 'fogsim[onnx]'"
        ) from error
    return onnx, onnxruntime


def _refuse_reach(path: Path, onnx: Any, model: Any) -> None:
    """Refuse what reaches beyond the file's own tensors and ONNX's own operators, and what may never end."""
    for part in _parts(model):
        kind = type(part).__name__
        if kind == "TensorProto" and (part.external_data or part.data_location == onnx.TensorProto.EXTERNAL):
            where = next((one.value for one in part.external_data if one.key == "location"), "")
            raise InputError(
                f"{path}: expected all weights in the file, got tensor {shown(part.name)} with external data in "
                f"{shown(where)}; export it with external_data=False"
            )
        if kind == "NodeProto" and part.domain not in _STANDARD:
            raise InputError(
                f"{path}: expected ONNX's own operators, got {shown(part.op_type)} of the domain {shown(part.domain)}"
            )
        if kind == "FunctionProto" or (kind == "GraphProto" and part is not model.graph):
            raise InputError(
                f"{path}: expected one graph of operators, got {shown(part.name)} within it; If, Loop, Scan and "
                "functions are refused"
            )


def _parts(message: Any) -> Iterator[Any]:
    """Messages within a message of protobuf, however deep."""
    for field, value in message.ListFields():
        if field.message_type is not None:
            for part in value if isinstance(value, Iterable) else (value,):
                yield part
                yield from _parts(part)


def _session(runtime: Any, content: bytes) -> Any:
    _limit_memory()
    options = runtime.SessionOptions()
    # One thread: the same on every machine, and studies use the others.
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 4
    options.add_session_config_entry("session.load_model_format", "ONNX")
    options.add_session_config_entry("session.use_env_allocators", "1")
    # Loading computes nothing, so that its time depends on the file's size alone; nor does it print and try again.
    further = {"disabled_optimizers": ["ConstantFolding"], "enable_fallback": 0}
    return runtime.InferenceSession(content, options, ["CPUExecutionProvider"], **further)


@functools.cache
def _limit_memory() -> None:
    runtime = _libraries()[1]
    place = runtime.OrtMemoryInfo("Cpu", runtime.OrtAllocatorType.ORT_ARENA_ALLOCATOR, 0, runtime.OrtMemType.DEFAULT)
    runtime.create_and_register_allocator(place, runtime.OrtArenaCfg({"max_mem": _MOST_MEMORY}))
