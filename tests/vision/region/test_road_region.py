import numpy as np
import pytest

from fogsim.vision.lines.edges import edge_map, smoothed
from fogsim.vision.region.inflection import steepest_slope
from fogsim.vision.region.road_region import (
    Band,
    constant_limits,
    crossing_band,
    cumulative_limits,
    grow_region,
    region_medians,
)

EVEN = np.ones((50, 60), np.float32)
NARROW = np.ones((50, 20), np.float32)


def even(image):
    """Limits of 5 grey levels a row."""
    return cumulative_limits(np.full(image.shape[0], 5.0, np.float32), 5.0)


def test_region_fills_a_smooth_ramp_stops_at_a_step_and_begins_near_the_median_only():
    image = np.repeat(np.linspace(120, 60, 60, dtype=np.float32)[:, None], 40, axis=1)
    image[:10] += 50
    region = grow_region(image, np.zeros(image.shape, np.uint8), even(image))
    assert region[10:].all()
    assert not region[:10].any()
    image = np.full((20, 40), 80.0, np.float32)
    image[:, 30:] = 200.0
    region = grow_region(image, np.zeros(image.shape, np.uint8), even(image))
    assert region[:, :30].all()
    assert not region[:, 30:].any()


def test_region_does_not_enter_edges_and_goes_round_them():
    image, edges = np.full((40, 40), 80.0, np.float32), np.zeros((40, 40), np.uint8)
    edges[20, 10:20] = 255
    region = grow_region(image, edges, even(image))
    assert not region[20, 10:20].any()
    # Growth is one column a row at most: behind the edge a triangle stays dark.
    assert not region[19, 12:18].any()
    assert region[14, 14] == 1


def test_a_slope_joins_step_by_step_only_as_far_as_the_seed_allows():
    image = np.repeat(np.linspace(157, 60, 98, dtype=np.float32)[:, None], 40, axis=1)
    edges = np.zeros(image.shape, np.uint8)
    # A grey level a row, of which half a level a row is allowed: with 10 for the seed 20 rows join.
    region = grow_region(image, edges, constant_limits(98, 1.0, 0.5, 10.0))
    assert region.any(axis=1).sum() == 21
    assert not grow_region(image, edges, constant_limits(98, 0.9, 1.0, 10.0))[:-1].any()
    summed, constant = even(EVEN), constant_limits(50, 5.0, 5.0, 5.0)
    assert summed.from_seed.tolist() == constant.from_seed.tolist() == [250.0 - 5.0 * row for row in range(50)]
    assert summed.steps.tolist() == constant.steps.tolist()


def test_medians_are_those_of_the_regions_pixels():
    image = np.random.default_rng(1).uniform(0.0, 255.0, (5, 60)).astype(np.float32)
    region = np.zeros(image.shape, np.uint8)
    region[1, 10:13], region[2, 5:56:5], region[3], region[4, :2] = 1, 1, 1, 1
    found = region_medians(image, region)
    expected = [0.0, np.median(image[1, 10:13]), np.median(image[2, 5:56:5]), np.median(image[3]), 0.0]
    assert found.luminance == pytest.approx(expected)
    assert found.number.tolist() == [0, 3, 11, 60, 0]


def test_band_is_the_widest_that_reaches_the_top():
    region = np.zeros((50, 60), np.uint8)
    region[20:, 5:50] = 1
    region[3:, 8:14] = 1
    region[3:, 30:42] = 1
    assert crossing_band(region, EVEN, 29.5, min_width=3, max_width=60) == Band(30, 41, 3, 49)
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
    assert crossing_band(region, NARROW, 9.5, 3, 20, hole=2).top == 0
    assert crossing_band(region, NARROW, 9.5, 3, 20, hole=1).top == 32
    region[40:] = 0
    assert crossing_band(region, NARROW, 9.5, 3, 20) is None


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
