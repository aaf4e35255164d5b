import itertools
import math

import pytest

from fogsim.advice.presentation import harmonised_speeds

KMH = 3.6


def steps(speeds: list[float], lengths: list[float], deceleration: float = 1.0, largest: float = 20.0) -> list[float]:
    """Harmonised speeds on a road of 130 km/h, all in km/h."""
    given = [speed / KMH for speed in speeds]
    shown = harmonised_speeds(given, lengths, [130.0 / KMH] * len(given), largest / KMH, deceleration)
    return [speed * KMH for speed in shown]


def test_speeds_step_down_to_fog_and_rise_at_once_behind_it() -> None:
    free = math.inf
    shown = steps([free, free, free, free, 60.0, free], [500.0] * 6)
    assert shown == [free, *(pytest.approx(v) for v in (120.0, 100.0, 80.0, 60.0)), free]


def test_no_section_asks_for_more_than_the_steady_deceleration() -> None:
    shown = steps([math.inf] * 8 + [40.0], [60.0] * 9, deceleration=0.8, largest=500.0)
    slowing = [(a**2 - b**2) / (2.0 * 60.0 * KMH**2) for a, b in itertools.pairwise(shown)]
    assert slowing == [pytest.approx(0.8)] * 8


def test_what_a_section_is_advised_for_itself_is_never_raised() -> None:
    assert steps([50.0, 90.0, 60.0], [500.0] * 3) == [pytest.approx(v) for v in (50.0, 80.0, 60.0)]
    assert steps([math.inf] * 3, [500.0] * 3) == [math.inf] * 3
    assert steps([], []) == []
