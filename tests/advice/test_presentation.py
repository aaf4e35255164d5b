"""Rounding, smoothing, hysteresis and hold, which all advisers share."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from fogsim.advice import ADVISERS
from fogsim.advice.presentation import PresentedAdviser
from fogsim.core.kinematics import safe_speed
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import Belief, FogProfile, SpeedAdvice
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


def test_no_advice_is_above_the_limit() -> None:
    """The least advice and rounding up may exceed a low limit."""
    for parameters in ({"minimum": 48 / 3.6}, {"rounding": 40 / 3.6, "rounded": "up"}):
        adviser = ADVISERS["stopping_sight_distance"](**parameters)
        advice = adviser.advise(certain_belief(OPTICAL_DEPTH_AT_VISIBILITY / 15.0), 30 / 3.6, 0.0, SpeedAdvice())
        assert advice.speed == math.inf


def test_advice_of_a_faster_road_does_not_outlast_it() -> None:
    """Neither while a rise is held nor while the belief says too little."""
    adviser, kept = ADVISERS["netherlands_a16"](), SpeedAdvice(80 / 3.6)
    unknown = Belief(np.linspace(-8.0, -1.0, 50), np.full(50, 0.02))
    for belief in (certain_belief(OPTICAL_DEPTH_AT_VISIBILITY / 100.0), unknown):
        assert adviser.advise(belief, 70 / 3.6, 1.0, kept).speed == math.inf


def test_unrounded_speeds_come_as_they_are() -> None:
    safe = safe_speed(100.0, 2.5, 3.4) * 3.6
    assert speeds("stopping_sight_distance", [100.0], rounding=0.01) == [pytest.approx(safe, abs=0.04)]


def test_a_higher_speed_asks_for_more_visibility_where_there_is_hysteresis() -> None:
    for name in PRESENTED:
        for hysteresis, rises in ((0.0, True), (0.2, False)):
            low, same, high = speeds(
                name, [40.0, 44.0, 500.0], hold=0.0, hysteresis=hysteresis, rounding=0.01, minimum=0.0
            )
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


def believed(visibilities: dict[float, float], deviation: float = 0.2, here: float = 2000.0) -> Belief:
    """A belief that knows of places: visibility [m] by distance ahead [m]."""
    places = np.array(list(visibilities))
    logs = np.log(OPTICAL_DEPTH_AT_VISIBILITY / np.array(list(visibilities.values())))
    profile = FogProfile(places, logs, np.full(places.size, deviation))
    return dataclasses.replace(certain_belief(OPTICAL_DEPTH_AT_VISIBILITY / here), profile=profile)


def advised(belief: Belief, **parameters: Any) -> float:
    adviser = ADVISERS["stopping_sight_distance"](rounding=0.01, **parameters)
    return float(adviser.advise(belief, LIMIT, 0.0, SpeedAdvice()).speed)


def test_a_bank_ahead_is_slowed_down_for_no_earlier_than_need_be() -> None:
    in_bank = safe_speed(60.0, 2.5, 3.4)
    speeds_on_the_way = []
    for ahead in (400.0, 200.0, 100.0, 0.0):
        belief = believed({-100.0: 2000.0, ahead - 1e-3: 2000.0, ahead: 60.0, 1000.0: 60.0})
        speeds_on_the_way.append(advised(belief, quantile=0.5, slowing=1.5, lead_time=0.0))
        expected = math.sqrt(in_bank**2 + 2.0 * 1.5 * ahead)
        assert speeds_on_the_way[-1] == pytest.approx(math.inf if expected >= LIMIT else expected, abs=0.05)
    assert speeds_on_the_way == sorted(speeds_on_the_way, reverse=True)


def test_advice_comes_early_enough_for_drivers_who_begin_later() -> None:
    for ahead in (50.0, 150.0, 250.0):
        belief = believed({-100.0: 2000.0, ahead - 1e-3: 2000.0, ahead: 60.0, 1000.0: 60.0})
        early = advised(belief, quantile=0.5, slowing=1.5, lead_time=2.0)
        left = ahead - 2.0 * early
        assert early**2 == pytest.approx(safe_speed(60.0, 2.5, 3.4) ** 2 + 2.0 * 1.5 * left, rel=0.01)


def test_places_of_which_too_little_is_known_do_not_count() -> None:
    bank = {-100.0: 2000.0, 0.0: 2000.0, 50.0: 30.0, 1000.0: 30.0}
    profile = believed(bank).profile
    assert profile is not None
    unsure = dataclasses.replace(profile, standard_deviation=np.array([0.2, 0.2, 2.0, 2.0]))
    belief = dataclasses.replace(believed(bank), profile=unsure)
    assert advised(belief, quantile=0.5) == math.inf
    assert advised(believed(bank), quantile=0.5) < 20.0
    lost = dataclasses.replace(belief, profile=dataclasses.replace(profile, standard_deviation=np.full(4, 2.0)))
    held = ADVISERS["stopping_sight_distance"]().advise(lost, LIMIT, 0.0, SpeedAdvice(12.0))
    assert held.speed == 12.0


def test_a_careful_quantile_counts_at_each_place() -> None:
    bank = {-100.0: 300.0, 0.0: 300.0, 100.0: 80.0, 1000.0: 80.0}
    careful, median = (advised(believed(bank, 0.5), quantile=share) for share in (0.25, 0.5))
    assert careful < median
