import numpy as np
import pytest

from fogsim.vision.region.profile import band_profile, decreasing, path_lengths
from fogsim.vision.region.road_region import Band


def test_distance_is_infinite_at_and_above_the_horizon():
    lengths = path_lengths(np.array([-3.0, 0.0, 10.0]), 1000.0, np.array([1.0, 1.0, 1.1]))
    assert lengths.tolist() == [np.inf, np.inf, 110.0]


def test_smoothing_never_rises_and_keeps_what_falls():
    noisy = 200 - np.arange(50.0) + np.random.default_rng(3).normal(0, 5, 50)
    smooth = decreasing(noisy)
    assert np.all(np.diff(smooth) <= 1e-9)
    falling = 200.0 - np.arange(50.0)
    assert decreasing(falling)[1:-1] == pytest.approx(falling[1:-1])


def test_profile_is_indifferent_to_narrow_marks():
    image = np.repeat(np.linspace(200, 60, 50, dtype=np.float32)[:, None], 90, axis=1)
    marked = image.copy()
    marked[:, 40:43] = 255
    assert band_profile(marked, Band(0, 89, 0, 49)) == pytest.approx(image[:, 0])


def test_isotonic_regression_pools_violators():
    # Least squares that never rises gives 5, 3.5, 3.5, 2, 2, 2; the binomial 1-2-1 rounds its steps.
    assert decreasing(np.array([5.0, 3.0, 4.0, 1.0, 2.0, 3.0])) == pytest.approx([4.625, 3.875, 3.125, 2.375, 2, 2])


def test_a_profile_has_the_mean_of_a_slope_across_whatever_the_bands_width():
    slope = np.arange(300.0, dtype=np.float32) + np.zeros((4, 1), np.float32)
    for width in (1, 2, 47, 48, 49, 200):
        middle = band_profile(slope, Band(10, 9 + width, 0, 3))
        assert middle == pytest.approx(np.full(4, 9.5 + 0.5 * width), abs=1.5)
