"""gabb2014: a vehicle that disappears tells the fog, one that does not bounds it."""

import math

import numpy as np
import pytest

from fogsim.estimators import make
from fogsim.estimators.other_sensors.gabb2014 import LossLikelihood
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, Frame, LeadMeasurement, Observation
from fogsim.values.estimate import ExtinctionBounds

CAMERA = Camera(480, 360, 433.0, (239.5, 179.5), 1.38, np.radians(2.0))
AWAY = tuple(float(d) for d in np.arange(14.0, 111.0, 6.0))
SETBACK, PERIOD = 1.7, 1.0


def observed(image, number: int, distance: float | None) -> Observation:
    lead = None if distance is None else LeadMeasurement(distance, 6.0)
    return Observation(Frame(PERIOD * number, image, CAMERA), 20.0, lead, camera_setback=SETBACK)


@pytest.fixture(scope="module")
def drive(render, road):
    """Function from a visibility and ranges to what the method says picture by picture."""

    def estimates(visibility: float, ranges=AWAY, told=True, **changes):
        estimator = make("gabb2014", CAMERA)
        found = []
        for number, distance in enumerate(ranges):
            scene = road.but(camera=CAMERA, visibility=visibility, lead_distance=distance + SETBACK, **changes)
            image = render(scene, number)
            found.append(estimator.update(observed(image, number, distance if told else None)))
        return found

    return estimates


@pytest.mark.parametrize(
    ("visibility", "ranges"), [(50.0, AWAY), (70.0, AWAY[::-1])], ids=["lost", "comes out of the fog"]
)
def test_a_vehicle_that_disappears_tells_the_fog(drive, visibility, ranges) -> None:
    found = drive(visibility, ranges)
    valid = [one for one in found if one.valid]
    assert valid
    assert valid[0].visibility == pytest.approx(visibility, rel=0.25)
    for one in found:
        low, high = one.visibility_interval
        assert low <= visibility <= high
    # No more is claimed than what the vehicle's unknown contrast allows.
    assert 0.08 < valid[0].standard_deviation / valid[0].extinction < 0.5


def test_found_all_the_way_is_a_bound_from_above_only(drive) -> None:
    last = drive(400.0, AWAY[:10])[-1]
    assert not last.valid
    assert last.bounds is not None
    assert last.bounds.least == 0.0
    assert extinction_from_visibility(400.0) < last.bounds.most < extinction_from_visibility(40.0)


def test_never_found_is_a_bound_from_below_only(drive) -> None:
    last = drive(30.0, AWAY[-1:6:-1])[-1]
    assert not last.valid
    assert last.bounds is not None
    assert last.bounds.most == math.inf
    assert 0.0 < last.bounds.least < extinction_from_visibility(30.0)


def test_no_vehicle_and_one_that_is_too_small_say_nothing(drive) -> None:
    last = drive(60.0, AWAY[:3], told=False)[-1]
    assert (last.valid, last.bounds, last.diagnostics["reason"]) == (False, None, "no vehicle ahead is tracked")
    far = drive(30.0, (170.0, 175.0, 180.0))[-1]
    assert (far.valid, far.bounds) == (False, None)


def test_what_was_learnt_fades(drive, render, road) -> None:
    estimator = make("gabb2014", CAMERA)
    image = render(road.but(camera=CAMERA, visibility=400.0, lead_distance=41.7))
    assert estimator.update(observed(image, 0, 40.0)).bounds is not None
    assert estimator.update(observed(image, 1000, None)).bounds is None


def test_lamps_by_night_are_refused(render, road) -> None:
    dark = render(road.but(camera=CAMERA, lead_distance=41.7)) // 60
    found = make("gabb2014", CAMERA).update(observed(dark, 0, 40.0))
    assert not found.valid
    assert found.bounds is None
    assert "daytime" in found.diagnostics["reason"]


def test_likelihood_of_a_loss_is_at_the_contrast_over_the_threshold() -> None:
    """k d = ln(C0 / C_t): at 80 m with C0 of about 0.64 and a threshold of 2 % some 0.043 1/m."""
    learnt = LossLikelihood()
    assert learnt.result() is None
    for distance in (70.0, 75.0, 78.0, 82.0, 85.0, 90.0):
        learnt.learn(distance, 0.02, 1.0, found=distance < 80.0)
    found = learnt.result()
    assert isinstance(found, tuple)
    assert found[0] == pytest.approx(math.log(math.exp(-0.45) / 0.02) / 80.0, rel=0.1)
    learnt.fade(50.0)
    assert learnt.result() is None


def test_what_contradicts_is_believed_after_some_looks() -> None:
    """Fog begins between a vehicle and the own one: found for long, then no more."""
    learnt = LossLikelihood()
    for _ in range(50):
        learnt.learn(70.0, 0.02, 1.0, found=True)
    before = learnt.result()
    assert isinstance(before, ExtinctionBounds)
    assert before.least == 0.0
    for _ in range(4):
        learnt.learn(70.0, 0.02, 1.0, found=False)
    after = learnt.result()
    assert isinstance(after, ExtinctionBounds)
    assert after.most == math.inf
    assert after.least > 0.0


def test_vehicles_that_contradict_each_other_tell_nothing() -> None:
    learnt = LossLikelihood()
    learnt.learn(100.0, 0.02, 2.0, found=True)
    learnt.meet_another()
    learnt.learn(60.0, 0.02, 2.0, found=False)
    assert learnt.result() is None
