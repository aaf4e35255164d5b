"""Several sessions of FogSim in one simulation, and settings of the user's own beside them."""

from typing import Any

import pytest

import fogsim
from fogsim.errors import SimulationError
from fogsim.simulation.plugin import AttachedSession
from fogsim.values import Command, Stretch, StretchAdvice
from tests.helpers.attached import ARGUMENTS, conduct, libsumo_in_town

BLIND = ("renderer=none", "estimators=[]")
ADVISED = ("drivers.compliance.reached_share=1", "drivers.compliance.rate=1", "drivers.compliance.delay_s=0")
# Speeds, shares of the own speed and headways change.
CHANGING = ("drivers.speed_choice=observed", "drivers.following=careful")
EGO, OTHER_EGO = "veh0", "veh1"


def session(api: Any, ego: str, *settings: str, visibility: float = 120.0) -> AttachedSession:
    return fogsim.attach(api, ego=ego, visibility=visibility, settings=(*BLIND, *settings))


def advise(one: AttachedSession, speed: float | None) -> None:
    """What a user does after a step, with advice for everybody if there is any."""
    step = one.observe()
    if step is not None:
        one.advise(step, Command(advised_speeds={} if speed is None else dict.fromkeys(step.traffic.ids, speed)))


def drive(api: Any, steps: int, *told: tuple[AttachedSession, float | None]) -> None:
    for _ in range(steps):
        api.simulationStep()
        for one, speed in told:
            advise(one, speed)


def top_speeds(api: Any) -> dict[str, float]:
    return {v: api.vehicle.getMaxSpeed(v) for v in api.vehicle.getIDList() if v not in (EGO, OTHER_EGO)}


@pytest.mark.parametrize("first", [0, 1])
def test_the_lower_advice_holds_until_its_session_is_closed(libsumo: Any, first: int) -> None:
    """And whoever is closed first, everybody has the own top speed at the end."""
    drive(libsumo, 10)
    sessions = [session(libsumo, EGO, *ADVISED), session(libsumo, OTHER_EGO, *ADVISED)]
    speeds = [4.0, 8.0]
    drive(libsumo, 30, *zip(sessions, speeds, strict=True))
    assert set(top_speeds(libsumo).values()) == {4.0}
    sessions[first].close()
    assert set(top_speeds(libsumo).values()) == {speeds[1 - first]}
    drive(libsumo, 4, (sessions[1 - first], speeds[1 - first]))
    assert set(top_speeds(libsumo).values()) == {speeds[1 - first]}
    sessions[1 - first].close()
    assert min(top_speeds(libsumo).values()) > 50.0


def test_all_on_a_stretch_are_advised_as_long_as_they_are_there(api: Any) -> None:
    drive(api, 20)
    one = session(api, EGO, *ADVISED)
    here = StretchAdvice(4.0, Stretch(edges=("bottom2C0", "C0C1")))
    advised, crossed = set(), set()
    for _ in range(60):
        api.simulationStep()
        step = one.observe()
        if step is not None:
            one.advise(step, Command(stretches=(here,)))
            slow = {v for v, speed in top_speeds(api).items() if speed == 4.0}
            advised |= slow
            crossed |= {v for v in slow if api.vehicle.getRoadID(v).startswith(":C0")}
            # Those who have just left it, too.
            assert len(slow) <= 6
    assert advised
    assert crossed
    one.close()
    assert min(top_speeds(api).values()) > 50.0


def test_all_that_two_sessions_change_is_given_back(api: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    # SUMO does not tell whom a driver ignores; so what it was given last counts.
    ignored: dict[str, str] = {}
    give = api.vehicle.setParameter

    def given(vehicle: str, key: str, value: str) -> None:
        if key == "carFollowModel.ignoreIDs":
            ignored[vehicle] = value
        give(vehicle, key, value)

    monkeypatch.setattr(api.vehicle, "setParameter", given)
    before: dict[str, tuple[float, ...]] = {}
    one, other = (session(api, ego, *CHANGING, visibility=20.0) for ego in (EGO, OTHER_EGO))
    changed: set[int] = set()
    for number in range(70):
        api.simulationStep()
        for vehicle in api.simulation.getDepartedIDList():
            before[vehicle] = conduct(api, vehicle)
        if number < 50:
            advise(one, None)
        if number == 50:
            one.close()
        advise(other, None)
        if number % 10 == 9:
            now = {v: conduct(api, v) for v in api.vehicle.getIDList()}
            changed.update(part for v in now for part in range(6) if now[v][part] != before[v][part])
    present = api.vehicle.getIDList()
    assert sum(bool(ignored.get(v)) for v in present) > 3
    other.close()
    assert not any(ignored.get(v) for v in present)
    assert changed >= {0, 1, 2, 5}  # top speeds and shares of them, headways, and wishes to change lanes
    assert {v: conduct(api, v) for v in present} == {v: before[v] for v in present}


def test_what_the_user_sets_meanwhile_stays(libsumo: Any) -> None:
    drive(libsumo, 10)
    one = session(libsumo, EGO, *ADVISED)
    drive(libsumo, 20, (one, 4.0))
    vehicle, another = sorted(top_speeds(libsumo))[:2]
    libsumo.vehicle.setMaxSpeed(vehicle, 20.0)
    drive(libsumo, 2, (one, 5.0))
    assert libsumo.vehicle.getMaxSpeed(vehicle) == 5.0
    libsumo.vehicle.setMaxSpeed(another, 12.0)
    one.close()
    assert (libsumo.vehicle.getMaxSpeed(vehicle), libsumo.vehicle.getMaxSpeed(another)) == (20.0, 12.0)


def test_a_closed_session_advises_nobody(libsumo: Any) -> None:
    drive(libsumo, 20)
    one = session(libsumo, EGO, *ADVISED)
    step = one.observe()
    assert step is not None
    one.close()
    with pytest.raises(SimulationError, match="the session is closed"):
        one.advise(step, Command(advised_speeds=dict.fromkeys(step.traffic.ids, 4.0)))
    drive(libsumo, 2)
    assert min(top_speeds(libsumo).values()) > 50.0


def test_a_session_of_another_simulation_gives_nothing_back_here(libsumo: Any) -> None:
    one = session(libsumo, EGO, *ADVISED)
    drive(libsumo, 20, (one, 4.0))
    libsumo.load(ARGUMENTS)
    drive(libsumo, 8)
    other = session(libsumo, OTHER_EGO, *ADVISED)
    drive(libsumo, 6, (other, 4.0))
    assert set(top_speeds(libsumo).values()) == {4.0}
    one.close()
    assert set(top_speeds(libsumo).values()) == {4.0}
    other.close()


def test_a_session_may_outlive_its_simulation() -> None:
    with libsumo_in_town() as libsumo:
        one = session(libsumo, EGO, *ADVISED)
        drive(libsumo, 5, (one, 4.0))
    one.close()


def test_a_vehicle_that_bears_the_id_of_another_is_met_anew(libsumo: Any) -> None:
    libsumo.route.add("mine", ["C0B0", "B0A0"])
    libsumo.vehicle.add("mine", "mine")
    one = session(libsumo, EGO, *ADVISED)
    drive(libsumo, 10, (one, 4.0))
    assert libsumo.vehicle.getMaxSpeed("mine") == 4.0
    libsumo.vehicle.remove("mine")
    libsumo.vehicle.add("mine", "mine")
    libsumo.vehicle.setMaxSpeed("mine", 21.0)
    drive(libsumo, 10, (one, 4.0))
    assert libsumo.vehicle.getMaxSpeed("mine") == 4.0
    one.close()
    assert libsumo.vehicle.getMaxSpeed("mine") == 21.0
