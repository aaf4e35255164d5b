import numpy as np
import pytest

from fogsim.vision.vehicle.airlight import airlight_beside

NOISE = 2.0


def sky(light=180.0, seed=0):
    return np.random.default_rng(seed).normal(light, NOISE, (60, 600)).astype(np.float32)


@pytest.mark.parametrize("about", [179.0, 180.0, 181.5])
def test_the_light_of_an_even_sky_whatever_it_was_thought_to_be(about):
    errors = [airlight_beside(sky(seed=s), about, NOISE, 300.0, 30.0) / 180.0 - 1 for s in range(10)]
    assert np.abs(errors).max() < 5e-4


def test_trees_however_faint_are_no_sky():
    light = sky()
    light[:, :400] -= 1.0  # in dense fog
    assert airlight_beside(light, 180.0, NOISE, 300.0, 30.0) == pytest.approx(180.0, rel=5e-4)
    light[:, :400] -= 60.0 * (np.random.default_rng(1).random((60, 400)) < 0.8)  # in thin fog
    assert airlight_beside(light, 180.0, NOISE, 300.0, 30.0) == pytest.approx(180.0, rel=1e-3)


def test_branches_with_a_little_sky_between_them_everywhere():
    light = sky()
    light[np.random.default_rng(1).random(light.shape) < 0.8] -= 60.0
    assert airlight_beside(light, 180.0, NOISE, 300.0, 30.0) == pytest.approx(180.0, rel=1e-3)


def test_a_high_vehicle_before_the_axis_is_no_sky():
    light = sky()
    light[:, 270:330] += 5.0
    assert airlight_beside(light, 180.0, NOISE, 300.0, 30.0) == pytest.approx(180.0, rel=5e-4)


def test_nothing_of_that_light_leaves_what_it_was_thought_to_be():
    assert airlight_beside(sky(90.0), 180.0, NOISE, 300.0, 30.0) == 180.0
