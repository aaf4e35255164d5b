from dataclasses import replace

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.estimators import make
from fogsim.values import Camera, Frame, LeadMeasurement, Observation

CAMERA = Camera(688, 515, 700.0, (343.5, 257.0), 1.3, np.radians(2.0))
SETBACK = 1.7
RANGES = range(25, 91, 5)


def track(render, road, seed=0, gains=None, brakes=()):
    """Frames of one vehicle at growing range, measured with the sensor's noise."""
    rng = np.random.default_rng(seed)
    for i, distance in enumerate(RANGES):
        pitch = rng.normal(0.0, np.radians(0.1))
        gain = gains[i] if gains else 1.0
        scene = road.but(
            camera=replace(CAMERA, pitch=CAMERA.pitch + pitch),
            lead_distance=float(distance),
            airlight=road.airlight * gain,
            asphalt=road.asphalt * gain,
            mark=road.mark * gain,
            terrain=road.terrain * gain,
            lead_paint=road.lead_paint * gain,
            lead_brakes=i in brakes,
        )
        lead = LeadMeasurement(distance - SETBACK + rng.normal(0, 0.25), 5.0)
        yield Observation(Frame(float(i), render(scene, 100 * seed + i, 1), CAMERA), lead=lead)


def last(observations, **options):
    estimator = make("lead_contrast", CAMERA, **options)
    return [estimator.update(o) for o in observations][-1]


@pytest.mark.parametrize(("visibility", "worst"), [(50, 6), (100, 5), (300, 6), (500, 10)])
def test_a_vehicle_that_draws_away_tells_the_visibility(render, road, visibility, worst):
    for seed in range(2):
        found = last(track(render, road.but(visibility=visibility), seed))
        assert found.valid
        # The judge takes k = 3 / V.
        assert abs(found.extinction * visibility / 3.0 - 1.0) < worst / 100


def test_exposure_and_brake_lamps_change_little(render, road):
    steady = last(track(render, road))
    gains = [1.0, 0.9, 0.8, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.1, 1.0, 0.9, 0.8, 1.0]
    changing = last(track(render, road, gains=gains))
    braking = last(track(render, road, brakes=(2, 3, 8, 9, 10)))
    for found in (changing, braking):
        assert found.extinction == pytest.approx(steady.extinction, rel=0.05)


def test_a_constant_error_of_the_setback_changes_little(render, road):
    observations = list(track(render, road))
    near, far = (last(observations, setback=setback).extinction for setback in (0.7, 2.7))
    assert near == pytest.approx(far, rel=0.06)


def test_no_vehicle_or_no_change_of_range_is_no_answer(render, road):
    scene = road.but(camera=CAMERA, lead_distance=40.0)
    assert not last([Observation(render(scene))]).valid
    still = [Observation(render(scene, s, 1), lead=LeadMeasurement(38.3, 0.0)) for s in range(8)]
    found = last(still)
    assert not found.valid
    assert found.diagnostics["reason"]


def test_another_vehicle_begins_a_new_track(render, road):
    estimator = make("lead_contrast", CAMERA)
    for observation in track(render, road):
        before = estimator.update(observation)
    assert before.valid
    other = road.but(camera=CAMERA, lead_distance=30.0, lead_paint=120.0)
    after = estimator.update(Observation(Frame(14.0, render(other), CAMERA), lead=LeadMeasurement(28.3, 0.0)))
    assert not after.valid
    assert "short" in str(after.diagnostics["reason"])


def test_losing_the_vehicle_and_reset_forget_the_track(render, road):
    observations = list(track(render, road))
    estimator = make("lead_contrast", CAMERA)
    for observation in observations:
        estimator.update(observation)
    assert not estimator.update(Observation(observations[0].frame)).valid
    assert not estimator.update(observations[0]).valid
    for observation in observations:
        estimator.update(observation)
    estimator.reset()
    assert not estimator.update(observations[0]).valid


@pytest.mark.parametrize("distance", [np.nan, np.inf, -1.0, 0.0, 0.5, 1e6])
def test_odd_ranges_are_no_answer(render, road, distance):
    image = render(road.but(camera=CAMERA))
    assert not last([Observation(image, lead=LeadMeasurement(distance, 0.0))] * 6).valid


@pytest.mark.parametrize("name", ["setback", "range_deviation", "pitch_deviation", "window", "frames"])
def test_parameters_out_of_range_are_errors(name):
    with pytest.raises(InputError, match=name):
        make("lead_contrast", CAMERA, **{name: -1})
