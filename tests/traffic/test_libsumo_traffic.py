"""SUMO in process: reading, obeying, scripting, refusing."""

import contextlib
import math
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from fogsim.errors import SimulationError, SimulationRunningError
from fogsim.traffic import BrakeEvent, LampFailureEvent, LaneChangeEvent, Traffic, Trigger, libsumo_traffic
from fogsim.traffic.sumo import libsumo_link
from fogsim.values import Command, Lamp, SpeedAdvice
from tests.traffic.common import SETUP, driven, running, seen


@pytest.fixture
def traffic() -> Iterator[Traffic]:
    with running(SETUP) as simulation:
        yield simulation


def test_state_in_metres_and_radians_with_the_egos_leader_and_lamps(traffic: Traffic) -> None:
    before = seen(traffic)
    after = driven(traffic, 10)[-1]
    state, ego = after.state, after.ego
    moved = state.position[ego] - before.state.position[before.ego]
    assert state.ids[ego] == "ego"
    assert np.linalg.norm(moved) == pytest.approx(after.route_position - before.route_position, rel=0.01)
    assert math.atan2(moved[1], moved[0]) == pytest.approx(state.heading[ego], abs=0.01)
    assert state.speed[ego] == pytest.approx(np.linalg.norm(moved), rel=0.1)
    assert after.speed_limit == pytest.approx(130 / 3.6, abs=0.1)
    assert (state.length[ego], state.width[ego], state.height[ego]) == (4.7, 1.85, 1.48)
    assert 5400 < after.route_length < 5600
    leader = after.leader
    assert leader is not None
    row = state.ids.index(leader.vehicle_id)
    bumpers = np.linalg.norm(state.position[row] - state.position[ego]) - state.length[row]
    assert leader.gap == pytest.approx(bumpers, abs=0.05)
    lit = driven(traffic, 1, Command(lamps=Lamp.LOW_BEAM | Lamp.REAR_FOG))[-1]
    assert Lamp(int(lit.state.lamps[lit.ego])) & ~Lamp.STOP == Lamp.LOW_BEAM | Lamp.REAR_FOG


def test_the_ego_comes_down_to_an_advised_speed_and_is_freed_again(traffic: Traffic) -> None:
    start = seen(traffic).state
    target = 12.0
    advised = Command(SpeedAdvice(target))
    after_two_seconds = driven(traffic, 20, advised)[-1]
    speed = after_two_seconds.state.speed[after_two_seconds.ego]
    assert speed == pytest.approx(start.speed[start.row("ego")] - 2.0 * SETUP.advice_deceleration, abs=0.3)
    settled = driven(traffic, 100, advised)[-1]
    assert settled.state.speed[settled.ego] == pytest.approx(target, abs=0.05)
    freed = driven(traffic, 100)[-1]
    assert freed.state.speed[freed.ego] > target + 5


def test_a_scripted_vehicle_brakes_holds_and_drives_on() -> None:
    event = BrakeEvent("lead", Trigger(at_position=300.0), to_speed=0.0, deceleration=5.0, hold=15.0)
    with running(replace(SETUP, events=(event,))) as traffic:
        states = [one.state for one in driven(traffic, 350, Command(SpeedAdvice(20.0)))]
    speeds = [math.nan if (row := state.row("lead")) is None else float(state.speed[row]) for state in states]
    assert min(speeds) == pytest.approx(0.0, abs=0.01)
    assert speeds[-1] > 5.0
    assert np.nanmin(np.diff(speeds)) >= -0.5 - 0.01


def test_a_scripted_vehicle_cuts_in_and_its_lamps_fail_when_they_are_told_to() -> None:
    events = (
        LaneChangeEvent("lead", Trigger(at_time=1.0), lanes=1, stay=20.0),
        LampFailureEvent("lead", Trigger(at_gap_to_ego=1000.0)),
    )
    with running(replace(SETUP, events=events, keep_lane=("ego",))) as traffic:
        before = driven(traffic, 5)[-1].state
        after = driven(traffic, 60)[-1].state
        assert not traffic.unplayed()
    one, other = before.row("lead"), after.row("lead")
    assert one is not None
    assert other is not None
    assert (before.lane[one], after.lane[other]) == ("approach_1", "approach_2")
    assert after.lamps[other] == 0
    assert np.count_nonzero(after.lamps) >= len(after.ids) - 2  # all others but the ego, whose lamps the command sets


def test_a_process_has_one_simulation_until_it_is_closed(traffic: Traffic) -> None:
    with pytest.raises(SimulationRunningError, match="run this one in its own process"):
        libsumo_traffic(SETUP).start(1)
    assert seen(traffic)  # the first goes on
    traffic.close()
    traffic.close()
    with pytest.raises(SimulationError, match="not been started, or is closed"):
        traffic.observe()


def test_a_simulation_that_was_dropped_without_closing_makes_room_for_another() -> None:
    traffic = libsumo_traffic(SETUP)
    traffic.start(1)
    del traffic
    other = libsumo_traffic(SETUP)
    other.start(1)
    del other
    # One that the user has started since is not closed.
    sumo = libsumo_link.load_libsumo()
    sumo.start(["sumo", "-n", str(SETUP.net)])
    with contextlib.closing(sumo), pytest.raises(SimulationRunningError):
        libsumo_traffic(SETUP).start(1)


def test_of_threads_that_begin_together_one_has_the_simulation(monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[object] = []

    def start(arguments: object) -> None:
        time.sleep(0.05)
        begun.append(arguments)

    marks = SimpleNamespace(getParameter=lambda *_: "", setParameter=lambda *_: None)
    sumo = SimpleNamespace(isLoaded=lambda: bool(begun), start=start, simulation=marks, TraCIException=RuntimeError)
    monkeypatch.setattr(libsumo_link, "load_libsumo", lambda: sumo)
    with ThreadPoolExecutor(3) as threads:
        links = [libsumo_link.LibsumoLink() for _ in range(3)]
        asked = [threads.submit(link.begin, ()) for link in links]
    assert [type(one.exception()) for one in asked].count(SimulationRunningError) == 2
    assert len(begun) == 1


def test_what_cannot_be_begun_is_told_and_leaves_nothing_running(tmp_path: Path) -> None:
    routes = tmp_path / "broken.rou.xml"
    routes.write_text('<routes><vehicle id="ego" depart="0" route="nowhere"/></routes>', encoding="utf-8")
    with pytest.raises(SimulationError, match="nowhere"):  # in SUMO's own words
        libsumo_traffic(replace(SETUP, routes=(routes,))).start(1)
    traffic = libsumo_traffic(replace(SETUP, ego="nobody", warm_up_limit=5.0))
    with pytest.raises(SimulationError, match=r"the ego 'nobody' did not appear within 5"):
        traffic.start(1)
    other = libsumo_traffic(SETUP)
    other.start(1)  # nothing is left running
    other.close()


def test_a_locale_in_which_sumo_reads_no_numbers_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("locale.localeconv", lambda: {"decimal_point": ","})
    with pytest.raises(SimulationError, match=r"writes 0,5, .* locale\.setlocale\(locale\.LC_NUMERIC, 'C'\)"):
        libsumo_traffic(SETUP).start(1)
