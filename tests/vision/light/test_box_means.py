import numpy as np
import pytest

from fogsim.vision.vehicle.contrast_ratio import box_means

PICTURE = np.random.default_rng(5).uniform(0.0, 1.0, (30, 40))


def test_boxes_of_whole_pixels_are_plain_means():
    means, noise = box_means(PICTURE, np.array([7.0, 12.0]), np.array([10.0, 21.0, 30.0]), 3.0)
    assert means[1, 0] == pytest.approx(PICTURE[11:14, 9:12].mean())
    assert means[0, 2] == pytest.approx(PICTURE[6:9, 29:32].mean())
    assert noise == pytest.approx(1.0 / 9.0)


def test_a_box_between_pixels_shares_them_by_area():
    means, noise = box_means(PICTURE, np.array([7.25]), np.array([10.0]), 1.0)
    assert means[0, 0] == pytest.approx(0.75 * PICTURE[7, 10] + 0.25 * PICTURE[8, 10])
    assert noise == pytest.approx(0.75**2 + 0.25**2)


def test_a_slope_is_seen_at_the_middle_of_a_box_of_any_width():
    slope = np.arange(30.0)[:, None] + 2.0 * np.arange(40.0)
    means, _ = box_means(slope, np.array([11.0]), np.array([17.0]), 4.6)
    assert means[0, 0] == pytest.approx(11.0 + 2.0 * 17.0)


def test_the_border_is_not_shared_with_what_is_beyond():
    means, _ = box_means(np.full((30, 40), 0.7), np.array([-0.5, 29.4]), np.array([-1.0, 40.0]), 4.0)
    assert means == pytest.approx(np.full((2, 2), 0.7))
    outside, noise = box_means(PICTURE, np.array([-9.0, 50.0]), np.array([-9.0, 60.0]), 4.0)
    assert not outside.any()
    assert noise == 0.0
