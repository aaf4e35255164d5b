"""In a simulation that the user has started: over a connection, and in a loop that the user writes."""

import itertools
import math
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import traci
from early_motorway import EARLY

import fogsim
from fogsim.core.randomness import spawn_streams
from fogsim.errors import InputError, SimulationError, UnplayedWarning
from fogsim.scenario import build
from fogsim.simulation.plugin import AttachedSession
from fogsim.traffic.sumo.libsumo_link import load_libsumo
from fogsim.traffic.sumo_traffic import command_line
from fogsim.values import Command, EgoControl, Lamp, SpeedAdvice, Step
from tests.helpers.attached import ARGUMENTS, GRID, conduct, traci_in_town

SMALL = ("camera.width=96", "camera.height=72")
BLIND = ("renderer=none", "estimators=[]")
EGO = "veh18"  # departs at 36 s and drives through the whole town


@pytest.fixture
def connection(sumo_process: Callable) -> Iterator[Any]:
    with traci_in_town(sumo_process) as connection:
        yield connection


def users_loop(api: Any, steps: int) -> list[Step | None]:
    """What a user writes."""
    seen = []
    with fogsim.attach(api, ego=EGO, visibility=120.0, settings=SMALL) as session:
        for _ in range(steps):
            api.simulationStep()
            step = session.observe()
            if step is not None:
                session.advise(step)
            seen.append(step)
    return seen


def observed(api: Any, session: AttachedSession, steps: int) -> Iterator[Step]:
    """What a session sees of the ego in so many steps."""
    for _ in range(steps):
        api.simulationStep()
        if (step := session.observe()) is not None:
            yield step


def test_steps_come_while_the_ego_is_on_the_road(libsumo: Any) -> None:
    seen = users_loop(libsumo, 300)
    there = [step is not None for step in seen]
    on_the_road = [step for step in seen if step is not None]
    assert seen[:72] == [None] * 72
    assert there[72:] == sorted(there[72:], reverse=True)
    assert len(on_the_road) > 50
    assert seen[-1] is None
    assert [s.index for s in on_the_road] == list(range(len(on_the_road)))
    later = on_the_road[27]
    assert later.time == pytest.approx(0.5 * 27)
    assert later.traffic.time == pytest.approx(50.0)
    assert later.traffic.ids[later.ego] == EGO
    assert later.truth.visibility == pytest.approx(120.0)
    assert later.observation.image.shape == (72, 96, 3)
    assert libsumo.simulation.getTime() == pytest.approx(150.0)  # its owner's still


def test_traci_shows_the_same_as_libsumo(libsumo: Any, connection: Any) -> None:
    for one, other in zip(users_loop(libsumo, 90), users_loop(connection, 90), strict=True):
        assert (one is None) == (other is None)
        if one is not None and other is not None:
            assert one.traffic.ids == other.traffic.ids
            assert np.array_equal(one.traffic.position, other.traffic.position)
            assert np.array_equal(one.observation.image, other.observation.image)
            assert one.command == other.command


def test_advice_is_the_users_own_and_the_ego_is_free_afterwards(libsumo: Any) -> None:
    session = fogsim.attach(libsumo, ego=EGO, visibility=120.0, settings=BLIND, drivers=False)
    speeds = []
    for step in observed(libsumo, session, 88):
        speeds.append(float(step.traffic.speed[step.ego]))
        session.advise(step, Command(SpeedAdvice(4.0)))
    assert len(speeds) > 10
    assert speeds[-1] <= 4.0 + 1e-6
    session.close()
    session.close()
    for _ in range(10):
        libsumo.simulationStep()
    assert libsumo.vehicle.getSpeed(EGO) > 6.0
    with pytest.raises(SimulationError, match="the session is closed"):
        session.observe()


def test_a_scenario_gives_its_fog_and_its_clocks_give_way_to_the_simulations_step(libsumo: Any) -> None:
    """The motorway's five frames of 0.1 s between two decisions would be 2.5 s here."""
    scenario = fogsim.load_scenario("motorway_fog_bank", [*SMALL, "fog.visibility_m=30"])
    session = fogsim.attach(libsumo, ego=EGO, scenario=scenario, net=GRID / "grid.net.xml", drivers=False)
    limits = []
    for step in observed(libsumo, session, 76):
        limits.append(session.advise(step).advice)
    session.close()
    assert step.truth.visibility == pytest.approx(30.0)
    # Advice decides about its rise at each step, if it decides at each.
    assert len(limits) > 3
    assert all(step is not other for step, other in itertools.pairwise(limits))


def test_an_ego_driven_by_hand_is_given_back_at_the_end(libsumo: Any) -> None:
    session = fogsim.attach(libsumo, ego=EGO, visibility=math.inf, settings=BLIND)
    before = None
    for _ in range(80):
        libsumo.simulationStep()
        if EGO in libsumo.simulation.getDepartedIDList():
            before = conduct(libsumo, EGO)
        step = session.observe()
        if step is not None:
            session.advise(step, Command(control=EgoControl(0.0)))
    assert before != conduct(libsumo, EGO)
    session.close()
    assert before == conduct(libsumo, EGO)
    libsumo.simulationStep()
    assert libsumo.vehicle.getSpeedWithoutTraCI(EGO) == libsumo.vehicle.getSpeed(EGO)


def test_a_session_that_only_looks_changes_nothing(libsumo: Any) -> None:
    def positions(look: bool) -> list[Any]:
        libsumo.load(ARGUMENTS)
        session = fogsim.attach(libsumo, ego=EGO, visibility=40.0, settings=BLIND)
        found = []
        for _ in range(110):
            libsumo.simulationStep()
            if look:
                session.observe()
            found.append([libsumo.vehicle.getPosition(v) for v in libsumo.vehicle.getIDList()])
        session.close()
        return found

    assert positions(look=True) == positions(look=False)


def test_the_users_own_subscriptions_keep_their_results(connection: Any) -> None:
    speed, vehicles = traci.constants.VAR_SPEED, traci.constants.CMD_GET_VEHICLE_VARIABLE
    with fogsim.attach(connection, ego="veh3", visibility=math.inf, settings=BLIND, drivers=False) as session:
        while session.observe() is None:
            connection.simulationStep()
        connection.vehicle.subscribeContext("veh3", vehicles, 1.0, [speed])
        for _ in range(3):
            connection.simulationStep()
            assert session.observe() is not None
            results = connection.vehicle.getContextSubscriptionResults("veh3")
            assert results == {"veh3": {speed: connection.vehicle.getSpeed("veh3")}}


def test_what_attach_cannot_do_without(libsumo: Any) -> None:
    with pytest.raises(InputError, match="ego is missing"):
        fogsim.attach(libsumo, visibility=100.0)
    with pytest.raises(InputError, match="fog: this key is missing"):
        fogsim.attach(libsumo, ego=EGO)


def test_what_attach_is_given(libsumo: Any) -> None:
    with fogsim.attach(libsumo, ego=EGO, visibility=np.float64(120.0), settings=SMALL) as session:
        assert next(observed(libsumo, session, 100)).truth.visibility == pytest.approx(120.0)
    alone = ["traffic.ego=none", "traffic.keep_lane=[]", "traffic.events=[]", "fog={visibility_m: 80}"]
    alone += ["renderer=none", "estimators=[]", "fusion=grid_filter", "lighting=low_beam"]
    with pytest.raises(InputError, match=r"needs an ego vehicle in it, and traffic\.ego is none"):
        fogsim.attach(libsumo, scenario=fogsim.load_scenario("motorway_fog_bank", alone))


def test_settings_of_roads_and_vehicles_are_those_of_the_simulation_that_runs(libsumo: Any) -> None:
    road, vehicles = "road={template: motorway}", "demand={same_way_vph: 500}"
    alone: dict[str, Any] = {"ego": EGO, "visibility": 100.0}
    for given, settings, key in (
        (alone, [road], "road"),
        ({"scenario": fogsim.load_scenario("patchy_fog")}, [vehicles], "demand"),
    ):
        with pytest.raises(InputError, match=f"attach: {key}: roads and vehicles are those of the simulation"):
            fogsim.attach(libsumo, settings=settings, **given)
    fogsim.attach(libsumo, scenario=fogsim.load_scenario("patchy_fog"), ego=EGO).close()


def test_a_camera_period_other_than_the_simulations_step_is_refused(libsumo: Any) -> None:
    slower = ["clocks.camera_period_s=1", "clocks.decision_period_s=1"]
    with pytest.raises(InputError, match=r"clocks\.camera_period_s: there is a frame at each step .*, 0\.5 s"):
        fogsim.attach(libsumo, ego=EGO, visibility=100.0, settings=slower)
    fogsim.attach(libsumo, ego=EGO, visibility=100.0, settings=["clocks.decision_period_s=1"]).close()


def test_what_is_no_simulation() -> None:
    with pytest.raises(SimulationError, match=r"call libsumo\.start first"):
        fogsim.attach(load_libsumo(), ego=EGO, visibility=100.0)
    with pytest.raises(SimulationError, match="Not connected"):
        fogsim.attach(traci, ego=EGO, visibility=100.0)
    with pytest.raises(InputError, match="expected libsumo, traci or a connection of traci, got 'sumo'"):
        fogsim.attach("sumo", ego=EGO, visibility=100.0)


def test_a_simulation_that_is_lost(connection: Any) -> None:
    session = fogsim.attach(connection, ego="veh0", visibility=100.0, settings=BLIND)
    connection.simulationStep()
    assert session.observe() is not None
    connection.close()
    with pytest.raises(SimulationError, match="SUMO to which FogSim is attached is lost"):
        session.observe()
    session.close()


def test_an_interruption_in_a_message_is_what_ends_a_session(connection: Any) -> None:
    """Its answer is then taken for that to FogSim's next message."""
    session, real = fogsim.attach(connection, ego="veh0", visibility=100.0, settings=BLIND), connection._socket

    def interrupted(_: int) -> bytes:
        raise KeyboardInterrupt

    def loop() -> None:
        with session:
            connection.simulationStep()
            session.advise(session.observe())
            connection._socket = SimpleNamespace(send=real.send, recv=interrupted)
            try:
                connection.simulationStep()
            finally:
                connection._socket = real

    with pytest.raises(KeyboardInterrupt):
        loop()
    with pytest.raises(SimulationError, match="the session is closed"):
        session.observe()
    real.close()
    connection._socket = None


def test_a_run_over_a_connection_is_the_run_in_process(sumo_process: Callable) -> None:
    scenario = fogsim.load_scenario("motorway_fog_bank", [*SMALL, EARLY, "fog.visibility_m=inf", "duration_s=1"])
    here = list(fogsim.run(scenario, seed=3))
    arguments = command_line(build.traffic_setup(scenario), spawn_streams(3).traffic_seed)
    with sumo_process(arguments) as (port, _):
        there = list(fogsim.run(scenario, 3, fogsim.connect(scenario, "127.0.0.1", port)))
    assert len(there) == 11
    for one, other in zip(here, there, strict=True):
        assert np.array_equal(one.observation.image, other.observation.image)
        assert np.array_equal(one.traffic.position, other.traffic.position)


def test_a_connection_that_is_lost_on_the_way_is_one_error(sumo_process: Callable) -> None:
    scenario = fogsim.load_scenario("motorway_fog_bank", [*BLIND, EARLY, "fog.visibility_m=80"])
    arguments = command_line(build.traffic_setup(scenario), 1)
    with sumo_process(arguments) as (port, process):
        steps = fogsim.run(scenario, 3, fogsim.connect(scenario, "127.0.0.1", port))
        next(steps)
        process.kill()
        process.wait(10)
        with pytest.raises(SimulationError, match=rf"SUMO at 127\.0\.0\.1:{port} is lost"):
            next(steps)


def test_lane_changing_is_given_back_to_who_was_kept_in_lane(libsumo: Any) -> None:
    """Who comes after the ego is kept in its lane until the session ends; who was there before is left alone."""
    later, get = "veh22", libsumo.vehicle
    session = fogsim.attach(libsumo, ego=EGO, visibility=120.0, settings=(*BLIND, f"traffic.keep_lane=[veh3, {later}]"))
    while later not in get.getIDList():
        libsumo.simulationStep()
        present = get.getIDList()
        before = {v: get.getLaneChangeMode(v) for v in present}
        session.observe()
    assert EGO in present
    assert get.getLaneChangeMode(later) == 0 != before[later]
    session.close()
    assert {v: get.getLaneChangeMode(v) for v in present} == before


def test_a_session_tells_at_its_end_what_was_not_played(libsumo: Any) -> None:
    late = f"traffic.events=[{{kind: brake, vehicle: {EGO}, at_time_s: 900}}]"
    settings = (*BLIND, late, "traffic.keep_lane=[veh99]")
    libsumo.simulationStep(40.0)

    def attached(failing: bool = False) -> None:
        with fogsim.attach(libsumo, ego=EGO, visibility=120.0, settings=settings) as session:
            session.observe()
            if failing:
                raise KeyError

    with pytest.warns(UnplayedWarning, match=r"events\.0 \(brake of veh18 .*not reached; vehicle 'veh99' was never on"):
        attached()
    with pytest.raises(KeyError):
        attached(failing=True)


def test_a_timeline_is_played_in_the_users_loop_and_all_is_given_back(libsumo: Any) -> None:
    do = f"{{{EGO}: {{speed: {{to: 18 km/h, rate: 2 m/s²}}, hazard_lights: on}}, fog: {{visibility: 60 m}}}}"
    settings = (*BLIND, f"timeline=[{{name: slow, when: time >= 1 s, do: {do}}}, {{when: time > 99 s, do: {do}}}]")
    libsumo.simulationStep(40.0)
    mode = libsumo.vehicle.getSpeedMode(EGO)
    begun = []
    session = fogsim.attach(libsumo, ego=EGO, visibility=120.0, settings=settings)
    for last in observed(libsumo, session, 24):
        session.advise(last)
        session.advise(last)  # the same step begins nothing twice
        begun += [(one.name, one.time) for one in last.begun]
    assert libsumo.vehicle.getSpeedMode(EGO) != mode
    with pytest.warns(UnplayedWarning, match=r"timeline\.1 .*its condition never held"):
        session.close()
    assert begun == [("slow", 1.0)]
    assert last.traffic.speed[last.ego] == pytest.approx(5.0)
    assert last.truth.visibility == pytest.approx(60.0)
    assert last.traffic.lamps[last.ego] & (Lamp.INDICATOR_LEFT | Lamp.INDICATOR_RIGHT)
    assert libsumo.vehicle.getSpeedMode(EGO) == mode
    libsumo.simulationStep(libsumo.simulation.getTime() + 4.0)
    assert libsumo.vehicle.getSpeed(EGO) > 6.0


def test_an_ego_that_never_came_is_told_at_the_end(libsumo: Any) -> None:
    session = fogsim.attach(libsumo, ego="vehicle3", visibility=120.0)
    for _ in range(40):
        libsumo.simulationStep()
        assert session.observe() is None
    with pytest.warns(UserWarning, match=r"ego 'vehicle3' did not appear while.*those that did: veh3, .* more"):
        session.close()
    session.close()


def test_an_ego_that_is_a_person_is_told(libsumo: Any) -> None:
    libsumo.person.add("ped", "A0B0", 5.0)
    libsumo.person.appendWaitingStage("ped", 100.0)
    session = fogsim.attach(libsumo, ego="ped", visibility=120.0)
    libsumo.simulationStep()
    assert session.observe() is None
    with pytest.warns(UserWarning, match=r"ego 'ped' did not appear .*: it is a person; name a vehicle"):
        session.close()


def test_a_session_that_never_looked_says_nothing(libsumo: Any) -> None:
    fogsim.attach(libsumo, ego="vehicle3", visibility=120.0).close()
