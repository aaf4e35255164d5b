"""Lane lines of images whose lines are known."""

import math

import numpy as np
import pytest
from stripes import CENTRE, ROW, road_lines

from fogsim.vision.lines.edges import edge_map, smoothed
from fogsim.vision.lines.lane_lines import (
    LaneLine,
    hough_lines,
    lane_vanishing_point,
    published_vanishing_point,
    refined_lines,
)

FIRST = math.ceil(ROW) + 20


def edges_of(image):
    blurred = smoothed(image)
    return blurred, edge_map(blurred, np.zeros(len(image), np.float32)).pixels


def lines_of(image, most=8):
    blurred, edges = edges_of(image)
    return refined_lines(hough_lines(edges, FIRST, math.radians(25.0), most), edges, blurred, FIRST)


def line_through(column, row, slope, votes=100):
    return LaneLine(slope, column - slope * row, votes, row + 120.0, 500.0)


@pytest.mark.parametrize("lateral", [-1.9, -1.1, 1.2, 1.8])
def test_a_refined_line_is_the_edge_to_a_hundredth_of_its_slope(lateral):
    """Column − CENTRE = lateral / 1.4 · (row − ROW): the stripe's other edge is 1 m away."""
    image = road_lines((lateral, lateral + math.copysign(1.0, lateral)) if lateral > 0 else (lateral, lateral + 0.9))
    line = min(lines_of(image), key=lambda line: abs(line.slope - lateral / 1.4))
    assert line.slope == pytest.approx(lateral / 1.4, abs=0.01)
    assert line.column(200.0) == pytest.approx(CENTRE + lateral / 1.4 * (200.0 - ROW), abs=0.3)


def test_published_lines_are_right_within_their_cells():
    _, edges = edges_of(road_lines())
    lines = hough_lines(edges, FIRST, math.radians(10.0))
    assert sorted(math.copysign(1.0, line.slope) for line in lines) == [-1.0, 1.0]
    point = published_vanishing_point(lines)
    assert (point.column, point.row) == pytest.approx((CENTRE, ROW), abs=8.0)
    assert (point.lines, point.support) == (2, sum(line.votes for line in lines))


def test_refined_lines_meet_within_a_third_of_a_pixel():
    for seed in range(3):
        point = lane_vanishing_point(lines_of(road_lines(seed=seed)), (CENTRE + 3.0, ROW - 4.0), 8.0)
        assert (point.column, point.row) == pytest.approx((CENTRE, ROW), abs=0.33)
        assert point.row_deviation < 1.0
        assert point.lines >= 3


def test_lines_of_a_mirrored_image_are_mirrored():
    image = road_lines((-1.9, -1.75, 2.4, 2.6))
    lines, mirrored = lines_of(image), lines_of(np.ascontiguousarray(image[:, ::-1]))
    assert len(lines) == len(mirrored) >= 3
    other = sorted((-line.slope, 639.0 - line.offset) for line in mirrored)
    assert np.array(sorted((line.slope, line.offset) for line in lines)) == pytest.approx(np.array(other), abs=1e-3)


def test_exact_lines_meet_exactly_and_an_outlier_is_left_out():
    lines = [line_through(300.0, 50.0, slope) for slope in (-2.0, -0.7, 0.9, 2.5)]
    expected = (302.0, 52.0)
    point = lane_vanishing_point(lines, expected, 10.0)
    assert (point.column, point.row) == pytest.approx((300.0, 50.0), abs=1e-9)
    assert (point.lines, point.support) == (4, 400)
    astray = lane_vanishing_point([*lines, line_through(309.0, 50.0, 1.2)], expected, 10.0)
    assert (astray.column, astray.row, astray.lines) == pytest.approx((300.0, 50.0, 4), abs=1e-9)
    assert published_vanishing_point([lines[0], lines[3]]).row == pytest.approx(50.0, abs=1e-9)


@pytest.mark.parametrize("slopes", [(), (1.2,), (0.8, 1.1), (1.0, 1.0, 1.0)])
def test_too_few_lines_and_parallel_ones_have_no_point(slopes):
    lines = [line_through(300.0 + i, 50.0, slope) for i, slope in enumerate(slopes)]
    assert lane_vanishing_point(lines, (300.0, 50.0), 10.0) is None
    assert published_vanishing_point(lines) is None


def test_a_point_far_from_the_calibration_is_none():
    lines = [line_through(300.0, 50.0, slope) for slope in (-2.0, -0.7, 0.9, 2.5)]
    assert lane_vanishing_point(lines, (300.0, 63.0), 10.0) is None


def test_a_plain_image_has_no_lines():
    assert lines_of(np.full((300, 640), 90.0, np.float32)) == []
