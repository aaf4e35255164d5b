"""A trained agent as a controller: what it is given, what becomes of its answer, and which files are refused."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from tiny_network import write_policy

import fogsim
from fogsim.advice import CONTROLLERS
from fogsim.advice.agent import AGENT_STATE
from fogsim.errors import InputError, MethodError
from fogsim.fusion import FUSIONS
from fogsim.values import Belief, Control, LeadMeasurement, LightMeasurement, Observation
from fogsim_envs.task.observation import STATE_FEATURES

pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")
PAGE = (Path(__file__).resolve().parents[2] / "docs" / "how_to" / "own_controller.md").read_text(encoding="utf-8")
IGNORANT: Belief = FUSIONS["none"]().update([], 0.0)


def driven(path: Path, observation: Observation) -> Control:
    return CONTROLLERS.find(f"onnx:{path.name}", path.parent)().control_by_belief(observation, IGNORANT)


def seen(speed: float, **sensors: object) -> Observation:
    return Observation(np.zeros((1, 1, 3), np.uint8), speed, **sensors)


def test_the_page_names_the_entries_that_a_controller_knows() -> None:
    (printed,) = re.findall(r"^known = \[(.*)\]", PAGE, re.MULTILINE)
    assert [STATE_FEATURES[int(one)] for one in printed.split(",")] == list(AGENT_STATE)


def test_each_entry_has_its_place_and_scale(tmp_path: Path) -> None:
    """The network gives one entry; −1 … 1 is −8 … 2.5 m/s²."""
    observation = seen(20.0, lead=LeadMeasurement(60.0, -5.0), light=LightMeasurement(100.0))
    expected = {"speed": -0.2, "lead_present": 1.0, "lead_distance": -0.4, "lead_relative_speed": -0.2}
    for name, value in {**expected, "ambient_light": 0.0}.items():
        weight = np.zeros((11, 1))
        weight[AGENT_STATE.index(name)] = 1.0
        path = write_policy(tmp_path / f"{name}.onnx", weight)
        found = driven(path, observation).acceleration
        assert found == pytest.approx(value * (2.5 if value > 0.0 else 8.0), abs=1e-6), name
    weight[:] = 100.0
    assert driven(write_policy(tmp_path / "far.onnx", weight), observation) == Control(acceleration=2.5)


def test_an_agent_drives_a_scenario(tmp_path: Path) -> None:
    """Braking for the lead alone: −8 m/s² once it is tracked, through the actuators."""
    weight = np.zeros((11, 1))
    weight[AGENT_STATE.index("lead_present")] = -1.0
    write_policy(tmp_path / "policy.onnx", weight)
    (scenario,) = re.findall(r"```yaml\n(# own_brake.fog.yaml\n.*?)```", PAGE, re.DOTALL)
    text = scenario.partition("expect:")[0].replace("$fog", "100 m").replace("20 s", "6 s")
    controller = '{method: "onnx:policy.onnx", period: 0.5 s, lag: 0 s}'
    (tmp_path / "drive.yaml").write_text(text.replace('"mine:EmergencyBrake"', controller), encoding="utf-8")
    steps = list(fogsim.run(fogsim.load_scenario(tmp_path / "drive.yaml"), seed=1))
    found = [step.command.control.acceleration for step in steps if step.command.control is not None]
    assert -8.0 in found
    assert set(found) <= {0.0, -8.0}
    first = next(step.index for step in steps if step.observation.lead is not None)
    # The next request after that instant, the delay of 0.2 s, and the step in which it acts.
    acts = next(step.index for step in steps if step.command.control and step.command.control.acceleration < 0.0)
    assert acts == 5 * math.ceil(first / 5) + 2 + 1


def test_other_networks_are_refused(tmp_path: Path) -> None:
    wrong = {
        r"one input, float32 of shape \(1, 11\); got 'state': tensor\(float\) \[1, 22\]": np.zeros((22, 1)),
        r"one output, float32 of shape \(1, 1\): .*; got float32 of shape \(1, 2\)": np.zeros((11, 2)),
    }
    for message, weight in wrong.items():
        with pytest.raises(InputError, match=message):
            CONTROLLERS.find(f"onnx:{write_policy(tmp_path / 'wrong.onnx', weight)}")
    (tmp_path / "agent.zip").write_bytes(b"PK\x03\x04 not a network")
    with pytest.raises(InputError, match="expected an ONNX model, got another file"):
        CONTROLLERS.find(f"onnx:{tmp_path / 'agent.zip'}")
    nothing = write_policy(tmp_path / "nan.onnx", np.full((11, 1), np.nan))
    with pytest.raises(MethodError, match=r"controller 'onnx:nan.onnx': its network: expected one output"):
        driven(nothing, seen(20.0))
