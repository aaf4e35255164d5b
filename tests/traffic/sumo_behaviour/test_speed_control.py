"""What advice and scripts leave to the drivers whose speed they set."""

import contextlib
from pathlib import Path

import pytest

from fogsim.traffic.sumo.libsumo_link import load_libsumo
from fogsim.traffic.sumo_behaviour.speed_control import SpeedControl
from tests.traffic.common import NET, QUIET

STEP, FAST = 0.1, 24.0
ROUTES = """<routes>
  <vType id="c" sigma="0" decel="4.5" emergencyDecel="9"/>
  <route id="r" edges="approach bank exit"/>
  <vehicle id="wreck" type="c" route="r" depart="0" departPos="300" departSpeed="0" departLane="1">
    <stop edge="approach" lane="approach_1" endPos="300.5" duration="900"/>
  </vehicle>
  <vehicle id="driver" type="c" route="r" depart="0" departPos="100" departSpeed="24" departLane="1"/>
</routes>"""


def brake(folder: Path, advised: float | None) -> tuple[float, bool]:
    """Hardest braking [m/s²] for a wreck that is seen from 50 m, when advice comes too; and whether it is hit."""
    routes = folder / "wreck.rou.xml"
    routes.write_text(ROUTES, encoding="utf-8")
    with contextlib.closing(load_libsumo()) as api:
        options = ["-n", str(NET), "-r", str(routes), "--step-length", str(STEP), *QUIET]
        api.start(["sumo", *options, "--collision.action", "warn", "--collision.mingap-factor", "0"])
        api.simulationStep()
        speeds, hardest, hit = SpeedControl(api, STEP), 0.0, False
        api.vehicle.setMaxSpeed("driver", FAST)
        api.vehicle.setLaneChangeMode("driver", 0)
        api.vehicle.setParameter("driver", "carFollowModel.ignoreIDs", "wreck")
        for _ in range(150):
            seen = api.vehicle.getLanePosition("driver") > 245.0
            if seen:
                api.vehicle.setParameter("driver", "carFollowModel.ignoreIDs", "")
            if seen and advised is not None:
                speeds.apply({"driver": (advised, 2.0)})
            api.simulationStep()
            hardest = max(hardest, -api.vehicle.getAcceleration("driver"))
            hit = hit or bool(api.simulation.getCollidingVehiclesNumber())
        return hardest, hit


def test_advice_takes_no_emergency_braking_from_a_driver(tmp_path: Path) -> None:
    alone, hit = brake(tmp_path, None)
    assert not hit
    assert alone > 5.0  # harder than SUMO lets a vehicle brake whose speed is set
    for advised in (11.0, FAST):
        assert brake(tmp_path, advised) == (pytest.approx(alone, abs=0.5), False)
