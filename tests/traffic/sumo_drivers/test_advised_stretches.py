"""Advice to all on a stretch in SUMO: who hears it, and that it comes in time."""

import contextlib
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from fogsim.errors import InputError
from fogsim.traffic import Compliance, DriverSetup, TraciLink, Traffic, traci_traffic
from fogsim.traffic.drivers.sight import DriverSight
from fogsim.traffic.drivers.speed_choice import too_fast, unaffected
from fogsim.traffic.sumo.libsumo_link import load_libsumo
from fogsim.traffic.sumo_traffic import command_line
from fogsim.values import Command, Display, SpeedAdvice, Stretch, StretchAdvice
from tests.traffic.common import driven, even, heard, running, seen, setup_of, speeds_of

STEP, FAST, ADVISED = 0.1, 30.0, 15.0
# The approach is 900 m long, the bank 2504 m. One car drives on it, one comes onto it, one enters the network.
ROUTES = """<routes>
  <vType id="c" vClass="passenger" sigma="0" speedDev="0" maxSpeed="30"/>
  <route id="r" edges="approach bank exit"/>
  <vehicle id="ego" type="c" route="r" depart="0" departPos="850" departSpeed="30" departLane="0"/>
  <vehicle id="on" type="c" route="r" depart="0" departPos="600" departSpeed="30" departLane="1"/>
  <vehicle id="coming" type="c" route="r" depart="0" departPos="base" departSpeed="30" departLane="1"/>
  <vehicle id="late" type="c" route="r" depart="6" departPos="400" departSpeed="30" departLane="2"/>
</routes>"""
# Fast drivers who enter one after another, each as soon as SUMO finds room.
CROWD = """<routes>
  <vType id="c" vClass="passenger" sigma="0" speedDev="0" maxSpeed="40" speedFactor="1.4" length="5"/>
  <route id="r" edges="approach bank exit"/>
  <vehicle id="ego" type="c" route="r" depart="0" departPos="700" departSpeed="15" departLane="0"/>
  <flow id="f" type="c" route="r" begin="1" end="60" period="1" departPos="base" departSpeed="40" departLane="1"/>
</routes>"""
STRETCH = Stretch(300.0, 800.0)


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[..., Traffic]]:
    stack = contextlib.ExitStack()

    def start(routes: str = ROUTES, visibility: float = 60.0, **changes: Any) -> Traffic:
        setup = setup_of(tmp_path, routes, ("ego", "on", "coming", "late"))
        drivers = DriverSetup(unaffected, spread=0.0, compliance=Compliance(delay=0.0))
        return stack.enter_context(running(replace(setup, **{"drivers": drivers, **changes}), even(visibility)))

    with stack:
        yield start


def drive(traffic: Traffic, seconds: float, command: Command) -> dict[str, list[float]]:
    return speeds_of(driven(traffic, round(seconds / STEP), command))


def to_all(display: Display, stretch: Stretch = STRETCH) -> Command:
    return Command(stretches=(StretchAdvice(ADVISED, stretch, display),))


def test_drivers_hear_advice_on_the_stretch_and_drive_by_themselves_behind_it(start: Any) -> None:
    traffic = start()
    told = drive(traffic, 20.0, to_all(Display.IN_CAR))
    assert min(told["on"]) < 25.0
    assert min(told["coming"]) == pytest.approx(ADVISED, abs=0.3)
    # Who enters there has heard it before, and does not come along at 30 m/s.
    assert told["late"][1:20] == pytest.approx([ADVISED] * 19, abs=0.05)
    assert min(told["ego"]) > 29.0
    told = drive(traffic, 40.0, to_all(Display.IN_CAR))
    assert [told[v][-1] for v in ("on", "coming", "late")] == pytest.approx([FAST] * 3, abs=0.5)


@pytest.mark.parametrize(
    ("compliance", "others"), [({"rate": 0.0}, {"on": ADVISED, "coming": ADVISED}), ({"reached_share": 0.0}, {})]
)
def test_who_has_heard_advice_is_told_whether_they_follow_it(start: Any, compliance: Any, others: Any) -> None:
    traffic = start(drivers=DriverSetup(unaffected, spread=0.0, compliance=Compliance(**compliance)))
    assert heard(seen(traffic).state) == {}
    advice = StretchAdvice(ADVISED, Stretch(), Display.LAW), StretchAdvice(20.0, Stretch(), Display.IN_CAR)
    drive(traffic, 2.0, Command(SpeedAdvice(25.0), stretches=advice))
    assert heard(seen(traffic).state) == {**others, "ego": 25.0}
    drive(traffic, 2.0, Command())
    assert heard(seen(traffic).state) == {}


def test_a_sign_tells_those_who_pass_it(start: Any) -> None:
    traffic = start()
    drive(traffic, 1.0, Command())
    told = drive(traffic, 12.0, to_all(Display.MESSAGE_SIGN))
    assert min(told["on"]) > 29.0
    assert heard(seen(traffic).state) == {"coming": ADVISED, "late": ADVISED}
    # It comes to the sign 10 s after it has entered, and brakes within a second.
    assert told["coming"][85] > 29.0
    assert told["coming"][-1] < 27.0
    # What was read is kept when the sign goes dark, to the end of the stretch.
    assert drive(traffic, 12.0, Command())["coming"][-1] == pytest.approx(ADVISED, abs=0.3)
    assert drive(traffic, 30.0, Command())["coming"][-1] == pytest.approx(FAST, abs=0.5)
    assert heard(seen(traffic).state) == {}


def test_a_stretch_goes_on_across_junctions(start: Any) -> None:
    traffic = start()
    told = drive(traffic, 30.0, to_all(Display.IN_CAR, Stretch(100.0, 3000.0, ("approach", "bank"))))
    assert told["on"][-1] == pytest.approx(ADVISED, abs=0.3)
    snapshot = seen(traffic)
    assert snapshot.state.lane[snapshot.state.ids.index("on")].startswith("bank")
    # Nobody sped up in between.
    assert max(told["on"][120:]) <= ADVISED + 0.3


@pytest.mark.parametrize(
    ("stretch", "message"),
    [
        (Stretch(edges=("aproach",)), "no edge 'aproach'; .*approach"),
        (Stretch(edges=("approach", "exit")), "no lane leads from edge 'approach' to edge 'exit'"),
        (Stretch(900.0, edges=("approach",)), "begins at 900 m, but the edges, approach, are 900 m long"),
        (Stretch(6000.0), r"begins at 6000 m, but the ego's route is 5501 m long"),
    ],
)
def test_a_stretch_that_the_network_does_not_have_is_refused(start: Any, stretch: Stretch, message: str) -> None:
    traffic = start()
    with pytest.raises(InputError, match=message):
        drive(traffic, 2.0, to_all(Display.IN_CAR, stretch))


def test_over_a_connection_they_hear_see_follow_and_drive_the_same(sumo_process: Callable, tmp_path: Path) -> None:
    compliance, kinds = Compliance(delay=0.0), {"in_sight": 0.5, "careful": 0.5}
    drivers = DriverSetup(too_fast, spread=0.1, compliance=compliance, following=kinds, misjudgement=0.5)
    setup = replace(setup_of(tmp_path, ROUTES, ("ego", "on", "coming", "late")), drivers=drivers)
    setup = replace(setup, sight=DriverSight(0.1))
    command = replace(to_all(Display.MESSAGE_SIGN), advice=SpeedAdvice(25.0), advice_reach=1500.0)
    with running(setup, even(30.0)) as traffic:
        here = driven(traffic, 140, command)
        headways = [load_libsumo().vehicle.getTau(v) for v in here[-1].state.ids]
    with sumo_process(command_line(setup, 1)) as (port, _):
        link = TraciLink("127.0.0.1", port)
        traffic = traci_traffic(setup, link)
        traffic.enter_fog(even(30.0))
        traffic.start(1)
        there = driven(traffic, 140, command)
        assert [link._connection.vehicle.getTau(v) for v in there[-1].state.ids] == headways
        link.end()
    assert speeds_of(here) == speeds_of(there)
    assert [heard(one.state) for one in here] == [heard(one.state) for one in there]
    assert heard(here[-1].state) == {"ego": 25.0, "coming": 25.0, "on": ADVISED, "late": ADVISED}
    assert len({1.0, *headways}) > 2


def crashes(traffic: Traffic, seconds: float, command: Callable[[tuple[str, ...]], Command]) -> int:
    """Collisions, with a command from the ids on the road that holds for half a second, as the loop's does."""
    count, decided = 0, Command()
    for step in range(round(seconds / STEP)):
        snapshot = seen(traffic)
        count += len(snapshot.collisions)
        decided = decided if step % 5 else command(snapshot.state.ids)
        traffic.advance(decided)
    return count


def test_nobody_runs_into_advised_traffic_at_the_entrance(start: Any) -> None:
    """Drivers who enter at 40 m/s and see 15 m: told by name with the next decision, they come too fast."""
    sight = DriverSight(10_000.0, 55.0, 1.0)
    traffic = start(CROWD, visibility=15.0, sight=sight, keep_lane=("ego",))
    by_name = crashes(traffic, 50.0, lambda ids: Command(SpeedAdvice(8.0), advised_speeds=dict.fromkeys(ids, 8.0)))
    traffic.start(1)
    in_time = crashes(traffic, 50.0, lambda _: Command(SpeedAdvice(8.0), advice_reach=math.inf))
    assert (by_name > 0, in_time) == (True, 0)
