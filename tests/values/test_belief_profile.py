import math

import numpy as np
import pytest

from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import FogProfile

PROFILE = FogProfile(np.array([-100.0, 0.0, 100.0]), np.log([0.01, 0.02, 0.04]), np.array([0.1, 0.2, 0.6]))


def test_a_place_between_two_has_what_lies_between_them_and_one_beyond_has_that_of_the_end():
    assert PROFILE.at(50.0) == pytest.approx((math.log(0.02 * math.sqrt(2.0)), 0.4))
    assert PROFILE.at(-500.0) == pytest.approx((math.log(0.01), 0.1))
    assert PROFILE.at(900.0) == pytest.approx((math.log(0.04), 0.6))


def test_quantiles_are_those_of_a_normal_distribution_of_ln_k():
    assert PROFILE.visibility_quantile(0.0, 0.5) == pytest.approx(OPTICAL_DEPTH_AT_VISIBILITY / 0.02)
    low, high = (PROFILE.visibility_quantile(0.0, share) for share in (0.05, 0.95))
    assert low == pytest.approx(OPTICAL_DEPTH_AT_VISIBILITY / 0.02 * math.exp(-1.6448536 * 0.2))
    assert low * high == pytest.approx((OPTICAL_DEPTH_AT_VISIBILITY / 0.02) ** 2)


def test_all_places_together_have_what_each_has_by_itself():
    known = PROFILE.known_visibilities(0.25, 0.3)
    one_by_one = [PROFILE.known_visibility(distance, 0.25, 0.3) for distance in PROFILE.distance.tolist()]
    assert one_by_one[2] is None
    assert np.isnan(known[2])
    assert known[:2].tolist() == pytest.approx(one_by_one[:2], rel=1e-12)
