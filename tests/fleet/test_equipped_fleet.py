"""Other vehicles with cameras: in which process they are drawn changes nothing, and what they believe has effects."""

import dataclasses
import math
import os
import signal

import numpy as np
import pytest
from early_motorway import EARLY

import fogsim
from fogsim.errors import InputError, SimulationError
from fogsim.scenario import Scenario
from fogsim.simulation.ego.route_places import RoutePlaces
from fogsim.simulation.fleet import EquippedFleet, camera_messages
from fogsim.simulation.fleet.equipped_fleet import _leader
from fogsim.simulation.loop import ClosedLoop
from fogsim.values import Command, Estimate, Lamp, Step

SMALL = ("camera.width=160", "camera.height=120", "duration_s=2", "clocks.camera_period_s=0.5")
BLIND = (EARLY, "renderer=none", "estimators=[]")


def small(*overrides: str) -> Scenario:
    return fogsim.load_scenario("motorway_fog_bank", [*SMALL, *overrides])


def seen_and_believed(steps: list[Step]) -> list[object]:
    """What all see and believe in each step, bit for bit."""
    return [
        (
            step.traffic.speed.tobytes(),
            step.observation.reports,
            step.belief.probability.tobytes(),
            [
                (
                    one.vehicle_id,
                    one.place,
                    one.belief.probability.tobytes(),
                    one.advice,
                    one.lamps,
                    repr(one.estimates),
                )
                for one in step.equipped
            ],
        )
        for step in steps
    ]


def equipped(seconds: float, processes: int) -> list[Step]:
    """A run in dense fog in which cameras of others and of the roadside report what they see."""
    others = "sensors.reports.cameras={range_m: 1000}", "sensors.reports.roadside={camera: {}, period_s: 1, delay_s: 0}"
    settings = "fog.visibility_m=60", "traffic.equipped=20 %", "fusion=field_filter", "lighting=legal"
    return list(fogsim.run(small(*settings, *others, f"duration_s={seconds}"), 1, camera_processes=processes))


@pytest.fixture(scope="module")
def steps() -> list[Step]:
    return equipped(3.0, 0)


def test_the_number_of_processes_changes_nothing(steps: list[Step]):
    assert max(len(step.equipped) for step in steps) >= 3
    elsewhere = equipped(1.0, 2)
    assert seen_and_believed(elsewhere) == seen_and_believed(steps[: len(elsewhere)])
    heard = {one.source for step in steps for one in step.observation.reports}
    roadside = {one for one in heard if one.startswith("sensor ")}
    assert heard - roadside <= {f"camera of {one.vehicle_id}" for step in steps for one in step.equipped}
    assert heard - roadside
    assert len(roadside) >= 4


def test_each_sees_by_its_own_camera_and_is_advised_and_lit_by_its_own_belief(steps: list[Step]):
    last = steps[-1]
    assert len({one.belief.visibility_quantile(0.5) for one in last.equipped}) == len(last.equipped)
    for one in last.equipped:
        assert one.belief.visibility_quantile(0.5) == pytest.approx(60.0, rel=0.3)
        assert one.extinction == pytest.approx(math.log(20.0) / 60.0, rel=1e-3)
        assert one.advice.speed < 20.0
        row = last.traffic.ids.index(one.vehicle_id)
        assert Lamp.FRONT_FOG in one.lamps
        assert Lamp.FRONT_FOG in Lamp(int(last.traffic.lamps[row]))
        assert last.traffic.advised_speed[row] <= 20.0
    # What the ego was asked to do is its own.
    assert not last.command.is_for_others


@pytest.fixture(scope="module")
def first_step() -> Step:
    return next(fogsim.run(small(*BLIND), 1))


def test_nobody_is_equipped_unless_asked_and_named_ones_are(first_step: Step):
    assert not first_step.equipped
    same_way = [one for one in first_step.traffic.ids if one.startswith("east")][:2]
    named = next(fogsim.run(small(*BLIND, f"traffic.ego=[ego,{','.join(same_way)}]"), 1))
    assert {one.vehicle_id for one in named.equipped} <= {*same_way}
    assert named.equipped


def test_the_leader_of_an_equipped_vehicle_is_the_one_that_sumo_has():
    compared = 0
    with ClosedLoop(small(*BLIND[1:], "duration_s=6")) as loop:
        step = loop.start(3)
        places = RoutePlaces(step.truth.route)
        while step.ending is None:
            found = _leader(step.ego, places.of(step.traffic), step.traffic)
            if step.leader is not None and step.leader.gap < 150.0:
                assert found is not None
                assert found.vehicle_id == step.leader.vehicle_id
                assert found.gap == pytest.approx(step.leader.gap, abs=1.0)
                compared += 1
            step = loop.advance(Command())
    assert compared > 5


def test_what_a_script_asks_of_fog_holds_for_those_who_come_later():
    script = "timeline=[{when: time >= 1 s, do: {fog: {visibility: 100 m}}}]"
    settings = "fog.visibility_m=300", "traffic.equipped=20 %", script, "duration_s=1.5"
    steps = list(fogsim.run(small(*BLIND[1:], *settings), 1))
    before, after = steps[1].equipped[0], steps[-1].equipped[0]
    assert after.extinction == pytest.approx(3.0 * before.extinction, rel=0.05)


def test_an_error_in_another_process_and_its_death_are_told(monkeypatch):
    scenario = small(*BLIND, "traffic.equipped=20 %")
    with ClosedLoop(scenario, camera_processes=1) as loop:
        loop.start(1)
        process = loop._fleet._pools[0]._process
        for signum in (signal.SIGINT, signal.SIGHUP):
            os.kill(process.pid, signum)
        loop.advance(Command())
        process.kill()
        process.join()
        with pytest.raises(SimulationError, match="has died"):
            loop.advance(Command())
    with pytest.raises(SimulationError, match="not been started"):
        EquippedFleet(scenario.run_config(), 1)._pools[0].answer()


def test_cameras_tell_what_one_picture_shows_and_not_what_is_believed(first_step: Step):
    estimates = (
        Estimate("a", 0.03, 0.003, reach=100.0),
        Estimate("b", 0.04, 0.001, reach=80.0),
        Estimate.invalid("c", "no"),
    )
    ((vehicle, report),) = camera_messages(dataclasses.replace(first_step, estimates=estimates))
    assert vehicle == "ego"
    assert (report.extinction, report.relative_deviation) == (0.04, pytest.approx(0.025))
    # Of the visibility of 75 m, not of what lies beyond.
    assert report.place == pytest.approx(first_step.route_position + 37.4, abs=0.1)
    assert camera_messages(dataclasses.replace(first_step, estimates=(Estimate("a", 0.03, 0.02),))) == ()


def test_who_cannot_be_equipped_is_told():
    for written, told in [
        ("traffic.equipped_vehicles=[nobody]", "nobody"),
        ("traffic.ego=[ego, ego]", "named twice"),
        ("traffic.equipped=1.5", "equipped"),
        ("traffic.ego=[]", "empty list"),
    ]:
        with pytest.raises(InputError, match=told):
            small(written)


def test_places_along_a_route_with_a_bend(first_step: Step):
    route = np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [100.0, 100.0, 0.0]])
    some = {
        "ids": ("a", "b", "c", "d"),
        "position": np.array([[50.0, 2.0, 0.0], [98.0, 40.0, 0.0], [50.0, 3.0, 0.0], [50.0, 40.0, 0.0]]),
        "heading": np.array([0.0, 0.5 * np.pi, np.pi, 0.0]),
    }
    at = RoutePlaces(route).of(dataclasses.replace(first_step.traffic, **some))
    assert at.along[:2] == pytest.approx([50.0, 140.0])
    assert at.aside[:2] == pytest.approx([2.0, 2.0])
    assert at.on_way.tolist() == [True, True, False, False]
