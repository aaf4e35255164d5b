"""Networks of a few nodes in ONNX files: ln k = bias + weight × the frame's mean, and policies of a matrix."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

NCHW = (1, 3, 12, 16)


def write_network(
    path: Path,
    *,
    shape: Sequence[int | str] = NCHW,
    bias: Sequence[float] = (-3.0, 0.1),
    weight: Sequence[float] = (1.0, 0.0),
    metadata: Mapping[str, str] | None = None,
    change: Any = None,
) -> Path:
    """Write a network; `change` is called with the model before."""
    from onnx import TensorProto, helper, numpy_helper

    numbers = {"bias": np.array([bias], np.float32), "weight": np.array([weight], np.float32), "rows": np.array([1, 1])}
    nodes = [
        helper.make_node("ReduceMean", ["frame"], ["mean"], keepdims=0),
        helper.make_node("Reshape", ["mean", "rows"], ["row"]),
        helper.make_node("Mul", ["row", "weight"], ["scaled"]),
        helper.make_node("Add", ["scaled", "bias"], ["answer"]),
    ]
    graph = helper.make_graph(
        nodes,
        "tiny",
        [helper.make_tensor_value_info("frame", TensorProto.FLOAT, shape)],
        [helper.make_tensor_value_info("answer", TensorProto.FLOAT, None)],
        [numpy_helper.from_array(value, name) for name, value in numbers.items()],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
    helper.set_model_props(model, dict(metadata or {}))
    if change is not None:
        change(model)
    path.write_bytes(model.SerializeToString())
    return path


def write_policy(path: Path, weight: ArrayLike) -> Path:
    """Write a network that multiplies a state by a matrix (entries of the state, outputs)."""
    from onnx import TensorProto, helper, numpy_helper

    matrix = np.asarray(weight, np.float32)
    graph = helper.make_graph(
        [helper.make_node("MatMul", ["state", "weight"], ["action"])],
        "policy",
        [helper.make_tensor_value_info("state", TensorProto.FLOAT, [1, len(matrix)])],
        [helper.make_tensor_value_info("action", TensorProto.FLOAT, None)],
        [numpy_helper.from_array(matrix, "weight")],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
    path.write_bytes(model.SerializeToString())
    return path
