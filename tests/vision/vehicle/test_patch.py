"""Pictures made smaller, and the light that two pictures of one thing share."""

import math
from dataclasses import replace

import numpy as np
import pytest

from fogsim.vision.vehicle.contrast_ratio import mean_luminances
from fogsim.vision.vehicle.patch import (
    Patch,
    Placement,
    box_weights,
    correlations,
    downsample_to,
    match_cost,
    pixel_grid,
    rescale_position,
    shrink,
    vertex,
)

SKY = 200.0


def rear(rows: int = 40, cols: int = 48) -> np.ndarray:
    """A bright body with a dark window."""
    light = np.full((rows, cols), 130.0)
    light[6:18, 6:-6] = 20.0
    return light


def patch(luminance: np.ndarray) -> Patch:
    rows, cols = luminance.shape
    return Patch(luminance, 0.5 * (cols - 1), 0.5 * (rows - 1), 0.5 * cols - 2.0, 0.5 * rows - 2.0)


def fogged(luminance: np.ndarray, left: float) -> np.ndarray:
    return SKY - left * (SKY - luminance)


def fallen(near: np.ndarray, far: np.ndarray, noise: float = 0.5, exposure: float = 1.0) -> float:
    there = patch(exposure * far)
    light = mean_luminances(patch(near), there, Placement(there.column, there.row, 1.0), (SKY, exposure * SKY), noise)
    assert light is not None
    assert light.deviation > 0.0
    return (1.0 - light.far) / (1.0 - light.near)


@pytest.mark.parametrize("left", [0.9, 0.3, 0.05])
def test_contrast_to_the_sky_falls_by_one_factor_at_any_exposure(left):
    assert fallen(rear(), fogged(rear(), left)) == pytest.approx(left, rel=1e-6)
    assert fallen(rear(), fogged(rear(), left), exposure=0.5) == pytest.approx(left, rel=1e-6)


def test_lit_lamps_and_repainted_parts_do_not_count_and_paint_that_shines_differently_little():
    far = fogged(rear(), 0.5)
    far[22:26, 6:12] = far[22:26, -12:-6] = 250.0
    assert fallen(rear(), far) == pytest.approx(0.5, rel=0.005)
    near, far = rear(), rear()
    far[far > 100.0] *= 1.08
    # A plain mean would take the sheen for a fifth less contrast.
    assert (SKY - far).mean() / (SKY - near).mean() < 0.92
    assert fallen(near, fogged(far, 0.5)) == pytest.approx(0.5, rel=0.03)
    same = patch(np.full((40, 48), SKY))
    assert mean_luminances(same, same, Placement(same.column, same.row, 1.0), (SKY, SKY), 0.5) is None


def test_noise_does_not_bias_what_hardly_shows():
    rng = np.random.default_rng(0)
    found = [fallen(rear(), fogged(rear(), 0.02) + rng.normal(0.0, 4.0, (40, 48)), 4.0) for _ in range(200)]
    assert np.mean(found) == pytest.approx(0.02, abs=3.0 * np.std(found) / np.sqrt(200))


@pytest.mark.parametrize("scale", [0.9, 0.5, 0.31])
def test_a_smaller_picture_shows_the_same_at_the_same_place(scale):
    ramp = np.add.outer(2.0 * np.arange(80.0), 3.0 * np.arange(120.0))
    small = shrink(patch(ramp), scale)
    row, col = small.luminance.shape[0] // 2, small.luminance.shape[1] // 2
    rows, cols = small.luminance.shape
    there = rescale_position(row, 1.0 / scale, rows, 80), rescale_position(col, 1.0 / scale, cols, 120)
    assert small.luminance[row, col] == pytest.approx(2.0 * there[0] + 3.0 * there[1], abs=0.5)
    assert rescale_position(small.column, 1.0 / scale, small.luminance.shape[1], 120) == pytest.approx(59.5)
    assert small.half_width == pytest.approx(58.0 * scale)


@pytest.mark.parametrize("scale", [0.9, 0.5, 0.31])
def test_a_mirrored_picture_is_shrunk_to_the_mirror_image(scale):
    noisy = patch(np.random.default_rng(1).normal(100.0, 8.0, (40, 47)))
    small, other = shrink(noisy, scale), shrink(replace(noisy, luminance=noisy.luminance[:, ::-1], column=5.0), scale)
    np.testing.assert_allclose(other.luminance, small.luminance[:, ::-1], rtol=1e-12)
    there = shrink(replace(noisy, column=41.0), scale).column
    assert other.column == pytest.approx(small.luminance.shape[1] - 1 - there)


def test_shrinking_averages_noise_away_and_shares_nothing_beyond_the_border():
    noisy = patch(np.random.default_rng(0).normal(100.0, 8.0, (200, 240)))
    inner = shrink(noisy, 0.25).luminance[2:-2, 2:-2]
    assert inner.std() == pytest.approx(8.0 * 0.25, rel=0.1)
    assert shrink(noisy, 1.0) is noisy
    even = patch(np.full((40, 48), 70.0))
    grid = pixel_grid(even, even, Placement(23.5, 19.5, 0.6))
    assert downsample_to(even, grid, Placement(23.5, 19.5, 0.6)) == pytest.approx(70.0)
    weights = box_weights(10, 5.0, np.array([-20.0, 5.0, 40.0]), 5.0, 0.5)
    assert weights.sum(axis=1) == pytest.approx([0.0, 1.0, 0.0])


@pytest.mark.parametrize("scale", [1.0, 0.7, 0.3])
def test_boxes_share_the_near_pixels_out(scale):
    far = np.arange(3.0, 9.0)
    weights = box_weights(60, 29.4, far, 5.5, scale)
    half, middle, near = 0.5 * math.sqrt(max(scale**-2 - 1.0, 0.25)), 29.4 + (far[:, None] - 5.5) / scale, np.arange(60)
    overlap = np.minimum(middle + half, near + 0.5) - np.maximum(middle - half, near - 0.5)
    assert weights == pytest.approx(np.maximum(overlap, 0.0) / (2.0 * half), abs=1e-15)


RNG = np.random.default_rng(5)
IMAGE, TEMPLATE = RNG.normal(100.0, 20.0, (19, 23)), RNG.normal(50.0, 10.0, (6, 7))


def test_correlations_are_pearsons_and_nothing_looks_like_an_even_surface():
    found = correlations(IMAGE, TEMPLATE)
    assert found.shape == (14, 17)
    for row, col in ((0, 0), (5, 9), (13, 16)):
        part = IMAGE[row : row + 6, col : col + 7]
        assert found[row, col] == pytest.approx(np.corrcoef(part.ravel(), TEMPLATE.ravel())[0, 1], abs=1e-12)
    assert not correlations(np.full((9, 9), 80.0), TEMPLATE).any()
    assert not correlations(IMAGE, np.full((6, 7), 3.0)).any()


@pytest.mark.parametrize(("gain", "offset", "sign"), [(1.0, 0.0, 1.0), (0.1, 180.0, 1.0), (-0.5, 30.0, -1.0)])
def test_brightness_and_contrast_do_not_matter_but_their_sign_does(gain, offset, sign):
    image = np.full((12, 13), offset)
    image[3:9, 4:11] = gain * TEMPLATE + offset
    assert correlations(image, TEMPLATE)[3, 4] == pytest.approx(sign, abs=1e-12)


def test_of_two_places_that_look_alike_the_expected_one_is_taken():
    image = np.zeros((8, 30))
    image[1:7, 2:9] = image[1:7, 20:27] = TEMPLATE
    near_left, near_right = (np.abs(np.arange(24.0) - at)[None, :] * np.ones((3, 1)) * 1e-3 for at in (2, 20))
    assert match_cost(image, TEMPLATE, near_left)[2:] == (1, 2)
    assert match_cost(image, TEMPLATE, near_right)[2:] == (1, 20)
    prior = np.abs(np.arange(17.0) - 12.0)[None, :] + np.abs(np.arange(14.0) - 3.0)[:, None]
    assert match_cost(np.full_like(IMAGE, 7.0), TEMPLATE, prior)[2:] == (3, 12)


def test_vertex_of_a_parabola_and_none_at_the_border_or_on_a_line():
    for middle in (2.6, 3.0, 3.45):
        assert 3 + vertex(2.0 * (np.arange(7.0) - middle) ** 2 - 5.0, 3) == pytest.approx(middle)
    assert vertex(np.array([0.0, 1.0, 2.0]), 0) == 0.0
    assert vertex(np.array([2.0, 1.0, 0.0]), 2) == 0.0
    assert vertex(np.array([0.0, 1.0, 2.0]), 1) == 0.0
