"""SUMO's own surrogate-safety device (SSM) agrees with our measures on the same run."""

import math
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from fogsim.metrics import deceleration_rate_to_avoid_crash, time_to_collision
from fogsim.traffic import TrafficSetup
from fogsim.traffic.sumo.libsumo_link import LibsumoLink
from fogsim.traffic.sumo.link import Api
from fogsim.traffic.sumo_traffic import SumoTraffic
from fogsim.values import Command

FOLDER = Path(__file__).resolve().parents[2] / "scenarios" / "motorway_fog_bank"
SETUP = TrafficSetup(
    net=FOLDER / "motorway.net.xml",
    routes=(FOLDER / "motorway.rou.xml",),
    additional=(),
    ego="ego",
    step_length=0.1,
    keep_lane=("ego", "lead"),
    warm_up_limit=600.0,
    advice_deceleration=2.0,
    reading_radius=300.0,
    events=(),
)
RANGE = 200.0
"""Distance up to which the device looks [m]; its default of 50 m is nothing in fog."""

FOLLOWING = "2"
"""The device's code for an ego that follows its foe in one lane."""

Measures = dict[tuple[float, str], tuple[float, float]]
"""Time to collision [s] and DRAC [m/s²] by time [s] and leader; ``inf`` and 0 where it is not approached."""


class WithDevice(LibsumoLink):
    """SUMO in this process with the device on the ego, and a hand on the simulation."""

    def __init__(self, output: Path) -> None:
        super().__init__()
        self._output = output
        self.api: Api = None

    def begin(self, arguments: Sequence[str]) -> Api:
        device = {"explicit": "ego", "measures": "TTC DRAC", "thresholds": "1e9 0", "range": f"{RANGE:g}"}
        device |= {"trajectories": "true", "extratime": "0", "file": str(self._output)}
        options = [part for key, value in device.items() for part in (f"--device.ssm.{key}", value)]
        self.api = super().begin([*arguments, *options, "--precision", "9"])
        return self.api


def drive(output: Path) -> Measures:
    """The ego follows a leader that brakes to a standstill and drives on; our measures of it."""
    link = WithDevice(output)
    traffic = SumoTraffic(SETUP, link)
    measures: Measures = {}
    try:
        traffic.start(5)
        for step in range(500):
            if step == 150:
                link.api.vehicle.slowDown("lead", 0.0, 6.0)
            if step == 350:
                link.api.vehicle.setSpeed("lead", -1.0)
            traffic.advance(Command())
            snapshot = traffic.observe()
            if snapshot is None or snapshot.leader is None:
                continue
            leader, speed = snapshot.leader, float(snapshot.state.speed[snapshot.ego])
            measures[round(snapshot.state.time, 1), leader.vehicle_id] = (
                float(time_to_collision(leader.gap, speed, leader.speed)),
                float(deceleration_rate_to_avoid_crash(leader.gap, speed, leader.speed)),
            )
    finally:
        traffic.close()
    return measures


def device_measures(output: Path) -> Measures:
    """What the device wrote, where it takes the ego for a follower."""
    measures: Measures = {}
    for conflict in ET.parse(output).getroot().iter("conflict"):  # noqa: S314 - written by the test's own run
        spans = [_values(conflict, name) for name in ("timeSpan", "typeSpan", "TTCSpan", "DRACSpan")]
        for time, kind, ttc, drac in zip(*spans, strict=True):
            if kind == FOLLOWING:
                # The device names a step by its beginning, the simulation's clock after it by its end.
                measures[round(float(time) + SETUP.step_length, 1), conflict.get("foe", "")] = (
                    math.inf if ttc == "NA" else float(ttc),
                    0.0 if drac == "NA" else float(drac),
                )
    return measures


def _values(conflict: ET.Element, name: str) -> list[str]:
    span = conflict.find(name)
    assert span is not None, name
    return span.get("values", "").split()


def test_time_to_collision_and_drac_are_those_of_sumos_device(tmp_path: Path) -> None:
    ours, theirs = drive(tmp_path / "ssm.xml"), device_measures(tmp_path / "ssm.xml")
    both = sorted(ours.keys() & theirs.keys())
    mine, device = (np.array([measures[key] for key in both]) for measures in (ours, theirs))
    np.testing.assert_array_equal(np.isfinite(mine), np.isfinite(device))
    approached = np.isfinite(mine[:, 0])
    # The device writes nine digits behind the point.
    assert mine[approached, 0] == pytest.approx(device[approached, 0], rel=1e-6)
    assert mine[:, 1] == pytest.approx(device[:, 1], abs=1e-6)
    # The drive had something to compare: from afar to a hard approach, and a leader that pulls away.
    assert np.count_nonzero(approached) > 200
    assert np.count_nonzero(~approached) > 200
    assert mine[approached, 0].min() < 3.5
    assert mine[:, 1].max() > 1.5
