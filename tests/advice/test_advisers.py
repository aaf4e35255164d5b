"""Advisers: their tables and formulas, and the rounding, smoothing, hysteresis and hold that all of them share."""

import dataclasses
import itertools
import math
from typing import Any

import numpy as np
import pytest

from fogsim.advice import ADVISERS, FixedSpeed, NoAdvice, StepTable, StoppingSightDistance
from fogsim.advice.presentation import PresentedAdviser, harmonised_speeds
from fogsim.core.kinematics import safe_speed, stopping_sight_distance
from fogsim.errors import InputError
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import Belief, FogProfile, SpeedAdvice
from fogsim.values.belief import certain_belief

LIMIT, MPH = 130 / 3.6, 0.44704
PRESENTED = [
    name for name, adviser in ADVISERS.items() if isinstance(adviser, type) and issubclass(adviser, PresentedAdviser)
]


def fog(visibility: float) -> Belief:
    return certain_belief(OPTICAL_DEPTH_AT_VISIBILITY / visibility)


def speeds(name: str, visibilities: list[float], period: float = 1.0, **parameters: Any) -> list[float]:
    """Advised speeds [km/h], decision by decision."""
    adviser, advice, speeds_shown = ADVISERS[name](**parameters), SpeedAdvice(), []
    for number, visibility in enumerate(visibilities):
        advice = adviser.advise(fog(visibility), LIMIT, number * period, advice)
        speeds_shown.append(advice.speed * 3.6)
    return speeds_shown


def test_published_steps() -> None:
    for name, visibility, expected in [
        ("netherlands_a16", 145.0, math.inf),
        ("netherlands_a16", 130.0, 80),
        ("netherlands_a16", 60.0, 60),
        ("alabama_i10", 280.0, math.inf),
        ("alabama_i10", 250.0, 65 * MPH * 3.6),
        ("alabama_i10", 150.0, 55 * MPH * 3.6),
        ("alabama_i10", 100.0, 45 * MPH * 3.6),
        ("alabama_i10", 70.0, 35 * MPH * 3.6),
        ("alabama_i10", 40.0, 20),
        ("tennessee_i75", 300.0, 50 * MPH * 3.6),
        ("tennessee_i75", 100.0, 35 * MPH * 3.6),
        ("china_article_81", 210.0, math.inf),
        ("china_article_81", 150.0, 60),
        ("china_article_81", 70.0, 40),
        ("china_article_81", 40.0, 20),
        ("france_r413_4", 49.0, 50),
        ("germany_stvo_3", 51.0, math.inf),
        ("virginia_i77", 205.0, math.inf),
        ("virginia_i77", 20.0, 30 * MPH * 3.6),
    ]:
        assert speeds(name, [visibility]) == [pytest.approx(expected)]


def test_one_can_stop_within_the_visibility() -> None:
    for name, step in (("stopping_sight_distance", 10 / 3.6), ("virginia_i77", 5 * MPH)):
        for visibility in [80.0, 110.0, 160.0, 190.0]:
            speed = speeds(name, [visibility])[0] / 3.6
            assert stopping_sight_distance(speed, 2.5, 3.4) <= visibility
            assert stopping_sight_distance(speed + step, 2.5, 3.4) > visibility * 0.98
            assert speed / step == pytest.approx(round(speed / step))


def test_advice_falls_at_once_and_rises_after_the_hold() -> None:
    adviser = StoppingSightDistance(hold=3.0)
    slow = adviser.advise(fog(60.0), LIMIT, 10.0, SpeedAdvice(100 / 3.6))
    assert slow.speed * 3.6 == pytest.approx(40.0)
    waiting = adviser.advise(fog(200.0), LIMIT, 11.0, slow)
    assert waiting == SpeedAdvice(slow.speed, raise_since=11.0)
    assert adviser.advise(fog(200.0), LIMIT, 13.9, waiting).speed == slow.speed
    assert adviser.advise(fog(200.0), LIMIT, 14.0, waiting).speed * 3.6 == pytest.approx(100.0)
    assert adviser.advise(fog(60.0), LIMIT, 13.0, waiting).raise_since is None


def test_what_does_not_follow_the_fog() -> None:
    assert NoAdvice().advise(fog(50.0), LIMIT, 0.0, SpeedAdvice(10.0)) == SpeedAdvice()
    for visibility in (20.0, 5000.0):
        assert FixedSpeed(20.0).advise(fog(visibility), LIMIT, 0.0, SpeedAdvice(10.0)).speed == 20.0


def test_bad_tables_are_refused() -> None:
    for visibilities, slower, said in [
        ((140.0, 70.0), (10.0, 20.0), "visibilities must be in ascending order, got"),
        ((70.0, 140.0), (20.0, 10.0), "speeds must be in ascending order"),
        ((70.0,), (10.0, 20.0), "a speed for each visibility, got 1 visibilities and 2 speeds"),
        ((), (), "visibilities must be a list, each a number 1 … 10000 m, got"),
        ((math.inf,), (10.0,), "visibilities must be a list, each"),
        ("70", (10.0,), "visibilities must be a list, each"),
        (("70",), (10.0,), "visibilities must be a list, each"),
    ]:
        with pytest.raises(InputError, match=said):
            StepTable(visibilities, slower)


def test_wet_roads_slopes_and_narrow_roads_lower_the_sight_distance_advice() -> None:
    here = fog(100.0)
    assert advised(here, friction=0.3) < advised(here, grade=-0.03) < advised(here) < advised(here, grade=0.05)
    assert advised(here, friction=0.9) == advised(here)
    # Half the sight is as half the visibility.
    assert advised(here, sight_share=0.5) == advised(fog(50.0)) < advised(here)
    # Where nothing can be stopped on, the least advice is left.
    assert advised(here, friction=0.05, grade=-0.2) == pytest.approx(20 / 3.6)


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
        assert adviser.advise(fog(15.0), 30 / 3.6, 0.0, SpeedAdvice()).speed == math.inf


def test_advice_of_a_faster_road_does_not_outlast_it() -> None:
    """Neither while a rise is held nor while the belief says too little."""
    adviser, kept = ADVISERS["netherlands_a16"](), SpeedAdvice(80 / 3.6)
    unknown = Belief(np.linspace(-8.0, -1.0, 50), np.full(50, 0.02))
    for belief in (fog(100.0), unknown):
        assert adviser.advise(belief, 70 / 3.6, 1.0, kept).speed == math.inf


def test_a_higher_speed_asks_for_more_visibility_where_there_is_hysteresis() -> None:
    for name in PRESENTED:
        for hysteresis, rises in ((0.0, True), (0.2, False)):
            how = {"hold": 0.0, "hysteresis": hysteresis, "rounding": 0.01, "minimum": 0.0}
            low, same, high = speeds(name, [40.0, 44.0, 500.0], **how)
            if name == "stopping_sight_distance":
                assert (same > low) == rises
            assert high > low
    assert speeds("netherlands_a16", [65.0, 80.0, 85.0], hold=0.0, hysteresis=0.2)[1:] == pytest.approx([60.0, 80.0])


def test_smoothing_follows_an_exponential_in_the_logarithm_of_the_visibility() -> None:
    plain = ADVISERS["stopping_sight_distance"](rounding=0.01, hold=0.0)
    speeds_shown = speeds("stopping_sight_distance", [100.0, 25.0, 25.0], 10.0, smoothing=10.0, rounding=0.01, hold=0.0)
    for number, speed in enumerate(speeds_shown):
        visibility = math.exp(math.log(25.0) + math.log(4.0) * math.exp(-number))
        assert plain.advise(fog(visibility), LIMIT, 0.0, SpeedAdvice()).speed * 3.6 == pytest.approx(speed, abs=0.04)


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
    return dataclasses.replace(fog(here), profile=profile)


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


def steps(speeds: list[float], lengths: list[float], deceleration: float = 1.0, largest: float = 20.0) -> list[float]:
    """Harmonised speeds on a road of 130 km/h, all in km/h."""
    given = [speed / 3.6 for speed in speeds]
    shown = harmonised_speeds(given, lengths, [130.0 / 3.6] * len(given), largest / 3.6, deceleration)
    return [speed * 3.6 for speed in shown]


def test_speeds_step_down_to_fog_and_rise_at_once_behind_it() -> None:
    free = math.inf
    shown = steps([free, free, free, free, 60.0, free], [500.0] * 6)
    assert shown == [free, *(pytest.approx(v) for v in (120.0, 100.0, 80.0, 60.0)), free]


def test_no_section_asks_for_more_than_the_steady_deceleration() -> None:
    shown = steps([math.inf] * 8 + [40.0], [60.0] * 9, deceleration=0.8, largest=500.0)
    slowing = [(a**2 - b**2) / (2.0 * 60.0 * 3.6**2) for a, b in itertools.pairwise(shown)]
    assert slowing == [pytest.approx(0.8)] * 8


def test_what_a_section_is_advised_for_itself_is_never_raised() -> None:
    assert steps([50.0, 90.0, 60.0], [500.0] * 3) == [pytest.approx(v) for v in (50.0, 80.0, 60.0)]
    assert steps([math.inf] * 3, [500.0] * 3) == [math.inf] * 3
    assert steps([], []) == []
