"""A run as a trace of ASAM OSI, read back by ASAM's own library."""

import contextlib
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from osi3.osi_environment_pb2 import EnvironmentalConditions
from osi3.osi_object_pb2 import MovingObject
from osi3.osi_trafficlight_pb2 import TrafficLight
from osi3trace.osi_trace import OSITrace

from fogsim.recorders.exchange.osi import OsiRecorder, fog_class
from fogsim.values import Lamp, SignalColour
from fogsim.values.traffic import PersonState, SignalState
from tests.recorders.synthetic import make_step


def test_vehicles_persons_lights_and_fog_come_back(tmp_path: Path) -> None:
    path, lit = tmp_path / "ground_truth.osi", Lamp.LOW_BEAM | Lamp.STOP | Lamp.INDICATOR_LEFT
    recorder = OsiRecorder(path)
    steps = []
    for index in range(3):
        step = make_step(index, time=0.1 * index, route_position=100.0 + 2.5 * index)
        persons = PersonState(
            ("p",), np.array([[1.0, 2.0, 0.1]]), np.array([0.5]), np.array([1.2]), ("w",), np.array([True])
        )
        signals = SignalState(
            ("j",), ("a_0",), np.array([[5.0, 6.0, 3.0]]), np.array([0.0]), np.array([0.2]), (SignalColour.RED_YELLOW,)
        )
        lamps = np.full(len(step.traffic.ids), int(lit), dtype=np.int32)
        traffic = replace(step.traffic, persons=persons, signals=signals, lamps=lamps)
        steps.append(replace(step, traffic=traffic, truth=replace(step.truth, extinction=math.log(20.0) / 80.0)))
        recorder.record(steps[-1])
    recorder.close(complete=True)
    recorder.close(complete=False)
    recorder.record(steps[-1])

    with contextlib.closing(OSITrace(str(path), "GroundTruth")) as trace:
        messages = list(trace)
    assert [message.timestamp.seconds + 1e-9 * message.timestamp.nanos for message in messages] == pytest.approx(
        [0.0, 0.1, 0.2]
    )
    first, state = messages[0], steps[0].traffic
    ego = next(one for one in first.moving_object if one.id.value == first.host_vehicle_id.value)
    assert ego.source_reference[0].identifier[0] == state.ids[steps[0].ego]
    row = steps[0].ego
    heading, half = float(state.heading[row]), 0.5 * float(state.length[row])
    front = ego.base.position.x + half * math.cos(heading), ego.base.position.y + half * math.sin(heading)
    assert front == pytest.approx(tuple(state.position[row][:2]))
    assert ego.base.position.z == pytest.approx(state.position[row][2] + 0.5 * state.height[row])
    lights = ego.vehicle_classification.light_state
    state_of = MovingObject.VehicleClassification.LightState
    assert lights.brake_light_state == state_of.BRAKE_LIGHT_STATE_NORMAL
    assert lights.indicator_state == state_of.INDICATOR_STATE_LEFT
    assert lights.rear_fog_light == state_of.GENERIC_LIGHT_STATE_OFF
    (person,) = (one for one in first.moving_object if one.type == MovingObject.TYPE_PEDESTRIAN)
    assert math.hypot(person.base.velocity.x, person.base.velocity.y) == pytest.approx(1.2)
    colours = {light.classification.color for light in first.traffic_light}
    assert colours == {TrafficLight.Classification.COLOR_RED, TrafficLight.Classification.COLOR_YELLOW}
    assert first.environmental_conditions.fog == EnvironmentalConditions.FOG_THICK
    # One thing keeps its number, and no two things share one.
    numbers = [{one.id.value for one in (*message.moving_object, *message.traffic_light)} for message in messages]
    assert numbers[0] == numbers[1] == numbers[2]
    assert len(numbers[0]) == len(first.moving_object) + len(first.traffic_light)


def test_obstacles_and_persons_are_no_vehicles(tmp_path: Path) -> None:
    recorder, step = OsiRecorder(path := tmp_path / "ground_truth.osi"), make_step()
    recorder.record(replace(step, traffic=replace(step.traffic, types=("box", "pedestrian"))))
    recorder.close(complete=True)
    with contextlib.closing(OSITrace(str(path), "GroundTruth")) as trace:
        (message,) = trace
    objects = message.moving_object
    assert [one.type for one in objects] == [MovingObject.TYPE_OTHER, MovingObject.TYPE_PEDESTRIAN]
    assert not any(one.HasField("vehicle_classification") for one in objects)


def test_classes_of_fog_begin_where_osi_has_them() -> None:
    for visibility, name in [
        (49.9, "DENSE"),
        (50.0, "THICK"),
        (200.0, "LIGHT"),
        (999.0, "LIGHT"),
        (1000.0, "MIST"),
        (math.inf, "EXCELLENT_VISIBILITY"),
    ]:
        assert fog_class(visibility) == name
        assert f"FOG_{name}" in EnvironmentalConditions.Fog.keys()  # noqa: SIM118 - no mapping
