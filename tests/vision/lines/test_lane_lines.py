"""Lane lines of images whose lines are known."""

import math

import numpy as np
import pytest
from stripes import CENTRE, ROW, road_lines

from fogsim.vision.lines.edges import edge_map, smoothed
from fogsim.vision.lines.vanishing_point import LaneLine, hough_lines, published_vanishing_point

FIRST = math.ceil(ROW) + 20


def lines_of(image):
    edges = edge_map(smoothed(image), np.zeros(len(image), np.float32)).pixels
    return hough_lines(edges, FIRST, math.radians(10.0))


def line_through(column, row, slope, votes=100):
    return LaneLine(slope, column - slope * row, votes)


def test_published_lines_are_right_within_their_cells():
    lines = lines_of(road_lines())
    assert sorted(math.copysign(1.0, line.slope) for line in lines) == [-1.0, 1.0]
    point = published_vanishing_point(lines, 0)
    assert (point.column, point.row) == pytest.approx((CENTRE, ROW), abs=8.0)
    assert (point.lines, point.support) == (2, sum(line.votes for line in lines))


def test_exact_lines_meet_exactly_in_rows_of_the_whole_image():
    lines = [line_through(300.0, 50.0, slope) for slope in (-2.0, 2.5)]
    point = published_vanishing_point(lines, 7)
    assert (point.column, point.row) == pytest.approx((300.0, 57.0), abs=1e-9)


@pytest.mark.parametrize("slopes", [(), (1.2,), (0.8, 1.1), (1.0, 1.0, 1.0)])
def test_too_few_lines_and_parallel_ones_have_no_point(slopes):
    lines = [line_through(300.0 + i, 50.0, slope) for i, slope in enumerate(slopes)]
    assert published_vanishing_point(lines, 0) is None


def test_a_plain_image_has_no_lines():
    assert lines_of(np.full((300, 640), 90.0, np.float32)) == []
