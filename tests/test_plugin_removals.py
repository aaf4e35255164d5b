"""Vehicles that the user's own loop takes away, in simulations to which FogSim is attached."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import fogsim
from fogsim.simulation.plugin import AttachedSession
from fogsim.values import Command, EgoControl, Lamp, Step
from tests.helpers.attached import libsumo_in_town
from tests.traffic.common import NET, QUIET

BLIND = ("renderer=none", "estimators=[]")
EGO = "veh3"


def until_the_ego_drives(api: Any, session: AttachedSession) -> Step:
    for _ in range(100):
        api.simulationStep()
        step = session.observe()
        if step is not None:
            session.advise(step)
            if step.time >= 2.0:
                return step
    pytest.fail("the ego never came")


@pytest.mark.parametrize("at", ["after the advice", "before the look", "before the advice"])
def test_an_ego_that_is_removed_is_none_and_the_simulation_goes_on(api: Any, at: str) -> None:
    with fogsim.attach(api, ego=EGO, visibility=120.0, settings=BLIND) as session:
        step = until_the_ego_drives(api, session)
        if at == "after the advice":
            api.vehicle.remove(EGO)
        api.simulationStep()
        if at == "before the look":
            api.vehicle.remove(EGO)
        if at == "before the advice":
            step = session.observe()
            api.vehicle.remove(EGO)
            session.advise(step)
        for _ in range(3):
            assert session.observe() is None
            api.simulationStep()
    api.simulationStep()
    assert api.vehicle.getIDCount() > 0


def test_another_vehicle_that_is_removed_is_not_seen_any_more(api: Any) -> None:
    with fogsim.attach(api, ego=EGO, visibility=30.0, settings=BLIND) as session:
        step = until_the_ego_drives(api, session)
        while len(step.traffic.ids) < 4:
            api.simulationStep()
            step = session.observe() or step
            session.advise(step)
        gone = next(v for v in step.traffic.ids if v != EGO)
        api.vehicle.remove(gone)
        for _ in range(3):
            api.simulationStep()
            step = session.observe()
            assert gone not in step.traffic.ids
            session.advise(step)


@pytest.fixture
def own(api: Any) -> Iterator[AttachedSession]:
    """Session of an ego "mine" that drives along a route of the user's."""
    api.route.add("mine", ["C0B0", "B0A0"])
    api.vehicle.add("mine", "mine")
    with fogsim.attach(api, ego="mine", visibility=120.0, settings=BLIND) as session:
        until_the_ego_drives(api, session)
        yield session


@pytest.mark.parametrize("place", [("B0A0", 20.0), ("C0B0", 90.0)])
def test_an_ego_that_is_moved_by_hand_is_where_it_was_put(
    api: Any, own: AttachedSession, place: tuple[str, float]
) -> None:
    """SUMO counts the way driven anew from where it puts a vehicle, as if its route began there."""
    api.vehicle.moveTo("mine", f"{place[0]}_0", place[1])
    api.simulationStep()
    moved = own.observe()
    before = api.simulation.getDistanceRoad("C0B0", 0.0, place[0], 0.0, isDriving=True)
    assert moved.route_position == pytest.approx(before + api.vehicle.getLanePosition("mine"), abs=0.1)


def test_a_vehicle_that_bears_the_id_of_another_has_its_own_body(api: Any, own: AttachedSession) -> None:
    api.vehicletype.copy("DEFAULT_VEHTYPE", "long")
    api.vehicletype.setLength("long", 12.0)
    lengths = []
    for _ in range(2):
        api.simulationStep()
        step = own.observe()
        lengths.append(step.traffic.length[step.ego])
        api.vehicle.remove("mine")
        api.vehicle.add("mine", "mine", typeID="long")
    assert lengths == [5.0, 12.0]


def test_an_ego_that_is_put_back_begins_its_route_anew(api: Any, own: AttachedSession) -> None:
    api.vehicle.remove("mine")
    api.vehicle.add("mine", "mine", departPos="60")
    after = None
    while after is None:
        api.simulationStep()
        after = own.observe()
    assert after.route_position == pytest.approx(60.0, abs=6.0)


def test_an_ego_that_is_put_back_is_driven_and_lit_as_before(api: Any, own: AttachedSession) -> None:
    def modes() -> tuple[int, int]:
        return api.vehicle.getSpeedMode("mine"), api.vehicle.getLaneChangeMode("mine")

    command, usual = Command(lamps=Lamp.REAR_FOG, control=EgoControl(0.0)), modes()
    for number in range(12):
        api.simulationStep()
        step = own.observe()
        if step is not None:
            own.advise(step, command)
        if number == 5:
            api.vehicle.remove("mine")
        if number == 7:
            api.vehicle.add("mine", "mine")
    assert (*modes(), api.vehicle.getParameter("mine", "fogsim-lamps")) == (0, 0, "rear_fog")
    own.close()
    assert modes() == usual


STANDS = '<stop lane="approach_0" endPos="700" duration="900"/>'
"""Before a car that sees this vehicle from 95 m, and could stop within 65 m and a second."""


def test_drivers_go_on_in_the_fog_when_the_ego_has_left(tmp_path: Path) -> None:
    vehicles = '<vType id="t" sigma="0" maxSpeed="20" lcStrategic="-1" lcSpeedGain="0"/>'
    vehicles += '<route id="way" edges="approach bank"/>'
    for name, place, stop in (("wreck", 699, STANDS), ("car", 250, "")):
        start = f'depart="0" departLane="0" departPos="{place}" departSpeed="{0 if stop else 20}"'
        vehicles += f'<vehicle id="{name}" type="t" route="way" {start}>{stop}</vehicle>'
    vehicles += '<trip id="ego" from="approach" to="approach" depart="0" departPos="850" departLane="2"/>'
    (tmp_path / "mine.rou.xml").write_text(f"<routes>{vehicles}</routes>", encoding="utf-8")
    options = ("--step-length", "0.5", "--collision.action", "warn", "--collision.mingap-factor", "0")
    hits, looks = 0, []
    with libsumo_in_town(["-n", str(NET), "-r", str(tmp_path / "mine.rou.xml"), *options, *QUIET]) as api:
        settings = (*BLIND, "drivers.speed_choice=unaffected")
        with fogsim.attach(api, ego="ego", visibility=100.0, settings=settings) as session:
            for _ in range(80):
                api.simulationStep()
                step = session.observe()
                if step is not None:
                    session.advise(step)
                looks.append(step is not None)
                hits += len(api.simulation.getCollisions())
        assert looks[0]
        assert sum(looks) < 10
        assert hits == 0
        assert (api.vehicle.getSpeed("car"), api.vehicle.getLanePosition("car")) == pytest.approx((0.0, 692.5), abs=2.0)
