"""Vehicles that the user's own loop takes away, in simulations to which FogSim is attached."""

from collections.abc import Iterator
from typing import Any

import pytest

import fogsim
from fogsim.simulation.plugin import AttachedSession
from fogsim.values import Step

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
