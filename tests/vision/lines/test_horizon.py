"""The horizon by the calibration, the mean of two, and level images."""

import math
from dataclasses import replace

import numpy as np
import pytest

from fogsim.values import Camera
from fogsim.vision.lines.horizon import Horizon, calibrated_horizon, levelled, weighted_mean

CAMERA = Camera(640, 480, 576.9, (320.0, 240.0), 1.38, 0.035)


def test_the_horizon_is_where_its_formula_says():
    """v_h = v0 − α tan θ (negru2013 eq. 6); its deviation is that of a small change of the pitch."""
    found = calibrated_horizon(CAMERA, 1e-5)
    assert found.row == pytest.approx(240.0 - 576.9 * math.tan(0.035))
    moved = calibrated_horizon(replace(CAMERA, pitch=0.035 + 1e-5))
    assert found.standard_deviation == pytest.approx(found.row - moved.row, rel=1e-4)


def test_a_mean_is_weighted_by_variances():
    found = weighted_mean(Horizon(100.0, 3.0), Horizon(110.0, 4.0))
    assert found.row == pytest.approx((100.0 / 9.0 + 110.0 / 16.0) / (1.0 / 9.0 + 1.0 / 16.0))
    assert found.standard_deviation == pytest.approx(math.sqrt(1.0 / (1.0 / 9.0 + 1.0 / 16.0)))


@pytest.mark.parametrize("roll", [0.05, -0.05])
def test_a_rolled_horizon_becomes_level(roll):
    """Positive roll turns the right side of the image down."""
    v, u = np.mgrid[:480, :640]
    sky = v - 240.0 < math.tan(roll) * (u - 320.0)
    image = np.where(sky, 200, 50).astype(np.uint8)
    assert levelled(image, CAMERA) is image
    level = levelled(image, replace(CAMERA, roll=roll))
    assert np.ptp((level[:, 100:540] > 125).sum(axis=0)) <= 1
