"""What lines tell of sags and crests farther on."""

import numpy as np
import pytest

from fogsim.vision.lines import road_course
from fogsim.vision.lines.road_course_kernels import KNOTS, PIECES


def cost(ahead: road_course.SagsAhead, sag: np.ndarray) -> float:
    return road_course.cost_given(ahead, sag, road_course.sag_precision())


def test_curvatures_of_neighbouring_pieces_are_alike_and_beginnings_rare():
    covariance = road_course.sag_covariance()
    assert np.diag(covariance) == pytest.approx(road_course.SAG_DEVIATION**2)
    assert covariance[0, 1] == pytest.approx(road_course.SAG_DEVIATION**2 * np.exp(-KNOTS[1] / road_course.SAG_LENGTH))
    assert road_course.beginning_cost(0.0) == pytest.approx(-2.0 * np.log(road_course.BEGINS))
    steep = road_course.beginning_cost(2.0 * road_course.SAG_DEVIATION)
    assert steep - road_course.beginning_cost(0.0) == pytest.approx(4.0)


def test_without_lines_every_sag_is_as_likely_by_them_and_the_row_stays():
    ahead = road_course.unseen_sags(220.0, 0.3)
    for piece in range(PIECES):
        sag = road_course.sag_from(piece, 1e-4)
        assert cost(ahead, sag) == pytest.approx(0.0, abs=1e-9)
        assert road_course.row_given(ahead, sag) == pytest.approx((220.0, 0.09))


def test_lines_make_the_curvature_that_they_show_likeliest_and_move_the_row_with_it():
    # Bayes' rule for one linear reading of row and curvature, y = row + 5000 sag_0 + noise of 0.1 px.
    prior = np.zeros((1 + PIECES, 1 + PIECES))
    prior[0, 0], prior[1:, 1:] = 0.09, road_course.sag_covariance()
    reading, seen = np.array([1.0, 5000.0, *np.zeros(PIECES - 1)]), 0.5
    gain = prior @ reading / (reading @ prior @ reading + 0.01)
    ahead = road_course.SagsAhead(gain * seen, prior - np.outer(gain, reading @ prior))

    def log_likelihood(curvature: float) -> float:
        return -0.5 * (seen - 5000.0 * curvature) ** 2 / (0.09 + 0.01)

    for curvature in (-1e-4, 5e-5, 2e-4):
        told = cost(ahead, road_course.sag_from(0, curvature)) - cost(ahead, road_course.sag_from(0, 0.0))
        assert told == pytest.approx(-2.0 * (log_likelihood(curvature) - log_likelihood(0.0)), rel=1e-6)
        row, variance = road_course.row_given(ahead, road_course.sag_from(0, curvature))
        assert row == pytest.approx(0.9 * (seen - 5000.0 * curvature), rel=1e-6)
        assert variance == pytest.approx(0.009, rel=1e-6)
