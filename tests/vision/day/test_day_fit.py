"""The day model's posterior on images that nothing explains."""

import math

import numpy as np
import pytest

from fogsim.values import Camera
from fogsim.vision.day.day_fit import fit_day
from fogsim.vision.lines.horizon import Horizon, calibrated_horizon, levelled


def test_a_response_that_explains_nothing_leaves_probabilities():
    rows = np.arange(48)[:, None] / 47.0
    light = np.where(rows < 0.45, 0.7, 0.7 - 0.5 * np.exp(-0.08 / np.maximum(rows - 0.45, 1e-3)))
    image = np.rint(4095.0 * np.repeat(light, 64, axis=1)).astype(np.uint16)
    camera = Camera(64, 48, 8.1, (32.0, 21.6), 1.4, roll=0.28, response="srgb", bits=12, black_level=0.25)
    fit = fit_day(levelled(image, camera), camera, calibrated_horizon(camera))
    assert fit.responses[0] == 0.0
    assert fit.surfaces.sum() == pytest.approx(1.0)


def test_an_image_that_is_black_but_for_little_sky_is_dark():
    image = np.zeros((96, 128), np.uint8)
    image[:3] = 200
    fit = fit_day(image, Camera(128, 96, 110.0, (63.5, 47.5), 1.35), Horizon(47.5, 0.2))
    assert math.isfinite(fit.contrast)
    assert 0.0 < fit.brightest < 0.01
