"""Rounding, smoothing, hysteresis and hold, which all advisers share."""

import math
from typing import Any

import pytest

from fogsim.advice import ADVISERS
from fogsim.advice.presentation import PresentedAdviser
from fogsim.kinematics import safe_speed
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import SpeedAdvice
from fogsim.values.belief import certain_belief

LIMIT = 130 / 3.6
PRESENTED = [
    name for name, adviser in ADVISERS.items() if isinstance(adviser, type) and issubclass(adviser, PresentedAdviser)
]


def speeds(name: str, visibilities: list[float], period: float = 1.0, **parameters: Any) -> list[float]:
    """Advised speeds [km/h], decision by decision."""
    adviser, advice, told = ADVISERS[name](**parameters), SpeedAdvice(), []
    for number, visibility in enumerate(visibilities):
        advice = adviser.advise(
            certain_belief(OPTICAL_DEPTH_AT_VISIBILITY / visibility), LIMIT, number * period, advice
        )
        told.append(advice.speed * 3.6)
    return told


def test_every_adviser_that_goes_by_the_visibility_is_presented() -> None:
    assert set(PRESENTED) == set(ADVISERS) - {"none", "fixed_speed"}


@pytest.mark.parametrize(("rounded", "expected"), [("down", 60.0), ("nearest", 70.0), ("up", 70.0)])
def test_speeds_are_rounded_as_it_is_asked_for(rounded: str, expected: float) -> None:
    assert speeds("stopping_sight_distance", [100.0], rounded=rounded) == [pytest.approx(expected)]  # 68.1 is safe
    # What is on the grid already stays, whatever the way; mph can be shown in steps of 5 km/h.
    assert speeds("netherlands_a16", [100.0], rounded=rounded, rounding=10 / 3.6) == [pytest.approx(80.0)]
    in_kmh = {"down": 70.0, "nearest": 70.0, "up": 75.0}[rounded]
    assert speeds("alabama_i10", [100.0], rounded=rounded, rounding=5 / 3.6) == [pytest.approx(in_kmh)]  # 45 mph = 72.4


def test_unrounded_speeds_come_as_they_are() -> None:
    safe = safe_speed(100.0, 2.5, 3.4) * 3.6
    assert speeds("stopping_sight_distance", [100.0], rounding=0.01) == [pytest.approx(safe, abs=0.04)]


@pytest.mark.parametrize("name", PRESENTED)
def test_a_higher_speed_asks_for_more_visibility_where_there_is_hysteresis(name: str) -> None:
    for hysteresis, rises in ((0.0, True), (0.2, False)):
        low, same, high = speeds(name, [40.0, 44.0, 500.0], hold=0.0, hysteresis=hysteresis, rounding=0.01, minimum=0.0)
        if name == "stopping_sight_distance":
            assert (same > low) == rises
        assert high > low
    assert speeds("netherlands_a16", [65.0, 80.0, 85.0], hold=0.0, hysteresis=0.2)[1:] == [
        pytest.approx(60.0),
        pytest.approx(80.0),
    ]


def test_smoothing_follows_an_exponential_in_the_logarithm_of_the_visibility() -> None:
    plain = ADVISERS["stopping_sight_distance"](rounding=0.01, hold=0.0)
    told = speeds("stopping_sight_distance", [100.0, 25.0, 25.0], 10.0, smoothing=10.0, rounding=0.01, hold=0.0)
    for number, speed in enumerate(told):
        visibility = math.exp(math.log(25.0) + math.log(4.0) * math.exp(-number))
        extinction = OPTICAL_DEPTH_AT_VISIBILITY / visibility
        assert plain.advise(certain_belief(extinction), LIMIT, 0.0, SpeedAdvice()).speed * 3.6 == pytest.approx(
            speed, abs=0.04
        )


def test_smoothing_goes_on_while_a_rise_is_held() -> None:
    held = speeds("netherlands_a16", [50.0] * 2 + [500.0] * 40, smoothing=50.0, hold=10.0)
    # Smoothed, 70 m are passed 8 s after the last 50 m, and 140 m only after the hold.
    assert held[:19] == [pytest.approx(60.0)] * 19
    assert held[19] == pytest.approx(80.0)
    assert held[-1] == math.inf
