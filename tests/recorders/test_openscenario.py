"""A run as an OpenSCENARIO file: its parts in the order of the format's schema, and what they hold."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fogsim.openscenario.xml_tree import Node, read_xml
from fogsim.recorders.trajectories import FARTHEST, OpenScenarioRecorder
from tests.recorders.synthetic import make_step

# Sequences of ASAM's OpenSCENARIO 1.2 schema, as far as they are written.
SEQUENCES = {
    "OpenSCENARIO": ["FileHeader", "CatalogLocations", "RoadNetwork", "Entities", "Storyboard"],
    "Storyboard": ["Init", "Story", "StopTrigger"],
    "Actions": ["GlobalAction", "Private"],
    "Act": ["ManeuverGroup", "StartTrigger"],
    "ManeuverGroup": ["Actors", "Maneuver"],
    "Event": ["Action", "StartTrigger"],
    "Axles": ["FrontAxle", "RearAxle"],
}
REQUIRED = {
    "FileHeader": {"author", "date", "description", "revMajor", "revMinor"},
    "Performance": {"maxSpeed", "maxAcceleration", "maxDeceleration"},
    "RearAxle": {"maxSteering", "positionX", "positionZ", "trackWidth", "wheelDiameter"},
    "Trajectory": {"name", "closed"},
    "Timing": {"domainAbsoluteRelative", "offset", "scale"},
    "TrajectoryFollowingMode": {"followingMode"},
    "Condition": {"name", "delay", "conditionEdge"},
    "SimulationTimeCondition": {"value", "rule"},
    "Event": {"name", "priority"},
}


@pytest.fixture
def written(tmp_path: Path) -> Node:
    recorder = OpenScenarioRecorder(tmp_path / "scenario.xosc", "made & up")
    for index in range(4):
        step = make_step(index, time=0.1 * index, route_position=100.0 + 2.5 * index)
        visibility = math.inf if index < 2 else 80.0
        extinction = 0.0 if math.isinf(visibility) else math.log(20.0) / visibility
        recorder.record(replace(step, truth=replace(step.truth, extinction=extinction)), {})
    recorder.close(complete=True)
    recorder.close(complete=False)
    return read_xml(tmp_path / "scenario.xosc")


def test_parts_are_in_the_order_of_the_schema_with_what_they_must_have(written: Node) -> None:
    for node in written.walk():
        order = SEQUENCES.get(node.tag)
        if order:
            places = [order.index(child.tag) for child in node.children]
            assert places == sorted(places), node.path
        assert REQUIRED.get(node.tag, set()) <= node.attributes.keys(), node.path
    entities = {node.attributes["name"] for node in written.walk() if node.tag == "ScenarioObject"}
    assert {node.attributes["entityRef"] for node in written.walk() if "entityRef" in node.attributes} == entities


def test_fog_is_its_meteorological_visibility_and_changes_when_it_does(written: Node) -> None:
    ranges = [float(node.attributes["visualRange"]) for node in written.walk() if node.tag == "Fog"]
    assert ranges == [FARTHEST, pytest.approx(80.0, rel=1e-5)]
    (event,) = (node for node in written.walk() if node.tag == "Event" and "fog" in node.attributes["name"])
    (condition,) = (node for node in event.walk() if node.tag == "SimulationTimeCondition")
    assert float(condition.attributes["value"]) == pytest.approx(0.2)


def test_trajectories_bring_the_front_bumper_where_it_was(written: Node) -> None:
    step = make_step(3, time=0.3, route_position=107.5)
    for row, name in enumerate(step.traffic.ids):
        entity = next(n for n in written.walk() if n.tag == "ScenarioObject" and n.attributes["name"] == name)
        centre = next(float(n.attributes["x"]) for n in entity.walk() if n.tag == "Center")
        length = next(float(n.attributes["length"]) for n in entity.walk() if n.tag == "Dimensions")
        trajectory = next(n for n in written.walk() if n.tag == "Trajectory" and n.attributes["name"] == name)
        vertices = [n for n in trajectory.walk() if n.tag == "Vertex"]
        assert [float(v.attributes["time"]) for v in vertices] == pytest.approx([0.0, 0.1, 0.2, 0.3])
        last = vertices[-1].children[0].children[0].attributes
        heading = float(last["h"])
        front = np.array([float(last["x"]), float(last["y"])]) + (centre + 0.5 * length) * np.array(
            [math.cos(heading), math.sin(heading)]
        )
        assert front == pytest.approx(step.traffic.position[row, :2], abs=1e-3)


def test_a_run_that_was_cut_short_says_so(tmp_path: Path) -> None:
    recorder = OpenScenarioRecorder(tmp_path / "scenario.xosc", "short")
    recorder.record(make_step(), {})
    recorder.close(complete=False)
    root = read_xml(tmp_path / "scenario.xosc")
    assert "cut short" in root.children[0].attributes["description"]
    assert sum(node.tag == "Vertex" for node in root.walk()) == 2 * len(make_step().traffic.ids)


def test_obstacles_and_persons_are_no_vehicles(tmp_path: Path) -> None:
    recorder = OpenScenarioRecorder(tmp_path / "scenario.xosc", "made")
    step = make_step()
    recorder.record(replace(step, traffic=replace(step.traffic, types=("box", "pedestrian"))), {})
    recorder.close(complete=True)
    objects = [node for node in read_xml(tmp_path / "scenario.xosc").walk() if node.tag == "ScenarioObject"]
    bodies = [child for node in objects for child in node.children]
    assert [(body.tag, body.attributes["mass"]) for body in bodies] == [("MiscObject", "75.0"), ("Pedestrian", "75.0")]
    assert [body.attributes.get("miscObjectCategory") for body in bodies] == ["obstacle", None]
    assert [[part.tag for part in body.children] for body in bodies] == [["BoundingBox"]] * 2
