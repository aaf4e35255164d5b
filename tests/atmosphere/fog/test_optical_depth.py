"""The exact optical depth against brute-force integration of the extinction coefficient."""

import numpy as np
import pytest

from fogsim.atmosphere import extinction, optical_depth
from fogsim.values import FogBank, FogField
from tests.atmosphere.fields import brute_force

AIRLIGHT = (3000.0, 3000.0, 3000.0)
BANK = FogBank((100.0, 50.0), (0.8, 0.6), 0.0, 400.0, 120.0, 0.045)
CLEARING = FogBank((100.0, 50.0), (0.8, 0.6), 600.0, 700.0, 80.0, -0.001)
FIELD = FogField(0.0015, AIRLIGHT, (BANK, CLEARING), top=60.0)


def test_against_brute_force() -> None:
    for seed in range(12):
        rng = np.random.default_rng(seed)
        start, end = (rng.uniform((-200, -200, 0), (900, 700, 90)) for _ in range(2))
        slow = float(brute_force(FIELD, start, end, 400_000))
        assert optical_depth(FIELD, start, end) == pytest.approx(slow, rel=2e-5, abs=1e-7)


def test_across_the_bank_where_the_station_does_not_change() -> None:
    start = np.array([100.0, 50.0, 1.0]) + 30.0 * np.array([0.8, 0.6, 0.0])
    end = start + 80.0 * np.array([-0.6, 0.8, 0.0])
    assert optical_depth(FIELD, start, end) == pytest.approx(80.0 * extinction(FIELD, start), rel=1e-9)
    a, b = np.array([0.0, 0.0, 1.0]), np.array([500.0, 300.0, 20.0])
    assert optical_depth(FIELD, a, a) == 0.0
    assert optical_depth(FIELD, a, b) == pytest.approx(optical_depth(FIELD, b, a), rel=1e-12)


def test_visibility_inside_and_outside_a_bank() -> None:
    inside = np.array([100.0 + 0.8 * 200, 50.0 + 0.6 * 200, 1.0])
    assert extinction(FIELD, inside) == pytest.approx(0.0015 + 0.045)
    assert extinction(FIELD, (-500.0, -500.0, 1.0)) == pytest.approx(0.0015)
    assert extinction(FIELD, inside + np.array([0, 0, 60])) == 0.0
    half = np.array([100.0, 50.0, 1.0])
    assert extinction(FIELD, half) == pytest.approx(0.0015 + 0.045 / 2)
    # Where clearings cross there is no less than no fog.
    clearings = tuple(FogBank((0.0, 0.0), axis, 100.0, 300.0, 50.0, -0.03) for axis in ((1.0, 0.0), (0.0, 1.0)))
    field = FogField(0.03, AIRLIGHT, clearings, top=60.0)
    assert extinction(field, (200.0, 200.0, 1.0)) == 0.0
    assert optical_depth(field, (200.0, 200.0, 1.0), (220.0, 210.0, 1.0)) == 0.0
    assert optical_depth(field, (200.0, 200.0, 1.0), (220.0, 210.0, 2.0)) == 0.0


def test_many_lines_at_once_of_which_one_end_may_be_given_once():
    ends = np.random.default_rng(0).uniform((0, 0, 0), (900, 700, 90), (50, 3))
    one_by_one = [optical_depth(FIELD, (0, 0, 1), end) for end in ends]
    assert np.allclose(optical_depth(FIELD, (0, 0, 1), ends), one_by_one, rtol=1e-12)
    field, ends = FogField(0.03, (0.0, 0.0, 0.0)), np.array([[10.0, 0.0, 0.0], [0.0, 20.0, 0.0]])
    assert optical_depth(field, (0.0, 0.0, 0.0), ends) == pytest.approx([0.3, 0.6])
    assert optical_depth(field, np.zeros((1, 3)), ends[:1]) == pytest.approx([0.3])
    assert optical_depth(field, ends, np.zeros(3)) == pytest.approx([0.3, 0.6])
    assert optical_depth(field, (0.0, 0.0, 0.0), ends[:1]) == pytest.approx([0.3])
