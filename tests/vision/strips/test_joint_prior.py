from dataclasses import replace

import numpy as np
import pytest

from fogsim.values import Camera
from fogsim.vision.lines.horizon import calibrated_horizon
from fogsim.vision.strips.airlight_slopes import MOST_CLOUD, OVEREXPOSURE, SKY_DEVIATION, joint_prior
from fogsim.vision.strips.sky import Sky

CAMERA = Camera(640, 480, 577.0, (319.5, 239.5), 1.38, np.radians(2.0))
HORIZON = calibrated_horizon(CAMERA, np.radians(0.1))
SKY = Sky(200.0, 1.5, 3.0, 1.0, 0.0, 0.0, 0.4, 0.05)


def clipped(saturated, share=0.5, luminance=254.0):
    return joint_prior(SKY._replace(luminance=luminance, saturated=saturated, clipped=share), CAMERA, HORIZON)


def test_an_open_sky_is_the_airlight_within_its_deviation():
    prior = joint_prior(SKY, CAMERA, HORIZON)
    assert prior.airlight == SKY.luminance
    assert prior.below == pytest.approx(np.hypot(SKY_DEVIATION * 200.0, 1.5))
    assert prior.above == pytest.approx(np.hypot(SKY_DEVIATION * 200.0, 3.0))
    assert (prior.shift, prior.shift_deviation) == (0.0, HORIZON.standard_deviation)
    assert (prior.vignetting, prior.vignetting_deviation) == (0.4, 0.05)


def test_airlight_is_as_uneven_as_a_sky_that_trees_and_rounding_do_not_explain():
    cloud = [joint_prior(SKY._replace(unevenness=uneven), CAMERA, HORIZON).cloud for uneven in (0.0, 0.015, 0.025, 0.5)]
    assert cloud[:2] == [0.0, 0.0]
    assert 0.0 < cloud[2] < cloud[3] == MOST_CLOUD


def test_a_horizon_that_was_seen_lower_is_a_shift():
    seen = replace(HORIZON, row=HORIZON.row + 1.7)
    assert joint_prior(SKY, CAMERA, seen).shift == pytest.approx(1.7)


def test_of_a_clipped_sky_half_of_whose_pixels_are_saturated_the_mean_is_half_a_level_below_the_end():
    assert clipped(0.5).airlight == pytest.approx(254.5)
    brightness = [clipped(share).airlight for share in (0.1, 0.3, 0.5, 0.9, 0.97)]
    assert brightness == sorted(brightness)


def test_a_wholly_saturated_sky_may_be_much_brighter_and_hardly_darker():
    prior = clipped(1.0)
    assert prior.airlight >= 255.0
    assert prior.above == pytest.approx(OVEREXPOSURE * 255.0)
    assert prior.below < 3.0
    # Where but one colour is clipped, the others still show how bright it is.
    assert clipped(0.0).above < 0.5 * prior.above
