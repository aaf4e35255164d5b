"""A normal distribution over ln k along a way, against the algebra of dense matrices."""

import math

import numpy as np
import pytest

from fogsim.fusion import route_field_kernels
from fogsim.fusion.route_field import (
    AHEAD,
    BEHIND,
    CELL,
    COUNT,
    GRAIN,
    GRAIN_LENGTH,
    LEVEL,
    LEVEL_DEVIATION,
    RouteField,
)

DEVIATION, LENGTH, STEADINESS = 1.6, 300.0, 900.0


def field(place: float = 1000.0) -> RouteField:
    made = RouteField(DEVIATION, LENGTH, STEADINESS)
    made.move_to(place)
    return made


def beforehand(places: np.ndarray) -> np.ndarray:
    apart = np.abs(places[:, None] - places)
    smooth = (1.0 + math.sqrt(3.0) * apart / LENGTH) * np.exp(-math.sqrt(3.0) * apart / LENGTH)
    return LEVEL_DEVIATION**2 + DEVIATION**2 * smooth + GRAIN**2 * np.exp(-apart / GRAIN_LENGTH)


def test_before_anything_is_known_all_places_are_alike():
    profile = field().profile()
    assert profile.log_extinction == pytest.approx(LEVEL)
    assert profile.standard_deviation == pytest.approx(math.hypot(DEVIATION, LEVEL_DEVIATION, GRAIN))
    assert profile.distance[BEHIND] == pytest.approx(0.5 * CELL)
    assert len(profile.distance) == BEHIND + 1 + AHEAD


def test_what_is_learnt_at_one_place_tells_of_others_as_regression_has_it():
    made = field()
    made.learn(0.0, CELL, -4.0, 0.2, 1e-12, 0.01)
    places = CELL * np.arange(COUNT)
    covariance = beforehand(places)
    gain = covariance[:, BEHIND] / (covariance[BEHIND, BEHIND] + 0.2**2)
    profile = made.profile()
    assert profile.log_extinction == pytest.approx(LEVEL + gain * (-4.0 - LEVEL), abs=1e-9)
    variance = np.diag(covariance) - gain * covariance[BEHIND]
    assert profile.standard_deviation == pytest.approx(np.sqrt(variance), abs=1e-9)


def test_driving_on_keeps_what_was_learnt_and_enters_new_places_as_regression_has_it():
    made = field()
    made.learn(400.0, 425.0, -3.0, 0.1, 1e-12, 0.01)
    before = made.profile()
    made.move_to(1000.0 + 10 * CELL)
    after = made.profile()
    assert after.log_extinction[:-10] == pytest.approx(before.log_extinction[10:], abs=1e-9)
    assert after.standard_deviation[:-10] == pytest.approx(before.standard_deviation[10:], abs=1e-9)
    places = CELL * np.arange(COUNT + 10)
    covariance, told = beforehand(places), BEHIND + 16
    gain = covariance[:, told] / (covariance[told, told] + 0.1**2)
    assert after.log_extinction[-10:] == pytest.approx((LEVEL + gain * (-3.0 - LEVEL))[-10:], abs=1e-6)
    variance = np.diag(covariance) - gain * covariance[told]
    assert after.standard_deviation[-10:] == pytest.approx(np.sqrt(variance)[-10:], abs=1e-6)


def test_a_place_far_behind_or_far_ahead_is_another_road():
    made = field()
    made.learn(0.0, CELL, -3.0, 0.1, 1e-12, 0.01)
    for place in (900.0, 1000.0 + CELL * COUNT):
        made.move_to(place)
        assert made.profile().log_extinction == pytest.approx(LEVEL)


def test_a_measurement_far_off_moves_little_where_many_are_wrong():
    sure, wary = field(), field()
    for made, wrong in ((sure, 1e-9), (wary, 0.5)):
        for _ in range(5):
            made.learn(0.0, CELL, -5.0, 0.1, 1e-9, 0.01)
        made.learn(0.0, CELL, -4.4, 0.1, wrong, 0.01)
    assert wary.profile().at(0.5 * CELL)[0] == pytest.approx(-5.0, abs=0.05)
    assert sure.profile().at(0.5 * CELL)[0] > -4.95


def test_measurements_never_make_surer_than_their_common_error():
    made = field()
    for _ in range(1000):
        made.learn(0.0, CELL, -4.0, 0.1, 0.07, 0.1)
    assert made.mean_extinction(0.0, CELL)[1] == pytest.approx(0.1**2, rel=0.6)


def test_the_mean_over_a_stretch_is_of_extinctions_and_not_of_logarithms():
    value, gradient = route_field_kernels.mean_extinction(np.log([0.01, 0.03]), np.array([0.5, 0.5]))
    assert value == pytest.approx(math.log(0.02))
    assert gradient == pytest.approx([0.25, 0.75])


def test_time_alone_widens_and_an_old_measurement_says_less():
    made = field()
    made.learn(0.0, CELL, -4.0, 0.1, 1e-12, 0.01)
    before = made.mean_extinction(0.0, CELL)[1]
    made.elapse(60.0)
    after = made.mean_extinction(0.0, CELL)[1]
    assert after - before == pytest.approx(
        (LEVEL_DEVIATION**2 + DEVIATION**2 + GRAIN**2 - before) * (1.0 - math.exp(-2.0 * 60.0 / STEADINESS)), rel=1e-6
    )
    made.elapse(1e6)
    assert made.profile().standard_deviation == pytest.approx(field().profile().standard_deviation)
    assert made.variance_of_age(0.0) == 0.0
    assert made.variance_of_age(30.0) < made.variance_of_age(300.0) < 2.0 * DEVIATION**2


def test_an_upper_bound_cuts_what_lies_above_it():
    made = field()
    made.learn_at_most(200.0, math.log(0.002), 0.1)
    told, _ = made.mean_extinction(0.0, 200.0)
    assert told < math.log(0.003)
    low = made.profile().at(100.0)
    made.learn_at_most(200.0, math.log(0.1), 0.1)
    assert made.profile().at(100.0) == pytest.approx(low, abs=0.02)


def test_cholesky_and_samples_agree_with_numpy():
    rng = np.random.default_rng(1)
    half = rng.normal(size=(6, 6))
    covariance = half @ half.T + 0.1 * np.eye(6)
    upper = np.zeros((6, 6))
    for row in range(6):
        route_field_kernels.extend_factor(covariance, upper, row)
    lower = upper.T
    assert lower == pytest.approx(np.linalg.cholesky(covariance), abs=1e-9)
    normals, ends = rng.normal(size=(50, 6)), 30.0 * np.arange(1, 7)
    mean, small = np.full(6, math.log(0.03)), 0.05 * lower
    found = route_field_kernels.sighted_extinctions(mean, small @ small.T, np.ascontiguousarray(normals.T), ends, 3.0)
    for one, normal in zip(found, [*normals, *-normals], strict=True):
        k = np.exp(mean + small @ normal)
        depth = np.interp(np.linspace(0.0, 180.0, 18_001), [0.0, *ends], [0.0, *np.cumsum(30.0 * k)])
        sight = np.linspace(0.0, 180.0, 18_001)[np.searchsorted(depth, 3.0)] if depth[-1] >= 3.0 else None
        expected = math.log(3.0 / sight) if sight is not None else math.log(depth[-1] / 180.0)
        assert one == pytest.approx(expected, abs=1e-3)


def test_a_stretch_lies_in_cells_by_its_length_and_one_beyond_all_in_the_nearest():
    weights = route_field_kernels.stretch_weights(4, 25.0, -50.0, -10.0, 15.0)
    assert weights == pytest.approx([0.0, 0.4, 0.6, 0.0])
    assert route_field_kernels.stretch_weights(4, 25.0, -50.0, 60.0, 90.0).tolist() == [0.0, 0.0, 0.0, 1.0]
    assert route_field_kernels.stretch_weights(4, 25.0, -50.0, -90.0, -80.0).tolist() == [1.0, 0.0, 0.0, 0.0]
    assert route_field_kernels.stretch_weights(4, 25.0, -50.0, 10.0, 10.0).tolist() == [0.0, 0.0, 1.0, 0.0]


def test_samples_become_shares_of_cells():
    samples = np.sort(np.random.default_rng(2).normal(3.0, 1.0, 4000))
    shares = route_field_kernels.shares_in_cells(samples, -2.0, 0.5, 21)
    cells = -2.0 + 0.5 * np.arange(21)
    assert shares.sum() == pytest.approx(1.0)
    assert (shares >= 0.0).all()
    assert (shares * cells).sum() == pytest.approx(samples.mean(), abs=0.01)
    assert shares == pytest.approx(np.histogram(samples, np.append(cells - 0.25, 8.25))[0] / 4000, abs=2e-3)
    # What is the same in all samples is in one cell; what lies beyond the cells, in the last.
    assert route_field_kernels.shares_in_cells(np.full(8, 3.1), 0.0, 1.0, 6).tolist() == [0, 0, 0, 1, 0, 0]
    assert route_field_kernels.shares_in_cells(np.full(8, 99.0), 0.0, 1.0, 6).tolist() == [0, 0, 0, 0, 0, 1]
