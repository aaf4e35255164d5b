"""Networks in ONNX files: data that onnxruntime computes, never code, and no other file is read."""

import functools
import math
import threading
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from fogsim.core.files.readers import number_in_text, read_bytes
from fogsim.core.registry.guard import guarded_call
from fogsim.core.registry.user_code import described
from fogsim.errors import InputError, MethodError, MissingDependencyError, shown

_CONFORMAL = "fogsim.conformal"
"""Key of a model's metadata: factor for its deviations with which 90 % intervals hold (`conformal_factor`)."""

_STANDARD = ("", "ai.onnx", "ai.onnx.ml")
"""Domains of ONNX's own operators; those of others may read files (``com.microsoft.EPContext``) or run anything."""

_MOST_PIXELS = 2**22
"""Largest input of a model [px]."""

_MOST_MEMORY = 2**30
"""Memory for the tensors of all models of a process [bytes]; a small file can ask for any amount."""

LONGEST_TRIAL = 10.0
"""Time in which a model must answer when it is loaded [s]."""

_INPUT = f"one input, float32 of shape (1, 3, H, W) or (1, H, W, 3) with fixed H and W and at most {_MOST_PIXELS} px"
_OUTPUT = "one output, float32 of shape (1, 2): ln k, with k in 1/m, and its standard deviation"


@dataclass(frozen=True, slots=True)
class OnnxModel:
    """A checked model."""

    path: Path  # Its file
    size: tuple[int, int]  # Rows and columns of the frames that it reads [px]
    channels_first: bool  # Whether its input is (1, 3, H, W)
    factor: float  # Factor for its deviations by its calibration; 1 without one
    session: Any  # What computes it

    def outputs(self, pixels: NDArray[np.float32], options: Any = None) -> list[Any]:
        """Outputs for an image of (H, W, 3) with values 0 … 1, not checked; `options` are a run's of onnxruntime."""
        tensor = pixels.transpose(2, 0, 1) if self.channels_first else pixels
        found: list[Any] = self.session.run(None, {self.session.get_inputs()[0].name: tensor[None]}, options)
        return found

    def read(self, image: NDArray[Any], full: int, name: str, time_limit: float | None) -> tuple[float, float]:
        """The two numbers for a frame with values 0 … full, averaged over areas to its size; MethodError if none."""
        rows, cols = self.size
        scaled = cv2.resize(image.astype(np.float32) / full, (cols, rows), interpolation=cv2.INTER_AREA)
        pixels = np.repeat(scaled[..., None], 3, axis=2) if scaled.ndim == 2 else scaled
        who = f"estimator {name!r}: its model"
        # A partial, since the line of a function of FogSim's says nothing about a model's failure.
        (found,) = guarded_call(functools.partial(self.outputs), who, None, time_limit)(pixels)
        if found.size != 2:
            raise MethodError(f"{who}: expected {_OUTPUT}; got shape {found.shape}")
        log_extinction, deviation = found.ravel().tolist()
        return log_extinction, deviation * self.factor


def read_model(path: Path) -> OnnxModel:
    """Read and check a model; InputError says what was expected and what came."""
    content = read_bytes(path)
    onnx, runtime = _libraries()
    try:
        model = onnx.load_model_from_string(content)
    except Exception as error:  # protobuf's, which is no dependency of its own
        raise InputError(f"{path}: expected an ONNX model, got another file: {described(error, None)}") from error
    factor = _factor(path, model)
    _refuse_reach(path, onnx, model)
    # Only what was checked goes on: no fields that this version does not know, no options for onnxruntime.
    model.DiscardUnknownFields()
    del model.metadata_props[:]
    try:
        session = _session(runtime, model.SerializeToString())
    except Exception as error:  # onnxruntime's have no common base
        raise InputError(f"{path}: onnxruntime cannot run the model: {described(error, None)}") from error
    size, channels_first = _input(path, session)
    checked = OnnxModel(path, size, channels_first, factor, session)
    _check_outputs(checked, runtime.RunOptions())
    return checked


def _libraries() -> tuple[Any, Any]:
    try:
        import onnx  # noqa: PLC0415 - an extra
        import onnxruntime  # noqa: PLC0415 - an extra
    except ImportError as error:
        raise MissingDependencyError(
            f"an ONNX model needs onnx and onnxruntime ({error}): pip install 'fogsim[onnx]'"
        ) from error
    return onnx, onnxruntime


def _factor(path: Path, model: Any) -> float:
    metadata = {one.key: one.value for one in model.metadata_props}
    if _CONFORMAL not in metadata:
        return 1.0
    return number_in_text(f"{path}: metadata", _CONFORMAL, metadata[_CONFORMAL], 1e-3, 1e3)


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


def _input(path: Path, session: Any) -> tuple[tuple[int, int], bool]:
    """Rows and columns of the input, and whether its channels come first."""
    inputs = session.get_inputs()
    if len(inputs) == 1 and inputs[0].type == "tensor(float)" and len(inputs[0].shape) == 4:
        batch, *rest = inputs[0].shape
        channels_first = rest[0] == 3
        size = tuple(rest[1:] if channels_first else rest[:2])
        fits = all(isinstance(one, int) and one > 0 for one in size) and (batch == 1 or not isinstance(batch, int))
        if fits and 3 in (rest[0], rest[2]) and math.prod(size) <= _MOST_PIXELS:
            return size, channels_first
    given = ", ".join(f"{shown(one.name)}: {one.type} {one.shape}" for one in inputs) or "none"
    raise InputError(f"{path}: expected {_INPUT}; got {given}")


def _check_outputs(model: OnnxModel, options: Any) -> None:
    """Check the outputs for a grey frame: the model may leave their shapes open."""
    timer = threading.Timer(LONGEST_TRIAL, setattr, (options, "terminate", True))
    timer.start()
    try:
        found = model.outputs(np.full((*model.size, 3), 0.5, np.float32), options)
    except Exception as error:  # onnxruntime's have no common base
        took = f" (after {LONGEST_TRIAL:g} s)" if options.terminate else ""
        raise InputError(f"{model.path}: the model fails on a grey frame{took}: {described(error, None)}") from error
    finally:
        timer.cancel()
    if not (len(found) == 1 and isinstance(found[0], np.ndarray)):
        given = ", ".join(shown(one.name) for one in model.session.get_outputs())
    elif found[0].dtype == np.float32 and found[0].shape in {(1, 2), (2,)}:
        return
    else:
        given = f"{found[0].dtype} of shape {found[0].shape}"
    raise InputError(f"{model.path}: expected {_OUTPUT}; got {given}")
