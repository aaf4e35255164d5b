import numpy as np
import pytest

from fogsim.vision.vehicle.contrast_ratio import RearPicture, box_means, contrast_ratio
from fogsim.vision.vehicle.registration import RoadBehind, register_rear

CELLS = np.random.default_rng(3).uniform(0.4, 0.9, (12, 12))


def picture(scale, faded=1.0, column=40.2, row=60.7, noise=0.002, seed=0, lamp=False):
    """A rear of 1.8 × 1.4 m of random tiles at a number of pixels in a metre, by 8 × 8 samples a pixel."""
    size = (int(80 * scale / 20), int(80 * scale / 20))
    at = (np.arange(8) + 0.5) / 8 - 0.5
    v, u = ((np.arange(n)[:, None] + at).ravel() for n in size)
    column, row = column * scale / 20, row * scale / 20
    x, z = np.meshgrid((u - column) / scale, (row - v) / scale)
    inside = (np.abs(x) < 0.9) & (z > 0) & (z < 1.4)
    tiles = CELLS[np.clip(12 * z / 1.4, 0, 11).astype(int), np.clip(12 * (x / 1.8 + 0.5), 0, 11).astype(int)]
    contrast = np.where(inside, faded * tiles, 0.0)
    if lamp:
        contrast = np.where((np.abs(np.abs(x) - 0.6) < 0.12) & (np.abs(z - 0.8) < 0.1), -2.0, contrast)
    contrast = contrast.reshape(size[0], 8, size[1], 8).mean(axis=(1, 3))
    contrast += np.random.default_rng(seed).normal(0.0, noise, contrast.shape)
    return RearPicture(contrast, noise, column, row, scale, 1.8)


@pytest.mark.parametrize(("scale", "faded"), [(25.0, 0.1), (14.0, 0.4), (8.0, 1.0), (8.0, 0.1)])
def test_the_ratio_of_contrasts_is_found_at_any_size(scale, faded):
    fading = contrast_ratio(picture(28.0), picture(scale, faded, seed=1))
    assert fading.ratio == pytest.approx(faded, rel=0.02, abs=3 * fading.deviation)
    assert fading.kept > 0.9


def test_a_smaller_reference_serves_as_well_and_lit_lamps_are_left_out():
    fading = contrast_ratio(picture(10.0, 0.5), picture(28.0, 1.0, seed=1))
    assert fading.ratio == pytest.approx(2.0, rel=0.03)
    fading = contrast_ratio(picture(28.0), picture(16.0, 0.5, seed=1, lamp=True))
    assert fading.ratio == pytest.approx(0.5, rel=0.04)
    assert fading.kept < 1.0
    assert contrast_ratio(picture(28.0, faded=0.0), picture(14.0)) is None


@pytest.mark.parametrize(("right", "up"), [(0.0, 0.0), (0.21, -0.06), (-0.37, 0.1)])
def test_the_place_is_found_to_a_fraction_of_a_pixel(right, up):
    reference, far = picture(28.0), picture(12.0, 0.3, seed=2)
    found, likeness = register_rear(reference, far.displaced(right, up), 0.25, 0.08, RoadBehind(1.3, 0.3))
    assert found.column == pytest.approx(far.column, abs=0.25)
    assert found.foot == pytest.approx(far.foot, abs=0.3)
    assert likeness > 0.9


def test_another_thing_does_not_look_alike():
    other = picture(12.0, 0.5)
    other = RearPicture(other.contrast[::-1, ::-1].T.copy(), other.noise, other.column, other.foot, 12.0, 1.8)
    _, likeness = register_rear(picture(28.0), other, 0.25, 0.08, RoadBehind(1.3, 0.5))
    assert likeness < 0.8


PICTURE = np.random.default_rng(5).uniform(0.0, 1.0, (30, 40))


def test_boxes_are_plain_means_and_share_pixels_by_area():
    means, noise = box_means(PICTURE, np.array([7.0, 12.0]), np.array([10.0, 21.0, 30.0]), 3.0)
    assert means[1, 0] == pytest.approx(PICTURE[11:14, 9:12].mean())
    assert means[0, 2] == pytest.approx(PICTURE[6:9, 29:32].mean())
    assert noise == pytest.approx(1.0 / 9.0)
    means, noise = box_means(PICTURE, np.array([7.25]), np.array([10.0]), 1.0)
    assert means[0, 0] == pytest.approx(0.75 * PICTURE[7, 10] + 0.25 * PICTURE[8, 10])
    assert noise == pytest.approx(0.75**2 + 0.25**2)
    slope = np.arange(30.0)[:, None] + 2.0 * np.arange(40.0)
    means, _ = box_means(slope, np.array([11.0]), np.array([17.0]), 4.6)
    assert means[0, 0] == pytest.approx(11.0 + 2.0 * 17.0)
    means, _ = box_means(np.full((30, 40), 0.7), np.array([-0.5, 29.4]), np.array([-1.0, 40.0]), 4.0)
    assert means == pytest.approx(np.full((2, 2), 0.7))
    outside, noise = box_means(PICTURE, np.array([-9.0, 50.0]), np.array([-9.0, 60.0]), 4.0)
    assert not outside.any()
    assert noise == 0.0
