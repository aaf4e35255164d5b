"""Runs of OpenSCENARIO files: what the file asks for is what happens."""

import math

import numpy as np
import pytest

import fogsim
from fogsim.values import Ending, Lamp, Step
from tests.openscenario.writing import DATA, motion, run


@pytest.fixture(scope="module")
def cut_in() -> list[Step]:
    return run(DATA / "cut_in_in_fog.xosc")


@pytest.fixture(scope="module")
def slow_lead() -> list[Step]:
    with pytest.warns(fogsim.errors.LeftOutWarning):
        return run(DATA / "slow_lead.xosc")


def _begun(steps: list[Step], name: str) -> int:
    """Number of the last step before something began."""
    return next(i for i, step in enumerate(steps) if any(b.name == name and not b.is_over for b in step.begun)) - 1


def test_vehicles_begin_where_and_as_fast_as_the_file_says(cut_in: list[Step], slow_lead: list[Step]) -> None:
    # s = 60 m on a road that begins at x = 100 m, and 3.8 m from the rear axle to the bumper; lanes of 3.5 m.
    assert motion(cut_in[0], "Ego") == pytest.approx((163.8, -25.25, 20.0), abs=0.1)
    assert motion(cut_in[0], "Overtaker") == pytest.approx((148.8, -21.75, 25.0), abs=0.1)
    assert motion(slow_lead[0], "Ego") == pytest.approx((153.8, -25.25, 25.0), abs=0.1)
    assert motion(slow_lead[0], "Lead") == pytest.approx((367.0, -25.25, 2.0), abs=0.1)


def test_a_black_target_at_visual_range_has_five_percent_contrast(cut_in: list[Step]) -> None:
    before, after = cut_in[_begun(cut_in, "thicker_fog")], cut_in[-1]
    for step, visual_range in ((before, 140.0), (after, 60.0)):
        fog = step.truth.fog
        density = np.prod([change.density for change in fog.changes[-1:]])
        assert math.exp(-fog.extinction * density * visual_range) == pytest.approx(0.05, rel=1e-9)
        assert step.truth.visibility == pytest.approx(visual_range, rel=1e-9)


def test_the_lane_changes_at_the_headway(cut_in: list[Step]) -> None:
    step = cut_in[_begun(cut_in, "cut_in")]
    (ego, _, speed), (other, _, _) = motion(step, "Ego"), motion(step, "Overtaker")
    # Rear axles are as far apart as front bumpers; within one period of 0.1 s at 5 m/s more than the ego's speed.
    assert 0.5 < (other - ego) / speed <= 0.5 + 0.1 * 5.0 / speed + 1e-3
    assert step.traffic.lane[step.traffic.ids.index("Overtaker")] == "-7_1"
    later = cut_in[_begun(cut_in, "cut_in") + 32]
    assert motion(later, "Overtaker")[1] == pytest.approx(-25.25, abs=0.1)


def test_speeds_follow_their_dynamics(slow_lead: list[Step]) -> None:
    begin = _begun(slow_lead, "brake")
    ego, lead = motion(slow_lead[begin], "Ego"), motion(slow_lead[begin], "Lead")
    time = (lead[0] - 8.0 - ego[0]) / (ego[2] - lead[2])
    assert 3.2 - 0.1 * 1.1 < time < 3.2
    # 6 m/s² from then on; within one step.
    for passed in range(1, 41, 5):
        assert motion(slow_lead[begin + passed], "Ego")[2] == pytest.approx(max(25.0 - 0.6 * passed, 0.0), abs=0.61)


def test_delays_lamps_and_stop_triggers(slow_lead: list[Step]) -> None:
    lit = next(s for s in slow_lead if int(s.traffic.lamps[s.traffic.ids.index("Lead")]) & Lamp.REAR_FOG)
    driven = next(s for s in slow_lead if motion(s, "Ego")[0] - motion(slow_lead[0], "Ego")[0] >= 20.0)
    assert lit.time - driven.time == pytest.approx(0.5 + 0.1, abs=0.11)
    assert slow_lead[-1].ending is Ending.END_CONDITION
    stood = next(s for s in slow_lead if motion(s, "Ego")[2] < 0.1)
    assert slow_lead[-1].time - stood.time == pytest.approx(0.5, abs=0.11)
