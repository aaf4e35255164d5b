"""Where the camera is, by the ego's body, where the scenario does not say."""

import contextlib
import math
from pathlib import Path

import pytest

import fogsim
from fogsim.camera import USUAL_MOUNTS
from fogsim.estimators.night.own_light import setback_of
from fogsim.scenario import build, catalogue
from fogsim.traffic.appearance import EYE_HEIGHTS
from fogsim.traffic.sumo.libsumo_link import load_libsumo
from fogsim.values import Step

SMALL = ("renderer=cpu", "camera.width=96", "camera.height=72", "estimators=[joint_road]", "fog={visibility_m: 150}")
LIGHT = (*SMALL, "traffic.routes=[ego.rou.xml]", "traffic.additional=[]", "traffic.events=[]", "traffic.keep_lane=[]")


def load(folder: Path, vehicle_type: str, *settings: str) -> fogsim.Scenario:
    """The motorway with nobody on it but an ego of a type."""
    (folder / "ego.rou.xml").write_text(
        f'<routes><vType id="t" {vehicle_type}/><route id="r" edges="approach bank"/>'
        '<vehicle id="ego" type="t" route="r" depart="0" departSpeed="20"/></routes>',
        encoding="utf-8",
    )
    path = catalogue()["motorway_fog_bank"]
    (folder / "motorway.net.xml").write_bytes((path.parent / "motorway.net.xml").read_bytes())
    (folder / "scenario.yaml").write_bytes(path.read_bytes())
    return fogsim.load_scenario(str(folder / "scenario.yaml"), [*LIGHT, *settings])


def mounted(step: Step) -> tuple[float, float, float]:
    """Heights of the true and of the told calibration above the road, and setback of the pose [m]."""
    pose, told = step.truth.pose, step.observation.frame.camera
    bumper = step.traffic.position[step.ego]
    assert pose.position[2] - bumper[2] == pytest.approx(step.truth.camera.mount_height)
    return step.truth.camera.mount_height, told.mount_height, math.dist(bumper[:2], pose.position[:2])


def test_the_camera_is_mounted_as_the_body_of_the_ego_has_it(tmp_path: Path) -> None:
    with fogsim.ClosedLoop(load(tmp_path, 'vClass="passenger" length="16.5"')) as loop:
        height, told, setback = mounted(loop.start(1))
    assert (height, setback) == pytest.approx(USUAL_MOUNTS["truck"])
    assert told == height


def test_what_the_scenario_says_holds_for_every_body(tmp_path: Path) -> None:
    said = ("camera.mount_height_m=3", "camera.told.mount_height_error_percent=10")
    with fogsim.ClosedLoop(load(tmp_path, 'vClass="coach"', *said)) as loop:
        assert mounted(loop.start(1)) == pytest.approx((3.0, 3.3, USUAL_MOUNTS["bus"].setback))


def test_a_camera_at_the_front_bumper_is_known_to_be_there(tmp_path: Path) -> None:
    with fogsim.ClosedLoop(load(tmp_path, 'vClass="passenger"', "camera.setback_m=0")) as loop:
        step = loop.start(1)
    assert mounted(step)[2] == 0.0
    assert setback_of(step.observation) == 0.001


def test_in_a_simulation_of_the_users_own_too(tmp_path: Path) -> None:
    scenario = load(tmp_path, 'vClass="bus"')
    with contextlib.closing(load_libsumo()) as libsumo:
        libsumo.start(["sumo", "-n", str(tmp_path / "motorway.net.xml"), "-r", str(tmp_path / "ego.rou.xml")])
        with fogsim.attach(libsumo, scenario=scenario) as session:
            libsumo.simulationStep()
            step = session.observe()
            assert mounted(step)[:2] == pytest.approx((USUAL_MOUNTS["bus"].height,) * 2)


def test_mounts_go_with_the_eyes_and_a_car_keeps_what_it_always_had() -> None:
    assert USUAL_MOUNTS.keys() == EYE_HEIGHTS.keys()
    behind_windscreen = USUAL_MOUNTS.keys() - {"motorcycle"}
    assert all(USUAL_MOUNTS[body].height == pytest.approx(EYE_HEIGHTS[body] + 0.3) for body in behind_windscreen)
    assert build.camera_config(fogsim.load_scenario("motorway_fog_bank")).mount() == (1.38, 1.7)
