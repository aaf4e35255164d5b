"""Kinds of drivers behind a leader in SUMO: who stays in sight, who falls back, and what is given back."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from fogsim.traffic import DriverSetup, DriverSight, Traffic, TrafficSetup
from fogsim.traffic.drivers.sight import leader_reach
from fogsim.traffic.drivers.speed_choice import observed
from fogsim.traffic.sumo.libsumo_link import load_libsumo
from tests.traffic.common import driven, even, running, setup_of

SLOW, FAST = 13.4, 22.4
VISIBILITY = 40.0
SIGHT = DriverSight(10_000.0)
STEP = 0.2
# The leader is the ego, whose speed is no choice of FogSim's drivers.
ROUTES = """<routes>
  <vType id="leader" maxSpeed="{speed}" speedDev="0" sigma="0"/>
  <vType id="c" tau="1.2" speedDev="0" sigma="0"/>
  <route id="r" edges="approach bank exit"/>
  <vehicle id="ego" type="leader" route="r" depart="0" departPos="60" departSpeed="{speed}" departLane="1"/>
  <vehicle id="behind" type="c" route="r" depart="0" departPos="28" departSpeed="{speed}" departLane="1"/>
</routes>"""


def pair(folder: Path, speed: float, drivers: DriverSetup) -> TrafficSetup:
    setup = setup_of(folder, ROUTES.format(speed=speed), ("ego", "behind"), STEP)
    return replace(setup, sight=SIGHT, drivers=drivers)


def gap_after(traffic: Traffic, seconds: float) -> float:
    """Gap from the follower to its leader [m]."""
    state = driven(traffic, round(seconds / STEP))[-1].state
    front, behind = (state.position[state.row(v)][0] for v in ("ego", "behind"))
    return float(front - behind) - 5.0


@pytest.mark.parametrize("kind", ["in_sight", "out_of_sight"])
def test_fog_parts_drivers_behind_a_fast_leader_and_not_behind_a_slow_one(tmp_path: Path, kind: str) -> None:
    """Broughton, Switzer & Scott 2007: at 22.4 m/s some stay in sight, at less than 2 s, others lag out of it."""
    seen, gaps = leader_reach(SIGHT, VISIBILITY).farthest, []
    assert SLOW < observed(VISIBILITY) < FAST
    for speed in (SLOW, FAST):
        setup = pair(tmp_path, speed, DriverSetup(spread=0.0, following={kind: 1.0}))
        with running(setup, even(VISIBILITY)) as traffic:
            gaps.append(gap_after(traffic, 60.0))
    slow, fast = gaps
    assert slow < seen
    if kind == "in_sight":
        assert 0.5 * FAST < fast < min(seen, 2.0 * FAST)
    else:
        assert fast > 3.0 * seen


def conduct(vehicle: str = "behind") -> tuple[float, ...]:
    get = load_libsumo().vehicle
    return get.getTau(vehicle), get.getSpeedFactor(vehicle), get.getMaxSpeed(vehicle)


def test_headways_grow_and_are_given_back(tmp_path: Path) -> None:
    drivers = DriverSetup(following={"careful": 1.0})
    with running(pair(tmp_path, SLOW, drivers), even(VISIBILITY)) as traffic:
        gap_after(traffic, 4.0)
        headway, factor, top_speed = conduct()
        assert headway == pytest.approx(2.0)
        assert factor == pytest.approx(observed.share(VISIBILITY))
        assert top_speed < 25.0
        traffic.enter_fog(even(10_000.0))
        gap_after(traffic, 3.0)
        assert conduct()[:2] == (1.2, 1.0)
        traffic.enter_fog(even(VISIBILITY))
        gap_after(traffic, 3.0)
        assert conduct()[0] == pytest.approx(2.0)
        traffic.release()
        assert conduct() == (1.2, 1.0, pytest.approx(55.56, abs=0.01))


def test_in_clear_air_nothing_is_set(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drivers = DriverSetup(misjudgement=0.5, following={"in_sight": 0.5, "out_of_sight": 0.5})
    with running(pair(tmp_path, FAST, drivers), even(math.inf)) as traffic:
        vehicles = load_libsumo().vehicle
        for name in ("setTau", "setSpeedFactor", "setMaxSpeed", "setPreviousSpeed"):
            monkeypatch.setattr(vehicles, name, lambda *_: pytest.fail("a vehicle was changed"))
        gap_after(traffic, 5.0)
        assert conduct() == (1.2, 1.0, pytest.approx(55.56, abs=0.01))
