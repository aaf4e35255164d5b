import math

import numpy as np
import pytest

from fogsim.values import Camera
from fogsim.vision.light.luminance import linear_pixels
from fogsim.vision.lines.road_line_kernels import FALLING, RIDGE, RISING, may_lie_on_road, row_points

STEP = 3


def edge(top, height, column, slope=0.0, noise=0.1, seed=0):
    """Points every third row of a straight edge."""
    rows = np.arange(top, top + height + 1, STEP, dtype=float)
    scatter = np.random.default_rng(seed).normal(0.0, noise, rows.size)
    return np.column_stack((column + slope * (rows - top) + scatter, rows))


def together(*edges):
    """All points by row, and of which edge each is."""
    place = np.concatenate(edges)
    which = np.repeat(np.arange(len(edges)), [len(one) for one in edges])
    order = np.argsort(place[:, 1], kind="stable")
    return place[order], which[order]


@pytest.mark.parametrize("slope", [-4.0, -1.3, -0.5, 0.5, 0.8, 2.0])
def test_sides_of_a_vehicle_are_told_from_lines_beside_it(slope):
    place, which = together(edge(160, 20, 360.0), edge(160, 200, 300.0, slope), edge(160, 20, 440.0))
    assert np.array_equal(may_lie_on_road(place, STEP), which == 1)


@pytest.mark.parametrize("missed", [1, 2])
def test_an_upright_edge_may_miss_rows(missed):
    whole = edge(160, 24, 360.0)
    place = np.delete(whole, np.s_[3 : 3 + missed], axis=0)
    assert not may_lie_on_road(place, STEP).any()


def test_what_is_too_short_may_lie():
    for points in range(3):
        assert may_lie_on_road(edge(160, 20, 360.0)[:points], STEP).tolist() == [True] * points


def points_of(row):
    """Points of an image whose rows are all alike: columns and kinds."""
    image = np.repeat(np.rint(row).astype(np.uint8)[None], 3, axis=0)
    camera = Camera(image.shape[1], 3, 100.0, (50.0, 1.0), 1.4)
    pixels = linear_pixels(image, camera)
    place, kind = row_points(pixels.pixels, pixels.tables, np.array([1]))
    assert (place[:, 1] == 1.0).all()
    return place[:, 0], kind


def blurred_step(at, columns=100):
    """Share of each pixel's light that comes from beyond an edge, blurred by a pixel."""
    return np.array([0.5 * math.erfc((at - column) / math.sqrt(2.0)) for column in range(columns)])


@pytest.mark.parametrize("at", [40.0, 40.25, 40.5, 40.8])
def test_an_edge_is_placed_within_a_twentieth_of_a_pixel(at):
    for kind, row in ((RISING, 60 + 140 * blurred_step(at)), (FALLING, 200 - 140 * blurred_step(at))):
        columns, kinds = points_of(row)
        assert columns == pytest.approx([at], abs=0.05)
        assert kinds.tolist() == [kind]


def test_a_narrow_stripe_is_one_point_a_wide_one_two_and_an_even_row_has_none():
    columns, kinds = points_of(60 + 140 * (blurred_step(40.0) - blurred_step(44.0)))
    assert columns == pytest.approx([42.0], abs=0.05)
    assert kinds.tolist() == [RIDGE]
    columns, kinds = points_of(60 + 140 * (blurred_step(40.0) - blurred_step(52.0)))
    assert columns == pytest.approx([40.0, 52.0], abs=0.05)
    assert kinds.tolist() == [RISING, FALLING]
    assert points_of(np.full(100, 90.0))[0].size == 0
