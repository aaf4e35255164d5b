from dataclasses import replace

import numpy as np
import pytest

from fogsim.values import Camera
from fogsim.vision.light.luminance import linear_pixels
from fogsim.vision.light.pixel_kernels import saturation
from fogsim.vision.strips.sky import (
    UNKNOWN_VIGNETTING,
    even_rows,
    level_at_horizon,
    pixel_noise,
    sky_above,
    sky_shading,
)

CAMERA = Camera(320, 240, 288.0, (159.5, 119.5), 1.38, np.radians(1.0))
ROWS, COLS = np.indices((240, 320))
AWAY = 1.0 - (1.0 + ((COLS - 159.5) ** 2 + (ROWS - 119.5) ** 2) / 288.0**2) ** -2


def photographed(sky, noise=1.0, seed=0):
    """A sky as luminances, and a dark road below the horizon."""
    light = np.where(CAMERA.horizon_row > ROWS, sky, 60.0)
    grey = np.rint(light + np.random.default_rng(seed).normal(0.0, noise, light.shape))
    return linear_pixels(np.clip(grey, 0, 255).astype(np.uint8), CAMERA)


def test_an_even_sky_is_as_bright_as_it_is_and_its_noise_that_of_the_pixels():
    sky = sky_above(photographed(np.full(ROWS.shape, 180.0), noise=2.0), CAMERA, 3.0)
    assert sky.luminance == pytest.approx(180.0, abs=3.0 * sky.deviation + 0.3)
    assert sky.deviation < 2.0
    assert sky.noise == pytest.approx(np.hypot(2.0, 1.0 / np.sqrt(12.0)), rel=0.1)
    assert (sky.saturated, sky.clipped, sky.is_clipped) == (0.0, 0.0, False)
    assert sky.vignetting == pytest.approx(0.0, abs=0.1)
    assert sky_above(photographed(np.full(ROWS.shape, 180.0), noise=2.0), CAMERA, 3.0).unevenness < 0.004
    clouds = 180.0 * (1.0 + 0.04 * np.sign(np.sin(COLS / 9.0) * np.sin(ROWS / 7.0)))
    seen = sky_above(photographed(clouds, noise=2.0), CAMERA, 3.0)
    assert seen.unevenness == pytest.approx(1.4826 * 0.04, rel=0.15)


def test_a_wood_or_a_hill_that_fills_the_view_is_no_sky():
    """In thin fog its leaves or stones still differ from pixel to pixel, more than a camera's noise does."""
    wood = 150.0 + np.random.default_rng(1).normal(0.0, 8.0, ROWS.shape)
    assert sky_above(photographed(wood), CAMERA, 3.0) is None
    assert sky_above(photographed(np.full(ROWS.shape, 150.0), noise=8.0), CAMERA, 3.0) is not None


@pytest.mark.parametrize("slope", [-0.3, 0.4])
def test_a_sky_that_brightens_upward_counts_as_it_is_at_the_horizon(slope):
    height = (CAMERA.horizon_row - ROWS) / CAMERA.focal_length
    sky = sky_above(photographed(150.0 * (1.0 + slope * height)), CAMERA, 3.0)
    assert sky.luminance == pytest.approx(150.0, abs=max(3.0 * sky.deviation, 1.5))


@pytest.mark.parametrize("vignetting", [0.0, 0.5, 1.0])
def test_the_lens_shows_in_the_corners_of_an_even_sky(vignetting):
    sky = sky_above(photographed(190.0 * (1.0 - vignetting * AWAY)), CAMERA, 3.0)
    assert sky.vignetting == pytest.approx(vignetting, abs=3.0 * sky.vignetting_deviation)
    assert sky.vignetting_deviation < UNKNOWN_VIGNETTING
    assert sky.luminance == pytest.approx(190.0, abs=3.0)


def test_a_wood_leaves_the_sky_above_it_and_between_its_trees_and_a_wall_none():
    tall = np.where(CAMERA.horizon_row - 0.06 * 288.0 < ROWS, 40.0, 180.0)
    sky = sky_above(photographed(tall), CAMERA, 3.0)
    assert sky.luminance == pytest.approx(180.0, abs=4.0)
    assert sky.deviation > sky_above(photographed(np.full(ROWS.shape, 180.0)), CAMERA, 3.0).deviation
    assert sky_above(photographed(np.where(CAMERA.horizon_row - 0.18 * 288.0 < ROWS, 40.0, 180.0)), CAMERA, 3.0) is None
    assert sky_above(photographed(np.full(ROWS.shape, 180.0)), replace(CAMERA, pitch=0.45), 3.0) is None
    trees = np.where(np.isin(COLS // 8 % 4, (0, 1, 2)), 30.0, 180.0)
    assert sky_above(photographed(trees), CAMERA, 3.0).luminance == pytest.approx(180.0, abs=3.0)


def test_what_darkens_toward_the_horizon_may_be_sky_or_hide_it():
    height = np.clip((CAMERA.horizon_row - ROWS) / CAMERA.focal_length, 0.0, None)
    falling = 180.0 * (1.0 - 0.3 * np.clip(1.0 - height / 0.14, 0.0, 1.0) ** 2)
    sky = sky_above(photographed(falling), CAMERA, 3.0)
    assert sky.luminance - 2.5 * sky.deviation < 0.7 * 180.0 < sky.luminance - sky.deviation
    assert sky.upward < 0.1 * sky.luminance
    behind_a_wood = sky_above(photographed(np.where(height < 0.06, 40.0, 180.0)), CAMERA, 3.0)
    assert behind_a_wood.deviation == pytest.approx(behind_a_wood.upward, rel=0.1)


def test_saturated_and_clipped_pixels_are_counted():
    image = np.full((240, 320, 3), 200, np.uint8)
    image[:60, :, 0] = 255
    image[:30] = 255
    paired = linear_pixels(image, CAMERA)
    assert saturation(paired, np.arange(120), 40) == (0.25, 0.5)
    assert pixel_noise(paired, np.arange(120)) == 0.0
    # Noise that comes after clipping leaves each channel saturated in most pixels.
    noise = np.random.default_rng(3).normal(0.0, 1.5, (240, 320, 3))
    noisy = np.clip(np.rint(255.0 + noise), 0, 255).astype(np.uint8)
    least, some = saturation(linear_pixels(noisy, CAMERA), np.arange(120), 40)
    assert 0.5 < least < 0.7 < some


def test_the_sun_is_not_the_sky_but_an_overexposed_sky_is():
    away = np.hypot(COLS - 159.5, ROWS - CAMERA.horizon_row + 36.0)
    sun = sky_above(photographed(140.0 + 3e4 / np.maximum(away, 1.0) ** 2 + 500.0 * (away < 20.0)), CAMERA, 3.0)
    assert (sun.has_sun, sun.is_clipped) == (True, False)
    assert sun.luminance == pytest.approx(150.0, abs=15.0)
    upward = (CAMERA.horizon_row - ROWS) / CAMERA.focal_length
    for overexposed in (250.0 * (1.0 + upward), 300.0 * (1.0 - upward), 320.0 * (1.0 - AWAY)):
        seen = sky_above(photographed(overexposed), CAMERA, 3.0)
        assert (seen.has_sun, seen.is_clipped) == (False, True)


def test_a_sky_of_even_slopes_behind_a_lens_is_found_with_its_covariance():
    rows = even_rows(100, 10, 16)
    axis = np.array([159.5, 119.5, CAMERA.horizon_row, 288.0])
    across, height = (COLS - 159.5) / 288.0, (CAMERA.horizon_row - ROWS) / 288.0
    truth, found = np.array([170.0, 12.0, 30.0, -70.0, 60.0]), []
    sky = truth[0] + truth[1] * across + (truth[2] + truth[3] * height) * height - truth[4] * AWAY
    for seed in range(12):
        image = photographed(sky, noise=1.5, seed=seed)
        fit, covariance, seen, _ = sky_shading(image, rows, axis, sky[rows].mean(axis=1), 1.5)
        assert seen > 0.95
        found.append(fit)
    spread = np.sqrt(np.diag(covariance))
    assert np.mean(found, axis=0) == pytest.approx(truth, abs=float(spread.max()))
    # Neighbouring pixels of a true sky err together, here they do not: twice as sure.
    assert (np.std(found, axis=0) < spread).all()
    assert (np.std(found, axis=0) > 0.2 * spread).all()


def test_the_level_at_the_horizon_is_that_of_a_straight_line_above_what_stands_there():
    height = np.linspace(0.2, 0.02, 24)
    level, slope, scatter, lowest = level_at_horizon(180.0 + 50.0 * height, height, 0.012)
    assert (level, slope) == pytest.approx((180.0, 50.0))
    assert scatter == pytest.approx(0.0, abs=1e-9)
    assert lowest == height[-1]
    bright = 180.0 + 50.0 * height
    bright[18:] = 90.0
    level, _, _, lowest = level_at_horizon(bright, height, 0.012)
    assert level == pytest.approx(180.0)
    assert lowest == height[17]
