import math

import pytest

from fogsim.units import clock_time, extinction_from_visibility, luminance_of, visibility_from_extinction


def test_a_hundred_metres_of_visibility() -> None:
    assert extinction_from_visibility(100.0) == pytest.approx(0.0299573, abs=5e-8)  # CIE 5 %: ln 20 / V


def test_round_trip() -> None:
    for visibility in (1.0, 30.0, 1000.0, 1e6):
        assert visibility_from_extinction(extinction_from_visibility(visibility)) == pytest.approx(visibility)


def test_clear_air_is_exactly_clear() -> None:
    assert extinction_from_visibility(math.inf) == 0.0
    assert visibility_from_extinction(0.0) == math.inf


def test_impossible_visibility_is_refused() -> None:
    for visibility in [0.0, -1.0, math.nan]:
        with pytest.raises(ValueError, match="positive"):
            extinction_from_visibility(visibility)


def test_impossible_extinction_is_refused() -> None:
    for extinction in [-1e-9, math.nan]:
        with pytest.raises(ValueError, match="negative"):
            visibility_from_extinction(extinction)


def test_times_have_no_noise_of_binary_fractions() -> None:
    assert [clock_time(0.1 * i) for i in range(1000)] == [i / 10 for i in range(1000)]
    assert clock_time(1 / 15) == pytest.approx(1 / 15, abs=1e-9)


def test_luminance_of_white_and_of_the_primaries() -> None:
    assert luminance_of((0.7, 0.7, 0.7)) == pytest.approx(0.7)
    primaries = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    assert [luminance_of(primary) for primary in primaries] == [0.2126, 0.7152, 0.0722]  # ITU-R BT.709
