"""SUMO in another process: the same traffic as in process, several clients, beginning anew."""

import contextlib
import dataclasses
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import traci

from fogsim.atmosphere import FieldAccess
from fogsim.errors import SimulationError
from fogsim.scenario import build, scenario_from_config
from fogsim.traffic import DriverSetup, DriverSight, TraciLink, Traffic, libsumo_traffic, traci_traffic
from fogsim.traffic.drivers.speed_choice import too_fast
from fogsim.traffic.sumo.link import Api
from fogsim.traffic.sumo_traffic import command_line
from fogsim.values import Command, FogField, Lamp, SpeedAdvice, TrafficSnapshot, TrafficState
from tests.traffic.common import DATA, SETUP, driven

GRID = DATA / "grid" / "grid.sumocfg"
HOST = "127.0.0.1"
FOG = FieldAccess(FogField(0.04, (3000.0, 3000.0, 3000.0)))


def equal(one: TrafficState, other: TrafficState) -> bool:
    """True if every field is the same to the last bit."""
    fields = [f.name for f in dataclasses.fields(TrafficState)]
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in fields)


def drive(traffic: Traffic, seed: int) -> list[TrafficSnapshot]:
    traffic.start(seed)
    return [one for v in (25.0, 18.0) for one in driven(traffic, 12, Command(SpeedAdvice(v), Lamp.REAR_FOG))]


@pytest.fixture(scope="module")
def in_process() -> list[TrafficSnapshot]:
    with contextlib.closing(libsumo_traffic(SETUP)) as traffic:
        return drive(traffic, 1)


@pytest.fixture
def link(sumo_process: Callable) -> Iterator[TraciLink]:
    with sumo_process(command_line(SETUP, 1)) as (port, _):
        link = TraciLink(HOST, port)
        yield link
        link.end()


def test_drivers_in_fog_see_the_same_as_in_process_by_few_messages(
    link: TraciLink, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What drivers see comes with the steps: far less than a message a vehicle and step."""
    setup = replace(SETUP, sight=DriverSight(10_000.0), drivers=DriverSetup(too_fast))

    def in_fog(traffic: Traffic) -> list[TrafficSnapshot]:
        traffic.enter_fog(FOG)
        return drive(traffic, 1)

    with contextlib.closing(libsumo_traffic(setup)) as here:
        expected = in_fog(here)
    messages = 0
    send = traci.connection.Connection._sendExact

    def counted(connection: traci.connection.Connection) -> object:
        nonlocal messages
        messages += 1
        return send(connection)

    monkeypatch.setattr(traci.connection.Connection, "_sendExact", counted)
    seen = in_fog(traci_traffic(setup, link))
    for one, other in zip(expected, seen, strict=True):
        assert equal(one.state, other.state)
        assert (one.leader, one.route_position, one.speed_limit) == (
            other.leader,
            other.route_position,
            other.speed_limit,
        )
    assert len(seen[-1].state.ids) > 10
    steps = round(seen[-1].state.time / SETUP.step_length)
    assert messages < 25 * steps


def test_beginning_anew_loads_the_scenario_with_the_seed_and_nothing_is_printed(
    link: TraciLink, in_process: list[TrafficSnapshot], capfd: pytest.CaptureFixture[str]
) -> None:
    traffic = traci_traffic(SETUP, link)
    traffic.start(1)
    other = drive(traffic, 2)
    again = drive(traffic, 1)
    assert not equal(other[-1].state, in_process[-1].state)
    assert equal(again[-1].state, in_process[-1].state)
    assert capfd.readouterr() == ("", "")


@contextlib.contextmanager
def stepping(traffic: Traffic, port: int, order: int, each: Callable[[Api], None]) -> Iterator[None]:
    """Another client that only steps, and does something before each step; closes the traffic at the end."""
    other, done = TraciLink(HOST, port, order=order), threading.Event()

    def keep_stepping() -> None:
        api = other.begin(())
        # The last step may wait for a client that has left.
        with contextlib.suppress(SimulationError), other.translated_errors():
            while not done.is_set():
                each(api)
                other.step()
        other.end()

    thread = threading.Thread(target=keep_stepping, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        traffic.close()
        thread.join(10)
    assert not thread.is_alive()


def test_one_of_two_clients_in_their_order(sumo_process: Callable, in_process: list[TrafficSnapshot]) -> None:
    """The other client only steps; each step waits for both."""
    with sumo_process(command_line(SETUP, 1), clients=2) as (port, _):
        traffic = traci_traffic(SETUP, TraciLink(HOST, port, order=1))
        with stepping(traffic, port, 2, lambda _: None):
            seen = drive(traffic, 1)
            with pytest.raises(SimulationError, match=r"has 2 clients.*start SUMO again"):
                traffic.start(2)
    for here, there in zip(in_process, seen, strict=True):
        assert equal(here.state, there.state)


def test_who_goes_on_finds_every_vehicle_as_it_was(sumo_process: Callable) -> None:
    """FogSim has left the simulation to another client."""
    setup = replace(SETUP, sight=DriverSight(10_000.0), drivers=DriverSetup(too_fast))
    left, looked = threading.Event(), threading.Event()
    during: set[str] = set()
    after: set[str] = set()

    def look(api: Api) -> None:
        found = {
            key
            for key in ("ignored", "maxSpeed", "laneChangeMode", "lcSpeedGain")
            for vehicle in api.vehicle.getIDList()
            if api.vehicle.getParameter(vehicle, f"fogsim.{key}")
        }
        if left.is_set():
            after.update(found)
            looked.set()
        else:
            during.update(found)

    with sumo_process(command_line(SETUP, 1), clients=2) as (port, _):
        traffic = traci_traffic(setup, TraciLink(HOST, port, order=1))
        with stepping(traffic, port, 2, look):
            traffic.enter_fog(FOG)
            drive(traffic, 1)
            traffic.close()
            left.set()
            assert looked.wait(60)
    assert during == {"ignored", "maxSpeed", "laneChangeMode", "lcSpeedGain"}
    assert not after


def test_a_message_that_was_broken_off_ends_the_connection(link: TraciLink, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its answer would be taken for that to the next one, and SUMO would make the step of both."""
    traffic = traci_traffic(SETUP, link)
    traffic.start(1)

    def interrupted(*_: object) -> bytes:
        raise KeyboardInterrupt

    limited = link._connection._socket
    real = limited._socket
    with monkeypatch.context() as patch:
        patch.setattr(limited, "_socket", SimpleNamespace(sendall=real.sendall, recv=interrupted))
        with pytest.raises(KeyboardInterrupt):
            traffic.advance(Command())
    with pytest.raises(SimulationError, match="was broken off before its answer: connect again"):
        traffic.advance(Command())
    traffic.close()


@pytest.mark.parametrize("order", [1, 2])
def test_another_client_may_take_the_ego_away(sumo_process: Callable, order: int) -> None:
    """Before or after FogSim's own messages of the same step."""

    def take_away(api: Api) -> None:
        if "veh0" in api.vehicle.getIDList() and api.vehicle.getDistance("veh0") > 40.0:
            api.vehicle.remove("veh0")

    town, seen = build.traffic_setup(scenario_from_config(GRID, "veh0", ["fog.visibility_m=75"])), []
    with sumo_process(["-c", str(GRID), "--step-length", "0.1", "--no-step-log"], clients=2) as (port, _):
        traffic = traci_traffic(town, TraciLink(HOST, port, order=order))
        with stepping(traffic, port, 3 - order, take_away):
            traffic.enter_fog(FOG)
            traffic.start(1)
            while traffic.observe() is not None:
                seen.append(traffic.observe())
                traffic.advance(Command(SpeedAdvice(18.0)))
            for _ in range(3):
                traffic.advance(Command(SpeedAdvice(18.0)))
                assert traffic.observe() is None
    assert 5 < len(seen) < 100


def test_no_sumo_at_all_is_told_with_what_to_do(free_port: Callable[[], int]) -> None:
    port = free_port()
    with pytest.raises(
        SimulationError,
        match=rf"no SUMO answers at {HOST}:{port}, asked 2 times within 0\.[2-9] s: start it with --remote-port {port}",
    ):
        traci_traffic(SETUP, TraciLink(HOST, port, retries=1)).start(1)


def test_another_step_length_is_told(link: TraciLink) -> None:
    with pytest.raises(SimulationError, match=r"steps of 0\.1 s, but clocks\.traffic_step_s is 0\.5"):
        traci_traffic(replace(SETUP, step_length=0.5), link).start(1)
