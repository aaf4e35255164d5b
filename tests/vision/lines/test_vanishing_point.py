"""Lines meet where geometry says, to the last digits; parallel ones do not."""

import math

import numpy as np
import pytest

from fogsim.vision.lines.vanishing_point import (
    Lines,
    VanishingPoint,
    all_pairs,
    crossings,
    nearest_point,
    residual_scale,
    sloped_lines,
    supports,
)

POINT = np.array([311.7, 58.2])


def lines_through(*angles, point=POINT):
    """Lines of unit normals through a point."""
    normal = np.array([(math.cos(angle), math.sin(angle)) for angle in angles])
    return Lines(normal, (normal * point).sum(axis=1))


def test_pairs_are_all_pairs_once():
    assert sorted(zip(*(part.tolist() for part in all_pairs(3)), strict=True)) == [(1, 0), (2, 0), (2, 1)]
    assert all_pairs(1)[0].size == all_pairs(0)[0].size == 0


def test_every_pair_crosses_in_the_common_point():
    found = crossings(lines_through(0.2, 0.9, -0.7, 1.4), *all_pairs(4), 0.1)
    assert found == pytest.approx(np.tile(POINT, (6, 1)), abs=1e-9)


def test_parallel_lines_do_not_cross():
    lines = sloped_lines([10.0, 30.0, 50.0], [0.5, 0.5, 0.9])
    found = crossings(lines, *all_pairs(3), 0.4)
    assert np.isnan(found[0]).all()
    assert found[1:] == pytest.approx(np.array([[-40.0, -100.0], [5.0, -50.0]]))
    assert supports(lines, np.ones(3), found, 1.0).tolist() == [0.0, 2.0, 2.0]


def test_sloped_lines_miss_a_point_by_columns():
    lines = sloped_lines([10.0, -20.0], [0.5, 2.0])
    assert lines.misses(np.array([100.0, 40.0])) == pytest.approx([70.0, 40.0])
    assert lines.misses(np.array([[100.0, 40.0], [30.0, 40.0]]))[1] == pytest.approx([0.0, -30.0])


def test_support_is_the_weight_of_the_lines_that_pass():
    lines = lines_through(0.2, 0.9, -0.7)
    beside = POINT + 3.0 * lines.normal[0] / np.linalg.norm(lines.normal[0])
    weight = np.array([1.0, 10.0, 100.0])
    points = np.array([POINT, beside, (np.nan, np.nan)])
    assert supports(lines, weight, points, 3.1).tolist() == [111.0, 111.0, 0.0]
    assert supports(lines, weight, points, 1e-9).tolist() == [111.0, 0.0, 0.0]


def test_least_squares_of_lines_that_meet_is_where_they_meet():
    weight = np.array([1.0, 3.0, 0.2])
    point, covariance = nearest_point(lines_through(0.2, 0.9, -0.7), weight)
    assert point == pytest.approx(POINT, abs=1e-9)
    assert covariance == pytest.approx(covariance.T)


def test_covariance_of_crossed_lines_is_their_variance():
    """An upright line places the column, a level one the row."""
    lines = lines_through(0.0, 0.5 * math.pi)
    point, covariance = nearest_point(lines, np.array([1 / 4.0, 1 / 9.0]))
    assert point == pytest.approx(POINT)
    assert covariance == pytest.approx(np.diag([4.0, 9.0]), abs=1e-9)


def test_deviation_of_the_point_is_that_of_many_trials():
    rng, angles = np.random.default_rng(1), (0.3, 0.8, -0.4, -1.0)
    exact = lines_through(*angles)
    weight = np.full(4, 1 / 0.5**2)
    found = np.array(
        [nearest_point(Lines(exact.normal, exact.offset + rng.normal(0, 0.5, 4)), weight)[0] for _ in range(4000)]
    )
    expected = nearest_point(exact, weight)[1]
    assert np.cov(found.T) == pytest.approx(expected, abs=0.1 * expected[1, 1])


def test_residuals_widen_a_deviation_and_never_narrow_it():
    assert residual_scale(np.array([0.1, -0.1, 0.0])) == 1.0
    assert residual_scale(np.array([3.0, 0.0, 0.0, 4.0])) == pytest.approx(math.sqrt(25.0 / 2.0))
    assert residual_scale(np.array([2.0, 2.0])) == pytest.approx(math.sqrt(8.0))


def test_its_horizon_is_its_row():
    horizon = VanishingPoint(320.0, 58.5, 0.3, 4, 200.0).horizon
    assert (horizon.row, horizon.standard_deviation) == (58.5, 0.3)
