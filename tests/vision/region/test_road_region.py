import numpy as np
import pytest

from fogsim.values import Camera
from fogsim.vision.lines.edges import edge_map, smoothed
from fogsim.vision.lines.horizon import calibrated_horizon, levelled
from fogsim.vision.region.inflection import steepest_slope
from fogsim.vision.region.profile import band_profile
from fogsim.vision.region.region_kernels import isotonic_decreasing
from fogsim.vision.region.road_region import Band, crossing_band, grow_region

CAMERA = Camera(640, 480, 577.0, (319.5, 239.5), 1.38, np.radians(2.0))
EVEN = np.ones((50, 60), np.float32)


def test_region_fills_a_smooth_ramp_and_stops_at_a_step():
    image = np.repeat(np.linspace(120, 60, 60, dtype=np.float32)[:, None], 40, axis=1)
    image[:10] += 50
    region = grow_region(image, np.zeros(image.shape, np.uint8), np.full(image.shape[0], 5.0, np.float32), 5.0)
    assert region[10:].all()
    assert not region[:10].any()


def test_region_does_not_enter_edges_and_goes_round_them():
    image, edges = np.full((40, 40), 80.0, np.float32), np.zeros((40, 40), np.uint8)
    edges[20, 10:20] = 255
    region = grow_region(image, edges, np.full(image.shape[0], 5.0, np.float32), 5.0)
    assert not region[20, 10:20].any()
    # Growth is one column a row at most: behind the edge a triangle stays dark.
    assert not region[19, 12:18].any()
    assert region[14, 14] == 1


def test_seeds_are_near_the_median_only():
    image = np.full((20, 40), 80.0, np.float32)
    image[:, 30:] = 200.0
    region = grow_region(image, np.zeros(image.shape, np.uint8), np.full(image.shape[0], 5.0, np.float32), 5.0)
    assert region[:, :30].all()
    assert not region[:, 30:].any()


def test_band_is_the_widest_that_reaches_the_top():
    region = np.zeros((50, 60), np.uint8)
    region[20:, 5:50] = 1
    region[3:, 8:14] = 1
    region[3:, 30:42] = 1
    assert crossing_band(region, EVEN, 29.5, min_width=3, max_width=60) == Band(30, 41, 3, 49)


def test_of_wide_bands_the_one_near_the_centre_is_cut_out():
    region = np.ones((50, 60), np.uint8)
    region[:, 20:24] = 0
    assert crossing_band(region, EVEN, 29.5, min_width=3, max_width=10) == Band(25, 34, 0, 49)


def test_of_two_bands_alike_but_for_their_side_the_darker_is_taken():
    region, luminance = np.ones((50, 60), np.uint8), EVEN.copy()
    region[:, 25:35] = 0
    luminance[:, 40] = 2.0
    left, right = Band(15, 24, 0, 49), Band(35, 44, 0, 49)
    assert crossing_band(region, luminance, 29.5, min_width=3, max_width=10) == left
    assert crossing_band(region, np.ascontiguousarray(luminance[:, ::-1]), 29.5, min_width=3, max_width=10) == right


def test_short_gaps_are_stepped_over_and_long_ones_end_the_band():
    region = np.ones((50, 20), np.uint8)
    region[30:32] = 0
    assert crossing_band(region, EVEN[:, :20], 9.5, 3, 20, hole=2).top == 0
    assert crossing_band(region, EVEN[:, :20], 9.5, 3, 20, hole=1).top == 32


def test_no_band_without_a_bottom():
    region = np.ones((50, 20), np.uint8)
    region[40:] = 0
    assert crossing_band(region, EVEN[:, :20], 9.5, 3, 20) is None


def test_profile_is_indifferent_to_narrow_marks():
    image = np.repeat(np.linspace(200, 60, 50, dtype=np.float32)[:, None], 90, axis=1)
    marked = image.copy()
    marked[:, 40:43] = 255
    assert band_profile(marked, Band(0, 89, 0, 49)) == pytest.approx(image[:, 0])


def test_isotonic_regression_pools_violators():
    assert isotonic_decreasing(np.array([5.0, 3.0, 4.0, 1.0, 2.0, 3.0])) == pytest.approx([5, 3.5, 3.5, 2, 2, 2])


def test_fog_draws_no_edges_but_a_mark_does():
    rows = np.arange(200, dtype=float) - 20
    transmission = np.exp(-8.0 / np.where(rows > 0, rows, np.inf), where=rows > 0, out=np.zeros(200))
    image = np.repeat((200 - 140 * transmission).astype(np.float32)[:, None], 100, axis=1)
    image += np.random.default_rng(4).normal(0, 1, image.shape).astype(np.float32)
    slope = steepest_slope(rows, 200.0).astype(np.float32)
    assert not edge_map(smoothed(image), slope).pixels[2:-2, 2:-2].any()
    assert edge_map(smoothed(image), np.zeros(200, np.float32)).pixels[20:30].any()
    image[60:, 48:52] += 60
    edges = edge_map(smoothed(image), slope).pixels > 0
    assert edges[70:190, 46:54].any(axis=1).all()


def test_horizon_is_that_of_the_calibration():
    horizon = calibrated_horizon(CAMERA, np.radians(0.1))
    assert horizon.row == pytest.approx(239.5 - 577 * np.tan(np.radians(2.0)))
    below = Camera(640, 480, 577.0, (319.5, 239.5), 1.38, np.radians(2.1))
    assert horizon.standard_deviation == pytest.approx(horizon.row - below.horizon_row, rel=0.01)


def test_levelling_undoes_a_roll():
    rolled = Camera(640, 480, 577.0, (319.5, 239.5), 1.38, 0.0, roll=np.radians(4.0))
    rows, cols = np.mgrid[:480, :640]
    # Positive roll turns the right side down, so the sky's edge falls to the right.
    image = np.where(rows - 239.5 < np.tan(rolled.roll) * (cols - 319.5), 200, 50).astype(np.uint8)
    level = levelled(image, rolled)
    assert np.all(level[:238, 30:610] == 200)
    assert np.all(level[242:, 30:610] == 50)
