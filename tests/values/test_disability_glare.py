"""Veil inside the eye: values of Vos (2003), its limits, and that sources add."""

import math

import numpy as np
import pytest

from fogsim.atmosphere import veiling_luminance
from fogsim.errors import InputError
from fogsim.values.eye import disability_glare


def test_values_of_the_formula() -> None:
    for angle, age, veil in [(3, 25, 1.1292), (3, 70, 20 / 9), (10, 1e-9, 0.1), (0.2, 1e-9, 10.0)]:
        assert veiling_luminance(1.0, math.radians(angle), age) == pytest.approx(veil, rel=1e-4)


def test_the_veil_is_proportional_to_the_light_and_falls_with_the_square_of_the_angle() -> None:
    veils = veiling_luminance(np.array([[1.0], [3.0]]), np.radians([2.0, 4.0, 8.0]))
    assert veils[1] == pytest.approx(3.0 * veils[0])
    assert veils[0, :2] / veils[0, 1:] == pytest.approx(4.0)


def test_values_of_the_general_formula() -> None:
    """At 1° and 62.5 years 10 + 2 (5 + 0.05) + 0.00125; below 0.1° it is that of 0.1°."""
    for angle, age, veil in [(3, 25, 0.9585), (1, 62.5, 20.10125), (0.05, 25, 10_513.8)]:
        assert disability_glare(1.0, math.radians(angle), age) == pytest.approx(veil, rel=1e-4)


def test_light_eyes_are_dazzled_more_and_no_eye_is_lighter_than_the_lightest() -> None:
    assert disability_glare(1.0, 1.0, pigmentation=1.2) > disability_glare(1.0, 1.0, pigmentation=0.0)
    with pytest.raises(InputError, match="pigmentation"):
        disability_glare(1.0, 1.0, pigmentation=1.3)
