"""Adrian's visibility level: test vectors, the joins between its branches, and its limits."""

import math

import numpy as np
import pytest

from fogsim.atmosphere.visibility.visibility_level import (
    age_factor,
    angular_size,
    exposure_factor,
    polarity_factor,
    threshold,
    visibility_level,
)
from fogsim.errors import InputError
from fogsim.values.eye import flux_root, luminance_root
from tests.atmosphere.tables import read_table

VECTORS = read_table("adrian1989.csv")


def minutes(value):
    return np.radians(value / 60.0)


def test_threshold_of_the_published_formula():
    background, size = VECTORS["background"], VECTORS["minutes"]
    assert flux_root(background) == pytest.approx(VECTORS["flux_root"], rel=2e-5)
    assert luminance_root(background) == pytest.approx(VECTORS["luminance_root"], rel=1e-4)
    assert exposure_factor(background, size, 0.2) == pytest.approx(VECTORS["exposure_factor"], rel=1e-5)
    assert threshold(background, minutes(size)) == pytest.approx(VECTORS["brighter"], rel=1e-4)
    assert threshold(background, minutes(size), darker=True) == pytest.approx(VECTORS["darker"], rel=1e-4)
    assert threshold(0.002, minutes(10)) == pytest.approx(0.009189, rel=1e-3)


def test_factors_of_polarity_and_age_and_angular_size():
    assert polarity_factor(1.0, 10) == pytest.approx(0.58993, rel=1e-4)
    assert polarity_factor(0.01, 7.45) == pytest.approx(0.46361, rel=1e-4)
    assert polarity_factor(1e-5, 10) == polarity_factor(0.004, 10)
    for age, factor in [(20, 0.99741), (25, 1.00667), (30, 1.04602), (60, 1.76824), (64, 1.92750), (70, 2.97394)]:
        assert age_factor(age) == pytest.approx(factor, rel=1e-5)
    assert age_factor(64.0001) == pytest.approx(1.90098, rel=1e-4)  # it jumps, as published
    for distance, size in [(60, 10.3132), (83, 7.4554), (100, 6.1879), (150, 4.1253)]:
        assert np.degrees(angular_size(0.18, distance)) * 60 == pytest.approx(size, rel=1e-4)


def test_branches_meet_within_their_own_mismatch():
    for function, mismatch, join in [
        (flux_root, 0.011, 0.6),
        (luminance_root, 0.007, 0.6),
        (flux_root, 0.011, 0.00418),
        (luminance_root, 0.007, 0.00418),
    ]:
        assert function(join * 1.0001) == pytest.approx(float(function(join * 0.9999)), rel=mismatch)


def test_visibility_level_of_the_small_target_is_lowered_by_a_veil_and_negative_for_dark_ones():
    assert visibility_level(2.5, 2.0, minutes(10)) < visibility_level(1.5, 1.0, minutes(10))
    assert visibility_level(1.5, 1.0, minutes(10), adaptation=2.0) == visibility_level(2.5, 2.0, minutes(10))
    assert visibility_level(0.5, 1.0, minutes(10)) < 0
    assert visibility_level(1.5, 1.0, minutes(7.45), age=60) == pytest.approx(2.38759, rel=1e-5)


def test_a_long_look_needs_no_more_than_the_bare_threshold():
    bare = threshold(1.0, minutes(10), exposure_time=2.0, age=23)
    assert bare == pytest.approx(0.049908 * age_factor(23), rel=1e-4)
    assert threshold(1.0, minutes(10), exposure_time=math.inf, age=23) == bare


def test_impossible_arguments_are_refused():
    for arguments, message in [
        ({"background": -1.0}, "adaptation luminance"),
        ({"background": math.nan}, "adaptation luminance"),
        ({"angle": 0.0}, "angular size"),
        ({"exposure_time": 0.0}, "exposure time"),
        ({"age": 80.0}, "below 75 years, got 80"),
    ]:
        with pytest.raises(InputError, match=message):
            threshold(**{"background": 1.0, "angle": 0.003, **arguments})
