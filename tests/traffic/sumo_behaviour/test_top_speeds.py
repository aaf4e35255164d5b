"""How SUMO's drivers come down to the speeds that they want, and how fast they enter."""

import contextlib
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fogsim.traffic import Compliance, DriverSetup, Traffic
from fogsim.traffic.drivers.speed_choice import unaffected, within_sight
from fogsim.traffic.sumo.libsumo_link import load_libsumo
from fogsim.values import Command
from tests.traffic.common import driven, even, running, seen, setup_of, speeds_of

STEP, FAST = 0.1, 30.0
ADVISED = 15.0
# On a free road, and one more car that enters after the first two have been advised for a while.
ROUTES = """<routes>
  <vType id="c" vClass="passenger" carFollowModel="{model}" sigma="0" speedDev="0" maxSpeed="30"/>
  <route id="r" edges="approach bank exit"/>
  <vehicle id="ego" type="c" route="r" depart="0" departPos="600" departSpeed="30" departLane="1"/>
  <vehicle id="first" type="c" route="r" depart="0" departPos="300" departSpeed="30" departLane="1"/>
  <vehicle id="late" type="c" route="r" depart="15" departPos="base" departSpeed="30" departLane="1"/>
</routes>"""


UNAFFECTED = DriverSetup(unaffected, spread=0.0, compliance=Compliance(delay=0.0))


@pytest.fixture
def drive(tmp_path: Path) -> Iterator[Callable[..., tuple[Traffic, dict[str, list[float]]]]]:
    """Drives through fog of 60 m and tells everybody's speeds by step, from the step in which they enter."""
    stack = contextlib.ExitStack()

    def drive(
        drivers: DriverSetup, seconds: float, advised: float = math.inf, model: str = "Krauss"
    ) -> tuple[Traffic, dict[str, list[float]]]:
        setup = setup_of(tmp_path, ROUTES.format(model=model), ("ego", "first", "late"))
        traffic = stack.enter_context(running(replace(setup, drivers=drivers), even(60.0)))
        return traffic, speeds(traffic, seconds, advised)

    with stack:
        yield drive


def speeds(traffic: Traffic, seconds: float, advised: float = math.inf) -> dict[str, list[float]]:
    """Speeds after each step; everybody is advised a speed, if one is given."""
    snapshots = []
    for _ in range(round(seconds / STEP)):
        everybody = seen(traffic).state.ids if math.isfinite(advised) else ()
        snapshots += driven(traffic, 1, Command(advised_speeds=dict.fromkeys(everybody, advised)))
    return speeds_of(snapshots)


# EIDM's drivers err a little by themselves.
@pytest.mark.parametrize(("model", "hardest"), [("Krauss", 2.05), ("IDM", 2.1), ("EIDM", 2.3)])
def test_who_is_advised_slows_down_as_gently_as_asked(drive: Any, model: str, hardest: float) -> None:
    traffic, before = drive(UNAFFECTED, 2.0, model=model)
    assert before["first"][-1] == pytest.approx(FAST, abs=0.5)
    first = np.array(speeds(traffic, 15.0, ADVISED)["first"])
    assert first[-1] == pytest.approx(ADVISED, abs=0.7)
    slowing = -np.diff(first) / STEP
    assert 1.5 < slowing.max() <= hardest
    # Advice that is raised lets them speed up again.
    assert speeds(traffic, 8.0, ADVISED + 6.0)["first"][-1] == pytest.approx(ADVISED + 6.0, abs=0.7)
    # And who is advised no more drives as before, by the vehicle's own acceleration.
    assert speeds(traffic, 15.0)["first"][-1] == pytest.approx(FAST, abs=0.5)


def test_who_follows_advice_half_way_goes_no_farther(drive: Any) -> None:
    """However often it is given."""
    traffic, _ = drive(replace(UNAFFECTED, compliance=Compliance(strength=0.5, delay=0.0)), 1.0)
    assert speeds(traffic, 14.0, ADVISED)["first"][-1] == pytest.approx((FAST + ADVISED) / 2.0, abs=0.7)


def test_who_enters_has_been_in_that_fog_before(drive: Any) -> None:
    """Nobody comes along at 30 m/s and brakes for the fog at the edge of the network."""
    traffic, told = drive(DriverSetup(within_sight, spread=0.0), 20.0)
    # In SUMO's own departure step it is still as fast as its demand says.
    assert told["late"][0] == FAST
    assert max(told["late"][1:]) <= within_sight(60.0) + 0.05
    assert min(told["late"][1:]) > within_sight(60.0) - 0.5
    # Fog that thickens slows them down as gently as advice.
    traffic.enter_fog(even(30.0))
    first = np.array(speeds(traffic, 10.0)["first"])
    assert first[-1] == pytest.approx(within_sight(30.0), abs=0.3)
    assert 1.9 < (-np.diff(first) / STEP).max() <= 2.1


@pytest.mark.parametrize(("rate", "entering"), [(1.0, ADVISED), (0.0, FAST)])
def test_who_enters_has_passed_the_sign_upstream_if_one_who_follows_it(
    drive: Any, rate: float, entering: float
) -> None:
    drivers = replace(UNAFFECTED, compliance=Compliance(rate=rate, delay=4.0))
    _, told = drive(drivers, 20.0, advised=ADVISED)
    assert told["late"][1:] == pytest.approx([entering] * (len(told["late"]) - 1), abs=0.05)


def test_who_was_on_the_road_when_the_fog_came_does_not_jump(drive: Any) -> None:
    traffic, _ = drive(UNAFFECTED, 20.0)
    traffic._setup = replace(traffic._setup, drivers=DriverSetup(within_sight, spread=0.0))
    traffic.enter_fog(even(60.0))
    for slowed in speeds(traffic, 4.0).values():
        assert (-np.diff(slowed) / STEP).max() <= 2.1


def test_who_gets_another_type_goes_on_in_the_fog(drive: Any) -> None:
    traffic, _ = drive(DriverSetup(within_sight, spread=0.0), 20.0)
    load_libsumo().vehicle.setType("first", "DEFAULT_VEHTYPE")
    assert max(speeds(traffic, 10.0)["first"]) == pytest.approx(within_sight(60.0), abs=2.7)
    assert speeds(traffic, 5.0)["first"][-1] == pytest.approx(within_sight(60.0), abs=0.1)


def test_only_moving_top_speeds_cost_a_call(drive: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    traffic, _ = drive(UNAFFECTED, 2.0)
    vehicles = load_libsumo().vehicle
    calls: list[str] = []
    monkeypatch.setattr(vehicles, "setMaxSpeed", lambda vehicle, _: calls.append(vehicle))
    speeds(traffic, 2.0)
    assert calls == []
    speeds(traffic, 10.0, ADVISED)
    # From 30 to 15 m/s at 2 m/s² in steps of 0.1 s, and then no more.
    assert calls.count("first") == pytest.approx(75, abs=2)
