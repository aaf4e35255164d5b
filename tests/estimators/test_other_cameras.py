"""Cameras and light that the calibration does not describe: film curves, tone mapping, clipped and convex skies."""

import numpy as np
import pytest
from other_cameras import CAMERA, KINDS, draw, views

from fogsim.estimators import make
from fogsim.values import Observation

SOLVED = sorted(set(KINDS) - {"clahe", "wet", "dirt", "wall"})
"""Kinds that are always read, with intervals that hold."""


def estimate(image):
    return make("joint_road", CAMERA).update(Observation(image))


@pytest.mark.parametrize("kind", SOLVED)
def test_intervals_hold_under_other_cameras_and_light(kind):
    for seed, visibility in enumerate((60.0, 120.0, 250.0)):
        found = estimate(draw(kind, visibility, seed))
        assert found.valid, found.diagnostics["reason"]
        low, high = found.visibility_interval
        assert low <= visibility <= high
        assert high < 15.0 * low


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_clear_air_has_no_bounded_answer(kind):
    found = estimate(draw(kind, 1e9, 1))
    assert not found.valid or found.visibility_interval[0] > 1000.0


@pytest.mark.parametrize("kind", ["convex sky 1", "convex sky 2", "convex sky 3"])
def test_skies_that_darken_faster_and_faster_toward_the_horizon_are_skies(kind):
    found = [estimate(draw(kind, 150.0, seed)) for seed in range(2)]
    assert all(one.valid for one in found)
    assert np.array([one.visibility for one in found]) == pytest.approx(150.0, rel=0.1)


def test_a_wet_road_is_none_of_dense_fog():
    for visibility in (120.0, 250.0):
        found = estimate(draw("wet", visibility, 0))
        assert not found.valid
        assert "wet" in str(found.diagnostics["reason"])


def test_a_wall_across_the_road_is_not_taken_for_the_sky():
    reasons = [estimate(draw("wall", 250.0, seed)).diagnostics.get("reason", "") for seed in range(3)]
    assert all("something across the way" in str(reason) for reason in reasons), reasons
    # Hardly seen in fog this dense, it is none.
    assert all(estimate(draw("wall", 60.0, seed)).valid for seed in range(3))


@pytest.mark.parametrize("view", ["arch", "bonnet", "tower", "trees", "wall"])
def test_views_that_are_no_lane_have_no_bounded_answer(view):
    for seed in range(2):
        found = estimate(views(view, seed))
        assert not found.valid or found.visibility_interval[1] > 1000.0, found.visibility


def test_why_there_is_no_answer_is_true():
    dark = (draw("plain", 120.0, 0) * 0.02).astype(np.uint8)
    assert "dark" in str(estimate(dark).diagnostics["reason"])
    assert "sky" in str(estimate(views("trees", 0)).diagnostics["reason"])
