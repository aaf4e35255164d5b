"""Lines meet where geometry says, to the last digits; parallel ones do not."""

import math

import numpy as np
import pytest
from stripes import CENTRE, ROW, road_lines

from fogsim.values import Camera
from fogsim.vision.light.luminance import linear_pixels
from fogsim.vision.lines import vanishing_point
from fogsim.vision.lines.edges import CannyDeriche, edge_map, smoothed
from fogsim.vision.lines.horizon import Horizon
from fogsim.vision.lines.road_lines import road_vanishing_point

POINT = np.array([311.7, 58.2])


def lines_through(*angles, point=POINT):
    """vanishing_point.Lines of unit normals through a point."""
    normal = np.array([(math.cos(angle), math.sin(angle)) for angle in angles])
    return vanishing_point.Lines(normal, (normal * point).sum(axis=1))


def test_every_pair_crosses_in_the_common_point():
    found = vanishing_point.crossings(lines_through(0.2, 0.9, -0.7, 1.4), *vanishing_point.all_pairs(4), 0.1)
    assert found == pytest.approx(np.tile(POINT, (6, 1)), abs=1e-9)
    assert sorted(zip(*(part.tolist() for part in vanishing_point.all_pairs(3)), strict=True)) == [
        (1, 0),
        (2, 0),
        (2, 1),
    ]
    assert vanishing_point.all_pairs(1)[0].size == vanishing_point.all_pairs(0)[0].size == 0


def test_parallel_lines_do_not_cross():
    lines = vanishing_point.sloped_lines([10.0, 30.0, 50.0], [0.5, 0.5, 0.9])
    found = vanishing_point.crossings(lines, *vanishing_point.all_pairs(3), 0.4)
    assert np.isnan(found[0]).all()
    assert found[1:] == pytest.approx(np.array([[-40.0, -100.0], [5.0, -50.0]]))
    assert vanishing_point.supports(lines, np.ones(3), found, 1.0).tolist() == [0.0, 2.0, 2.0]
    lines = vanishing_point.sloped_lines([10.0, -20.0], [0.5, 2.0])
    assert lines.misses(np.array([100.0, 40.0])) == pytest.approx([70.0, 40.0])
    assert lines.misses(np.array([[100.0, 40.0], [30.0, 40.0]]))[1] == pytest.approx([0.0, -30.0])


def test_support_is_the_weight_of_the_lines_that_pass():
    lines = lines_through(0.2, 0.9, -0.7)
    beside = POINT + 3.0 * lines.normal[0] / np.linalg.norm(lines.normal[0])
    weight = np.array([1.0, 10.0, 100.0])
    points = np.array([POINT, beside, (np.nan, np.nan)])
    assert vanishing_point.supports(lines, weight, points, 3.1).tolist() == [111.0, 111.0, 0.0]
    assert vanishing_point.supports(lines, weight, points, 1e-9).tolist() == [111.0, 0.0, 0.0]


def test_least_squares_of_lines_that_meet_is_where_they_meet():
    weight = np.array([1.0, 3.0, 0.2])
    lines = lines_through(0.2, 0.9, -0.7)
    point, covariance = vanishing_point.nearest_point(lines, weight)
    assert point == pytest.approx(POINT, abs=1e-9)
    assert covariance == pytest.approx(np.linalg.inv(lines.normal.T @ (weight[:, None] * lines.normal)))
    # An upright line places the column, a level one the row.
    lines = lines_through(0.0, 0.5 * math.pi)
    point, covariance = vanishing_point.nearest_point(lines, np.array([1 / 4.0, 1 / 9.0]))
    assert point == pytest.approx(POINT)
    assert covariance == pytest.approx(np.diag([4.0, 9.0]), abs=1e-9)
    assert vanishing_point.residual_scale(np.array([0.1, -0.1, 0.0])) == 1.0
    assert vanishing_point.residual_scale(np.array([3.0, 0.0, 0.0, 4.0])) == pytest.approx(math.sqrt(25.0 / 2.0))
    assert vanishing_point.residual_scale(np.array([2.0, 2.0])) == pytest.approx(math.sqrt(8.0))


FIRST = math.ceil(ROW) + 20


def lines_of(image):
    edges = edge_map(smoothed(image), np.zeros(len(image), np.float32)).pixels
    return vanishing_point.hough_lines(edges, FIRST, math.radians(10.0))


def line_through(column, row, slope, votes=100):
    return vanishing_point.LaneLine(slope, column - slope * row, votes)


def test_published_lines_are_right_within_their_cells():
    assert lines_of(np.full((300, 640), 90.0, np.float32)) == []
    lines = lines_of(road_lines())
    assert sorted(math.copysign(1.0, line.slope) for line in lines) == [-1.0, 1.0]
    point = vanishing_point.published_vanishing_point(lines, 0)
    assert (point.column, point.row) == pytest.approx((CENTRE, ROW), abs=8.0)
    assert (point.lines, point.support) == (2, sum(line.votes for line in lines))


def test_exact_lines_meet_exactly_in_rows_of_the_whole_image():
    lines = [line_through(300.0, 50.0, slope) for slope in (-2.0, 2.5)]
    point = vanishing_point.published_vanishing_point(lines, 7)
    assert (point.column, point.row) == pytest.approx((300.0, 57.0), abs=1e-9)
    # Too few lines and parallel ones have no point.
    for slopes in ((), (1.2,), (0.8, 1.1), (1.0, 1.0, 1.0)):
        lines = [line_through(300.0 + i, 50.0, slope) for i, slope in enumerate(slopes)]
        assert vanishing_point.published_vanishing_point(lines, 0) is None


def found(image, guess=(325.0, 64.0)):
    edges = CannyDeriche()(image, None)
    return vanishing_point.consensus_vanishing_point(edges.gradient, edges.pixels, guess, 40.0)


def test_the_published_recipe_is_right_within_its_cells_and_coarser_than_the_roads_own_lines():
    """Cells of 1° and 2 px: several pixels."""
    camera, horizon, errors = Camera(640, 300, 600.0, (325.0, 64.0), 1.4), Horizon(64.0, 1.5), []
    for seed in range(6):
        image = road_lines(seed=seed)
        point = found(image)
        assert abs(point.column - CENTRE) < 15.0
        assert point.lines >= 2
        assert point.row_deviation >= 1.0
        assert point.support >= 60
        pixels = linear_pixels(np.clip(np.rint(image), 0, 255).astype(np.uint8), camera)
        errors.append((abs(road_vanishing_point(pixels, camera, horizon).row - ROW), abs(point.row - ROW)))
    ours, published = np.mean(errors, axis=0)
    assert ours < published
    assert np.max(errors) < 15.0


def test_fewer_than_two_lines_and_parallel_ones_have_none():
    for few in (np.full((300, 640), 90.0, np.float32), road_lines((1.75, 2.9))[:, :330]):
        assert found(np.ascontiguousarray(few)) is None
    image = np.full((300, 640), 60.0, np.float32)
    for left in (200, 300, 400):
        image[:, left : left + 20] = 120.0
    guess = (310.0, 20.0)
    edges = CannyDeriche()(image, None)
    points = vanishing_point.edge_points(edges.gradient.across, edges.gradient.down, edges.pixels, *guess)
    assert vanishing_point.hough_peaks(points, 150.0, 6, 30)[0][:, 0] % math.pi == pytest.approx([0.0] * 6, abs=1e-9)
    assert vanishing_point.consensus_vanishing_point(edges.gradient, edges.pixels, guess, 150.0) is None


@pytest.mark.parametrize("slope", [-0.8, 0.0, 0.5])
def test_an_edge_is_a_line_with_the_direction_of_its_gradient(slope):
    """cos θ (u − slope · v) = ρ with tan θ = −slope."""
    v, u = np.mgrid[:200, :200]
    image = np.clip(60.0 + 60.0 * (u - 100.3 - slope * (v - 100)), 60.0, 120.0).astype(np.float32)
    edges = CannyDeriche()(image, None)
    points = vanishing_point.edge_points(edges.gradient.across, edges.gradient.down, edges.pixels, 100.0, 0.0)
    assert np.median(points[:, 0] - slope * (points[:, 1] - 100.0)) == pytest.approx(0.8, abs=0.1)
    assert np.median(points[:, 2]) == pytest.approx(math.atan(-slope), abs=0.02)
    lines, votes = vanishing_point.hough_peaks(points, 120.0, 1, 30)
    angle, offset = lines[0]
    assert math.remainder(angle - math.atan(-slope), 2.0 * math.pi) == pytest.approx(0.0, abs=math.radians(1.5))
    assert offset == pytest.approx(math.cos(angle) * (0.8 - 100.0 * slope), abs=3.0)
    assert 30 <= votes[0] <= len(points)
