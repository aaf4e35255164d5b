"""What an estimate says: its visibility, the interval of it, and negru2013's categories."""

import dataclasses
import math

import pytest

from fogsim.units import extinction_from_visibility
from fogsim.values import Estimate
from fogsim.values.estimate import NORMAL_90_PERCENT, ExtinctionBounds, FogCategory, fog_category


def test_categories_of_negru2013() -> None:
    for visibility, category in [
        (49.9, "very dense"),
        (50.0, "dense"),
        (100.0, "moderate"),
        (300.0, "low"),
        (1000.0, "none"),
        (math.inf, "none"),
    ]:
        assert fog_category(visibility) is FogCategory(category)


def test_visibility_of_an_estimate_and_its_interval() -> None:
    k = extinction_from_visibility(100.0)
    estimate = Estimate("negru2013", k, 0.1 * k)
    low, high = estimate.visibility_interval
    assert estimate.visibility == pytest.approx(100.0)
    assert (low, high) == pytest.approx((100.0 / 1.16448536, 100.0 / 0.83551464))


def test_an_interval_that_reaches_clear_air_has_no_end() -> None:
    assert Estimate("negru2013", 0.01, 0.01).visibility_interval[1] == math.inf
    # As deep as its extinction, but for rounding.
    assert Estimate("negru2013", 0.01, (0.01 - 1e-17) / NORMAL_90_PERCENT).visibility_interval[1] == math.inf


def test_no_estimate_says_nothing() -> None:
    nothing = Estimate.invalid("negru2013", "no road", row=7)
    assert (nothing.valid, nothing.visibility_interval) == (False, (0.0, math.inf))
    assert nothing.diagnostics == {"reason": "no road", "row": 7}


def test_bounds_are_the_interval_of_what_is_not_estimated() -> None:
    at_least = ExtinctionBounds(most=extinction_from_visibility(250.0), softness=0.1)
    bound = dataclasses.replace(Estimate.invalid("belaroussi2015", "flat"), bounds=at_least)
    low, high = bound.visibility_interval
    assert (low, high) == (pytest.approx(250.0 / math.exp(0.16448536)), math.inf)
