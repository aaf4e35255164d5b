"""Whom obstructions hide from drivers: by hand, and on a bend where the driver brakes later than without them."""

from pathlib import Path
from typing import cast

import numpy as np
import pytest

import fogsim
from fogsim.atmosphere import FieldAccess
from fogsim.traffic import DriverSight
from fogsim.traffic.sumo.roster import Roster
from fogsim.traffic.sumo_drivers.vehicle_sight import DriversView, VehicleSight
from fogsim.values import FogField, Structure, StructureKind
from fogsim.values.obstruction import Obstructions, obstructions_of
from tests.traffic.sumo_drivers.test_vehicle_sight import two_vehicles

PAIRS = [("me", "other"), ("other", "me")]
BEND = """
name: bend
duration: 11.6 s
clocks: {camera_period: 0.2 s, decision_period: 0.4 s}
renderer: none
camera: {width: 64, height: 48}
road:
  template: curve
  length: 1000 m
  limit: 100 km/h
  curve_at: 250 m
  curve_radius: 150 m
  curve_turn: 90 deg
  obstructions: OBSTRUCTIONS
actors:
  ego: {lane: right, position: 150 m, speed: 90 km/h}
  wreck: {lane: right, ahead_of: ego, gap: 330 m, stands: true}
fog: {visibility: inf}
sut: {estimators: [], advice: none}
"""
WALL = "[{kind: wall, at: 230 m, length: 300 m, side: left, distance: 0.5 m}]"
KERB = "[{kind: wall, at: 230 m, length: 300 m, side: left, distance: 0.5 m, height: 0.3 m}]"


def across(y: tuple[float, float], height: float) -> Obstructions:
    """A wall across my way, 20 m ahead."""
    line = np.array([[20.0, y[0], 0.0], [20.0, y[1], 0.0]])
    return obstructions_of([Structure("wall", StructureKind.WALL, line, 0.3, 0.0, height)])


def test_a_vehicle_is_hidden_when_every_corner_is() -> None:
    for y, height, top, hidden in [
        ((-9.0, 9.0), 2.0, 1.5, True),
        ((-9.0, 9.0), 2.0, 4.0, False),  # its roof stands out over the wall
        ((-9.0, 9.0), 0.5, 1.5, False),  # over a kerb
        ((-9.0, 0.3), 2.0, 1.5, False),  # its left side stands out
        ((-9.0, 0.7), 2.0, 1.5, True),
    ]:
        # The other's front is 45 m ahead of mine.
        api, wall = two_vehicles(45.0, 0.0, 0.0, top=top), across(y, height)
        clear = FieldAccess(FogField(0.0, (3000.0,) * 3))
        view = DriversView(api, clear, DriverSight(10_000.0), cast("Roster", None), obstructions=wall)
        assert view.hidden_vehicles is not None
        assert view.hidden_vehicles.are_hidden(PAIRS[:1]) == [hidden]
        assert view.hidden_vehicles.are_hidden([]) == []
        sight = VehicleSight(view)
        assert sight.sees(PAIRS[:1], {}) == [not hidden]
        assert sight.certainly_seen == 0.0


def drive(folder: Path, obstructions: str, *overrides: str) -> list[fogsim.Step]:
    file = folder / "bend.yaml"
    file.write_text(BEND.replace("OBSTRUCTIONS", obstructions), encoding="utf-8")
    return list(fogsim.run(fogsim.load_scenario(file, list(overrides)), seed=1))


def test_behind_a_blind_bend_a_driver_brakes_later(tmp_path: Path) -> None:
    def gaps(steps: list[fogsim.Step]) -> tuple[float, float]:
        """Where the driver begins to brake, and where the radar finds the wreck for the first time [m]."""
        braking = next(s.leader.gap for s in steps if s.leader and s.traffic.speed[s.ego] < 24.5)
        return braking, next(s.leader.gap for s in steps if s.leader and s.observation.lead)

    free, walled, low = (drive(tmp_path, one) for one in ("[]", WALL, KERB))
    assert gaps(free)[0] > 95.0
    assert gaps(free)[1] > 170.0
    # The chord that touches the wall, 5.9 m inside the middle of the lane of radius 151.75 m: 2 √(2 · 151.75 · 5.9) m.
    in_sight = gaps(walled)[1]
    assert in_sight == pytest.approx(85.0, abs=8.0)
    assert gaps(walled)[0] < in_sight - 20.0
    assert [s.traffic.speed[s.ego] for s in low] == [s.traffic.speed[s.ego] for s in free]
    through = drive(tmp_path, WALL, "drivers.see_through_fog=true")
    assert [s.traffic.speed[s.ego] for s in through] == [s.traffic.speed[s.ego] for s in free]
