"""joint_road before banks and in patches, drawn by FogSim's own renderer with traffic."""

import math

import numpy as np
import pytest

import fogsim
from fogsim.values import OpticalDepths

BANK = "fog={outside_visibility_m: 2000, banks: [{start_m: 1300, end_m: 2500, edge_m: 300, visibility_m: 60}]}"
CLOCKS = ("clocks.camera_period_s=0.5", "clocks.decision_period_s=0.5", "estimators=[joint_road]")


@pytest.fixture(scope="module")
def drive():
    """Steps of the demo's drive towards its bank, from 400 to 0 m before half density."""
    scenario = fogsim.load_scenario("motorway_fog_bank", (BANK, *CLOCKS, "duration_s=50"))
    return [step for step in fogsim.run(scenario, 1) if 900.0 < step.route_position < 1300.0]


def test_a_bank_is_announced_before_it_is_reached_and_where_it_is(drive):
    announced = [step for step in drive if step.belief.denser is not None]
    assert announced
    first = announced[0]
    assert 1300.0 - first.route_position > 150.0
    for step in announced:
        assert step.belief.denser.distance == pytest.approx(1300.0 - step.route_position, abs=80.0)


def test_the_estimate_follows_the_sight_into_the_bank(drive):
    off = []
    for step in drive:
        (estimate,) = step.estimates
        if estimate.valid and 1300.0 - step.route_position < 90.0:
            off.append(math.log(estimate.extinction / step.truth.extinction_ahead))
    assert len(off) >= 4
    assert np.median(np.abs(off)) < 0.15


def test_a_curve_of_optical_depths_is_read_between_its_places():
    curve = OpticalDepths((10.0, 20.0, 40.0), (0.1, 0.3, 1.1), (0.01, 0.02, 0.08))
    assert curve.mean_extinction(20.0) == pytest.approx((0.015, 0.001))
    assert curve.mean_extinction(30.0) == pytest.approx((0.7 / 30.0, 0.05 / 30.0))
    assert curve.mean_extinction(5.0) == pytest.approx((0.01, 0.001))
    assert curve.mean_extinction(99.0) == pytest.approx((1.1 / 40.0, 0.002))
