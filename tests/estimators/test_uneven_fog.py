"""joint_road before banks and in patches, drawn by FogSim's own renderer with traffic."""

import math

import numpy as np
import pytest
from early_motorway import EARLY
from flat_road import Road, photograph, scan

import fogsim
from fogsim.estimators import make
from fogsim.values import Frame, Observation, OpticalDepths

BANK = "fog={outside_visibility_m: 2000, banks: [{start_m: 700, end_m: 1900, edge_m: 300, visibility_m: 60}]}"
CLOCKS = ("clocks.camera_period_s=0.5", "clocks.decision_period_s=0.5", "estimators=[joint_road]")


@pytest.fixture(scope="module")
def drive():
    """Steps of the demo's drive towards its bank, from 400 to 0 m before half density."""
    scenario = fogsim.load_scenario("motorway_fog_bank", (EARLY, BANK, *CLOCKS, "duration_s=30"))
    return [step for step in fogsim.run(scenario, 1) if 300.0 < step.route_position < 700.0]


def test_a_bank_is_announced_before_it_is_reached_and_where_it_is(drive):
    announced = [step for step in drive if step.belief.denser is not None]
    assert announced
    first = announced[0]
    assert 700.0 - first.route_position > 150.0
    for step in announced:
        assert step.belief.denser.distance == pytest.approx(700.0 - step.route_position, abs=80.0)


def test_the_estimate_follows_the_sight_into_the_bank(drive):
    off = []
    for step in drive:
        (estimate,) = step.estimates
        if estimate.valid and 700.0 - step.route_position < 90.0:
            off.append(math.log(estimate.extinction / step.truth.extinction_ahead))
    assert len(off) >= 4
    assert np.median(np.abs(off)) < 0.15


def test_a_curve_of_optical_depths_is_read_between_its_places():
    curve = OpticalDepths((10.0, 20.0, 40.0), (0.1, 0.3, 1.1), (0.01, 0.02, 0.08))
    assert curve.mean_extinction(20.0) == pytest.approx((0.015, 0.001))
    assert curve.mean_extinction(30.0) == pytest.approx((0.7 / 30.0, 0.05 / 30.0))
    assert curve.mean_extinction(5.0) == pytest.approx((0.01, 0.001))
    assert curve.mean_extinction(99.0) == pytest.approx((1.1 / 40.0, 0.002))


@pytest.fixture(scope="module")
def pictures():
    """A road in fogs of 85 … 70 m, and its camera."""
    drawing = scan(Road(), 3, 2)
    return {sight: photograph(Road(visibility=sight), drawing, 3) for sight in (85.0, 80.0, 75.0, 70.0)}, Road().camera


def relative_deviation(found):
    return found.standard_deviation / found.extinction


def test_fog_that_changes_from_picture_to_picture_is_uneven_along_the_way(pictures):
    images, camera = pictures
    alone = make("joint_road", camera).update(Observation(Frame(3.0, images[70.0], camera)))
    same, changing = make("joint_road", camera), make("joint_road", camera)
    for i, sight in enumerate((85.0, 80.0, 75.0, 70.0)):
        constant = same.update(Observation(Frame(float(i), images[70.0], camera)))
        found = changing.update(Observation(Frame(float(i), images[sight], camera)))
    assert constant == alone
    assert found.extinction == alone.extinction
    logarithms = np.log([85.0, 80.0, 75.0, 70.0])
    expected = math.hypot(relative_deviation(alone), 1.5 * float(np.std(logarithms)))
    assert relative_deviation(found) == pytest.approx(expected, rel=0.1)


def test_pictures_long_ago_or_without_times_tell_nothing_of_that(pictures):
    images, camera = pictures
    alone = make("joint_road", camera).update(Observation(Frame(0.0, images[70.0], camera)))
    for times in ((0.0, 0.0), (0.0, 20.0), (20.0, 0.0)):
        estimator = make("joint_road", camera)
        estimator.update(Observation(Frame(times[0], images[85.0], camera)))
        if times[1] < times[0]:
            estimator.reset()
        assert estimator.update(Observation(Frame(times[1], images[70.0], camera))) == alone
