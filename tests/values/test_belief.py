"""What a belief says, in all and by place: quantiles, deviations."""

import math

import numpy as np
import pytest

from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import Belief, FogProfile
from fogsim.values.belief import certain_belief

SHARES = (0.0, 0.05, 0.3, 0.5, 0.95, 1.0)
PROFILE = FogProfile(np.array([-100.0, 0.0, 100.0]), np.log([0.01, 0.02, 0.04]), np.array([0.1, 0.2, 0.6]))


def test_quantiles_lie_on_straight_lines_between_the_middles_of_cells() -> None:
    rng = np.random.default_rng(4)
    for share_of_nothing in (0.0, 0.5):
        cells, weights = np.linspace(-7.0, -1.0, 60), rng.random(60) * (rng.random(60) >= share_of_nothing)
        belief = Belief(cells, weights / weights.sum())
        middles = np.cumsum(belief.probability) - 0.5 * belief.probability
        expected = OPTICAL_DEPTH_AT_VISIBILITY / np.exp(np.interp(1.0 - np.array(SHARES), middles, cells))
        np.testing.assert_array_equal(belief.visibility_quantiles(SHARES), expected)


def test_who_knows_the_fog_believes_one_visibility() -> None:
    assert certain_belief(0.03).visibility_quantiles(SHARES) == pytest.approx([OPTICAL_DEPTH_AT_VISIBILITY / 0.03] * 6)
    assert certain_belief(0.03).log_standard_deviation == 0.0


def test_the_deviation_is_that_of_the_cells() -> None:
    belief = Belief(np.array([-4.0, -3.0, -2.0], np.float32), np.array([0.25, 0.5, 0.25], np.float32))
    assert belief.log_standard_deviation == pytest.approx(math.sqrt(0.5))
    assert belief.visibility == pytest.approx(OPTICAL_DEPTH_AT_VISIBILITY * math.exp(3.0))


def test_a_place_between_two_has_what_lies_between_them_and_one_beyond_has_that_of_the_end() -> None:
    assert PROFILE.at(50.0) == pytest.approx((math.log(0.02 * math.sqrt(2.0)), 0.4))
    assert PROFILE.at(-500.0) == pytest.approx((math.log(0.01), 0.1))
    assert PROFILE.at(900.0) == pytest.approx((math.log(0.04), 0.6))


def test_quantiles_are_those_of_a_normal_distribution_of_ln_k() -> None:
    assert PROFILE.visibility_quantile(0.0, 0.5) == pytest.approx(OPTICAL_DEPTH_AT_VISIBILITY / 0.02)
    low, high = (PROFILE.visibility_quantile(0.0, share) for share in (0.05, 0.95))
    assert low == pytest.approx(OPTICAL_DEPTH_AT_VISIBILITY / 0.02 * math.exp(-1.6448536 * 0.2))
    assert low * high == pytest.approx((OPTICAL_DEPTH_AT_VISIBILITY / 0.02) ** 2)


def test_all_places_together_have_what_each_has_by_itself() -> None:
    known = PROFILE.known_visibilities(0.25, 0.3)
    one_by_one = [PROFILE.known_visibility(distance, 0.25, 0.3) for distance in PROFILE.distance.tolist()]
    assert one_by_one[2] is None
    assert np.isnan(known[2])
    assert known[:2].tolist() == pytest.approx(one_by_one[:2], rel=1e-12)
