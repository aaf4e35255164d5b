"""Networks in ONNX files: what they are given, what becomes of their answer, and what files are refused."""

import json
import math
import re
import sys
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import numpy as np
import pytest
from early_motorway import ROUTES
from PIL import Image
from tiny_network import NCHW, write_network

from fogsim.core.registry.user_code import digest_of
from fogsim.errors import InputError, MethodError, MissingDependencyError
from fogsim.estimators import ESTIMATORS, conformal_factor, make
from fogsim.values import Camera, Estimate, Observation
from fogsim.values.estimate import NORMAL_90_PERCENT

onnx = pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")
from onnx import TensorProto, helper  # noqa: E402 - after the check that it is there

ROOT = Path(__file__).resolve().parents[2]
Command = Callable[..., "CompletedProcess[str]"]
CAMERA = Camera(32, 24, 30.0, (16.0, 12.0), 1.4)


def estimate(path: Path, image: np.ndarray, camera: Camera = CAMERA) -> Estimate:
    return make(f"onnx:{path}", camera).update(Observation(image))


def grey(value: int) -> np.ndarray:
    return np.full((24, 32), value, np.uint8)


def interval(found: Estimate) -> tuple[float, float]:
    """90 % interval of ln k."""
    low, high = found.visibility_interval
    return math.log(math.log(20.0) / high), math.log(math.log(20.0) / low)


def test_the_answer_is_ln_k_of_pixels_over_full_scale(tmp_path: Path) -> None:
    found = estimate(write_network(tmp_path / "n.onnx"), grey(51))
    assert found.valid
    assert math.log(found.extinction) == pytest.approx(-2.8, abs=1e-6)
    assert found.method == f"onnx:{tmp_path / 'n.onnx'}"
    assert found.common_deviation == pytest.approx(0.1)


def test_frames_of_12_bits_have_their_own_full_scale(tmp_path: Path) -> None:
    camera = Camera(32, 24, 30.0, (16.0, 12.0), 1.4, bits=12)
    image = np.full((24, 32, 3), 819, np.uint16)
    found = estimate(write_network(tmp_path / "n.onnx"), image, camera)
    assert math.log(found.extinction) == pytest.approx(-2.8, abs=1e-6)


def test_the_interval_contains_that_of_ln_k(tmp_path: Path) -> None:
    for deviation in (0.05, 0.3):
        low, high = interval(estimate(write_network(tmp_path / "n.onnx", bias=(-3.0, deviation)), grey(0)))
        assert high == pytest.approx(-3.0 + NORMAL_90_PERCENT * deviation, abs=1e-6)
        assert low < -3.0 - NORMAL_90_PERCENT * deviation


def test_a_calibration_in_the_model_widens_its_deviations(tmp_path: Path) -> None:
    found = estimate(write_network(tmp_path / "n.onnx", metadata={"fogsim.conformal": "2.5"}), grey(0))
    assert found.common_deviation == pytest.approx(0.25)


def sees(place: tuple[int, ...]):
    """Change that lets the answer be one value of the input."""

    def change(model) -> None:
        for name, values in (("starts", place), ("ends", [one + 1 for one in place])):
            tensor = helper.make_tensor(name, TensorProto.INT64, [len(values)], list(values))
            model.graph.initializer.append(tensor)
        del model.graph.node[0]
        model.graph.node.insert(0, helper.make_node("Slice", ["frame", "starts", "ends"], ["mean"]))

    return change


@pytest.mark.parametrize("channels_first", [True, False])
def test_frames_are_averaged_over_areas_with_rows_columns_and_channels_in_their_places(
    tmp_path: Path, channels_first: bool
) -> None:
    image = np.random.default_rng(0).integers(0, 256, (24, 32, 3), np.uint8)
    expected = image[8:10, 14:16, 2].mean() / 255.0
    shape = NCHW if channels_first else (1, 12, 16, 3)
    place = (0, 2, 4, 7) if channels_first else (0, 4, 7, 2)
    path = write_network(tmp_path / "n.onnx", shape=("batch", *shape[1:]), change=sees(place))
    assert math.log(estimate(path, image).extinction) == pytest.approx(-3.0 + expected, abs=1e-6)


@pytest.mark.parametrize(
    "bias", [(math.nan, 0.1), (-3.0, math.nan), (-3.0, 0.0), (-3.0, math.inf), (90.0, 0.1)], ids=str
)
def test_what_is_no_answer_means_that_it_cannot_tell(tmp_path: Path, bias: tuple[float, float]) -> None:
    found = estimate(write_network(tmp_path / "n.onnx", bias=bias), grey(0))
    assert not found.valid
    assert str(found.diagnostics["reason"]).startswith("the network gives ln k = ")


def external(model) -> None:
    tensor = model.graph.initializer[0]
    tensor.ClearField("raw_data")
    tensor.data_location = TensorProto.EXTERNAL
    entry = tensor.external_data.add()
    entry.key, entry.value = "location", "weights.bin"


def external_constant(model) -> None:
    """A tensor within an attribute."""
    tensor = TensorProto(name="hidden", data_type=TensorProto.FLOAT, dims=[1, 2], data_location=TensorProto.EXTERNAL)
    model.graph.node.append(helper.make_node("Constant", [], ["unused"], value=tensor))


def foreign(model) -> None:
    model.graph.node[3].domain = "com.microsoft"
    model.opset_import.append(helper.make_opsetid("com.microsoft", 1))


def branching(model) -> None:
    branch = helper.make_graph([], "branch", [], [helper.make_tensor_value_info("bias", TensorProto.FLOAT, [1, 2])])
    model.graph.node.append(helper.make_node("If", ["yes"], ["either"], then_branch=branch, else_branch=branch))


def function(model) -> None:
    model.functions.append(helper.make_function("own", "Twice", [], [], [], []))


def unknown_operator(model) -> None:
    model.graph.node[3].op_type = "Subtract"


def grows_with_light(scale: float):
    """Change to a size by the pixels: more than memory in light of 2 / scale, next to nothing in half of it."""

    def change(model) -> None:
        model.graph.initializer.append(helper.make_tensor("scale", TensorProto.FLOAT, [1], [scale]))
        model.graph.initializer.append(helper.make_tensor("power", TensorProto.FLOAT, [1], [40.0]))
        nodes = [
            helper.make_node("ReduceMean", ["frame"], ["light"], keepdims=0),
            helper.make_node("Mul", ["light", "scale"], ["scaled_light"]),
            helper.make_node("Pow", ["scaled_light", "power"], ["much"]),
            helper.make_node("Cast", ["much"], ["size"], to=TensorProto.INT64),
            helper.make_node("ConstantOfShape", ["size"], ["zeros"]),
            helper.make_node("ReduceMean", ["zeros"], ["zero"], keepdims=0),
        ]
        for i, node in enumerate(nodes):
            model.graph.node.insert(i, node)
        model.graph.node[6].op_type = "Add"
        model.graph.node[6].ClearField("attribute")
        model.graph.node[6].input[:] = ["light", "zero"]

    return change


def three_numbers(model) -> None:
    model.graph.node.append(helper.make_node("Concat", ["answer", "row"], ["three"], axis=1))
    model.graph.output[0].name = "three"


def two_outputs(model) -> None:
    model.graph.output.append(helper.make_tensor_value_info("scaled", TensorProto.FLOAT, None))


def two_inputs(model) -> None:
    model.graph.input.append(helper.make_tensor_value_info("speed", TensorProto.FLOAT, [1]))


def whole_numbers(model) -> None:
    model.graph.input[0].type.tensor_type.elem_type = TensorProto.UINT8
    model.graph.node.insert(0, helper.make_node("Cast", ["frame"], ["frame_"], to=TensorProto.FLOAT))
    model.graph.node[1].input[0] = "frame_"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (external, r"all weights in the file, got tensor 'bias' with external data in 'weights.bin'"),
        (external_constant, r"all weights in the file, got tensor 'hidden' with external data"),
        (foreign, r"ONNX's own operators, got 'Add' of the domain 'com.microsoft'"),
        (branching, r"one graph of operators, got 'branch' within it; If, Loop, Scan and functions are refused"),
        (function, r"one graph of operators, got 'Twice' within it"),
        (unknown_operator, r"onnxruntime cannot run the model: .*Subtract"),
        (grows_with_light(4.0), r"the model fails on a grey frame: .*ConstantOfShape"),
        (three_numbers, r"expected one output, float32 of shape \(1, 2\): ln k, .*; got float32 of shape \(1, 3\)"),
        (two_outputs, r"expected one output, .*; got 'answer', 'scaled'"),
        (two_inputs, r"expected one input, .*; got 'frame': tensor\(float\) \[1, 3, 12, 16\], 'speed': tensor\(float"),
        (whole_numbers, r"expected one input, float32 .*; got 'frame': tensor\(uint8\) \[1, 3, 12, 16\]"),
    ],
    ids=lambda one: getattr(one, "__name__", ""),
)
def test_models_that_are_no_networks_of_one_frame_are_refused(tmp_path: Path, change, message: str) -> None:
    path = write_network(tmp_path / "n.onnx", change=change)
    with pytest.raises(InputError, match=f"^{re.escape(str(path))}: .*{message}") as raised:
        make(f"onnx:{path}", CAMERA)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("shape", [(1, 1, 12, 16), (2, 3, 12, 16), (3, 12, 16), (1, 3, "H", "W"), (1, 3, 4096, 2048)])
def test_inputs_that_are_no_frame_are_refused(tmp_path: Path, shape: tuple[int | str, ...]) -> None:
    path = write_network(tmp_path / "n.onnx", shape=shape)
    with pytest.raises(InputError, match=r"expected one input, .* \(1, 3, H, W\) .* at most 4194304 px; got 'frame'"):
        make(f"onnx:{path}", CAMERA)


def test_frames_are_not_enlarged(tmp_path: Path) -> None:
    path = write_network(tmp_path / "n.onnx", shape=(1, 3, 12, 48))
    with pytest.raises(InputError, match="reads 48×12 pixels, and the camera has 32×24; frames are only made smaller"):
        make(f"onnx:{path}", CAMERA)


@pytest.mark.parametrize("factor", ["wide", "0", "nan", "1e9"])
def test_calibrations_that_are_no_factor_are_refused(tmp_path: Path, factor: str) -> None:
    path = write_network(tmp_path / "n.onnx", metadata={"fogsim.conformal": factor})
    with pytest.raises(InputError, match=rf"metadata: fogsim.conformal must be a number .*, got '{factor}'"):
        make(f"onnx:{path}", CAMERA)


def test_other_files_are_refused(tmp_path: Path) -> None:
    (tmp_path / "n.onnx").write_text("name: a scenario\n")
    with pytest.raises(InputError, match=r"n.onnx: expected an ONNX model, got another file"):
        make(f"onnx:{tmp_path / 'n.onnx'}", CAMERA)
    with pytest.raises(InputError, match=r"m.onnx: cannot be read: No such file"):
        make(f"onnx:{tmp_path / 'm.onnx'}", CAMERA)


def test_the_extra_is_named_where_it_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_network(tmp_path / "n.onnx")
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    with pytest.raises(MissingDependencyError, match=r"pip install 'fogsim\[onnx\]'"):
        make(f"onnx:{path}", CAMERA)


def multiplying(side: int, times: int):
    """Change that lets the model multiply matrices first."""

    def change(model) -> None:
        model.graph.initializer.append(helper.make_tensor("side", TensorProto.INT64, [2], [side, side]))
        model.graph.node.insert(0, helper.make_node("ConstantOfShape", ["side"], ["m0"]))
        for i in range(times):
            model.graph.node.insert(i + 1, helper.make_node("MatMul", [f"m{i}", f"m{i}"], [f"m{i + 1}"]))
        last = next(node for node in model.graph.node if "frame" in node.input)
        model.graph.node.insert(times + 1, helper.make_node("ReduceMax", [f"m{times}"], ["zero"], keepdims=0))
        model.graph.node.insert(times + 2, helper.make_node("Add", ["frame", "zero"], ["frame_"]))
        last.input[0] = "frame_"

    return change


def test_a_model_that_does_not_answer_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fogsim.core.onnx_network.LONGEST_TRIAL", 0.2)
    with pytest.raises(InputError, match=r"the model fails on a grey frame \(after 0.2 s\)"):
        make(f"onnx:{write_network(tmp_path / 'n.onnx', change=multiplying(1000, 1000))}", CAMERA)


def test_a_call_that_takes_too_long_fails(tmp_path: Path) -> None:
    write_network(tmp_path / "n.onnx", change=multiplying(1000, 10))
    network = ESTIMATORS.find("onnx:n.onnx", tmp_path, time_limit=0.05)(CAMERA)
    with pytest.raises(MethodError, match=r"'onnx:n.onnx': its model failed: TimeLimitError: took longer than 0.05 s"):
        network.update(Observation(grey(0)))


def test_a_model_that_fails_on_a_frame_fails_as_a_method(tmp_path: Path) -> None:
    path = write_network(tmp_path / "n.onnx", change=grows_with_light(2.0))
    network = make(f"onnx:{path}", CAMERA)
    assert network.update(Observation(grey(127))).valid
    with pytest.raises(MethodError, match=r"estimator 'onnx:.*n.onnx': its model failed: Fail: .*ConstantOfShape"):
        network.update(Observation(grey(255)))


SCENARIO = f"""
name: guest
traffic: {{net: {ROOT}/scenarios/motorway_fog_bank/motorway.net.xml, routes: [{ROUTES}], ego: ego}}
duration: 1 s
clocks: {{camera_period: 0.5 s, decision_period: 0.5 s}}
camera: {{width: 64, height: 48}}
fog: {{visibility: 80 m}}
estimators: ["onnx:n.onnx"]
advice: none
expect: {{right: {{always: "estimate(onnx:n.onnx).error < 1 %"}}}}
"""


def test_answers_of_another_shape_than_the_first_fail_as_a_method(tmp_path: Path) -> None:
    def counts(model) -> None:
        """Two numbers, and the places of white pixels."""
        model.graph.initializer.append(helper.make_tensor("half", TensorProto.FLOAT, [1], [0.6]))
        nodes = [
            helper.make_node("Greater", ["frame", "half"], ["bright"]),
            helper.make_node("NonZero", ["bright"], ["places"]),
            helper.make_node("Cast", ["places"], ["numbers"], to=TensorProto.FLOAT),
            helper.make_node("Flatten", ["numbers"], ["flat"]),
            helper.make_node("Reshape", ["flat", "line"], ["all"]),
            helper.make_node("Concat", ["answer", "all"], ["many"], axis=1),
        ]
        model.graph.initializer.append(helper.make_tensor("line", TensorProto.INT64, [2], [1, -1]))
        model.graph.node.extend(nodes)
        model.graph.output[0].name = "many"

    network = make(f"onnx:{write_network(tmp_path / 'n.onnx', change=counts)}", CAMERA)
    assert network.update(Observation(grey(100))).valid
    with pytest.raises(MethodError, match=r"its model: expected one output, .*; got shape \(1, 2306\)"):
        network.update(Observation(grey(255)))


def test_a_network_lies_in_the_scenarios_folder(tmp_path: Path, command: Command) -> None:
    folder = tmp_path / "scenario"
    folder.mkdir()
    write_network(folder / "n.onnx", bias=(math.log(math.log(20.0) / 80.0), 0.1), weight=(0.0, 0.0))
    (folder / "guest.yaml").write_text(SCENARIO)
    done = command("run", "scenario/guest.yaml", "--out", "out", "--no-video", "--no-report", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert manifest["versions"]["onnx:n.onnx"] == digest_of(folder / "n.onnx")
    write_network(folder / "n.onnx", change=foreign)
    done = command("validate", "scenario/guest.yaml", cwd=tmp_path)
    assert re.search(r"guest.yaml:8: estimators.0: .*n.onnx: expected ONNX's own operators", done.stderr)


def test_a_network_reads_images(tmp_path: Path, command: Command) -> None:
    write_network(tmp_path / "n.onnx", bias=(math.log(math.log(20.0) / 80.0), 0.1), weight=(0.0, 0.0))
    Image.fromarray(grey(100)).save(tmp_path / "road.png")
    lens = "focal_length_px: 30, principal_point_px: [16, 12]"
    (tmp_path / "camera.yaml").write_text(f"{{width: 32, height: 24, {lens}, mount_height_m: 1.4, pitch_deg: 0}}")
    line = ("estimate", "road.png", "--camera", "camera.yaml", "--json", "--method")
    done = command(*line, "onnx:n.onnx", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["visibility_m"] == pytest.approx(80.0, rel=1e-4)
    done = command(*line, "onnx:m.onnx", cwd=tmp_path)
    assert (done.returncode, "m.onnx: cannot be read: No such file" in done.stderr) == (2, True)


@pytest.mark.parametrize("spread", [0.5, 1.0, 3.0])
def test_calibrated_intervals_hold_on_held_out_residuals(spread: float) -> None:
    """Errors with heavier tails than normal ones, and deviations that are wrong by a factor."""
    rng = np.random.default_rng(5)

    def frames(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        truth, deviation = rng.uniform(-5.0, -2.0, count), rng.uniform(0.05, 0.3, count)
        return truth + spread * deviation * rng.standard_t(3, count), deviation, truth

    factor = conformal_factor(*frames(2000))
    answer, deviation, truth = frames(20_000)
    held = np.abs(answer - truth) <= NORMAL_90_PERCENT * factor * deviation
    assert held.mean() == pytest.approx(0.9, abs=0.02)


def test_few_frames_calibrate_by_their_largest_error_and_fewer_not_at_all() -> None:
    truth, deviation = np.zeros(9), np.full(9, 0.1)
    answer = 0.1 * np.arange(9.0)
    assert conformal_factor(answer, deviation, truth) == pytest.approx(8.0 / NORMAL_90_PERCENT)
    with pytest.raises(InputError, match="at least 9 frames, got 8"):
        conformal_factor(answer[:8], deviation[:8], truth[:8])
    with pytest.raises(InputError, match="positive deviations"):
        conformal_factor(answer, 0.0 * deviation, truth)
    with pytest.raises(InputError, match=r"one length, got shapes \(9,\), \(8,\) and \(9,\)"):
        conformal_factor(answer, deviation[:8], truth)
