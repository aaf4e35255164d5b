import math

import numpy as np
import pytest

from fogsim.advice import ADVISERS, FixedSpeed, NoAdvice, StoppingSightDistance
from fogsim.core.kinematics import stopping_sight_distance
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import Belief, SpeedAdvice

LIMIT = 130 / 3.6


def believe(visibility: float) -> Belief:
    """All but certain of one visibility."""
    cells = np.linspace(math.log(3e-4), math.log(0.3), 2401)
    weight = np.exp(-0.5 * ((cells - math.log(OPTICAL_DEPTH_AT_VISIBILITY / visibility)) / 0.005) ** 2)
    return Belief(cells, weight / weight.sum())


def test_one_can_stop_within_the_visibility() -> None:
    for visibility in [45.0, 60.0, 100.0, 200.0]:
        adviser = StoppingSightDistance()
        speed = adviser.advise(believe(visibility), LIMIT, 0.0, SpeedAdvice()).speed
        assert stopping_sight_distance(speed, 2.5, 3.4) <= visibility
        assert stopping_sight_distance(speed + adviser.rounding, 2.5, 3.4) > visibility * 0.98


def test_advice_is_a_multiple_of_ten() -> None:
    kmh = StoppingSightDistance().advise(believe(100.0), LIMIT, 0.0, SpeedAdvice()).speed * 3.6
    assert kmh == pytest.approx(60.0)  # 68.1 km/h would be safe


def test_clear_air_needs_no_advice() -> None:
    assert StoppingSightDistance().advise(believe(2000.0), LIMIT, 0.0, SpeedAdvice()).speed == math.inf


def test_advice_falls_at_once_and_rises_after_the_hold() -> None:
    adviser = StoppingSightDistance(hold=3.0)
    slow = adviser.advise(believe(60.0), LIMIT, 10.0, SpeedAdvice(100 / 3.6))
    assert slow.speed * 3.6 == pytest.approx(40.0)
    waiting = adviser.advise(believe(200.0), LIMIT, 11.0, slow)
    assert waiting == SpeedAdvice(slow.speed, raise_since=11.0)
    assert adviser.advise(believe(200.0), LIMIT, 13.9, waiting).speed == slow.speed
    assert adviser.advise(believe(200.0), LIMIT, 14.0, waiting).speed * 3.6 == pytest.approx(100.0)
    broken = adviser.advise(believe(60.0), LIMIT, 13.0, waiting)
    assert broken.raise_since is None


def test_a_belief_that_says_nothing_changes_no_advice() -> None:
    cells = np.linspace(math.log(3e-4), math.log(0.3), 241)
    ignorant = Belief(cells, np.full(241, 1 / 241))
    for speed in (50 / 3.6, math.inf):
        assert StoppingSightDistance().advise(ignorant, LIMIT, 0.0, SpeedAdvice(speed)).speed == speed


def test_never_below_the_minimum() -> None:
    speed = StoppingSightDistance().advise(believe(12.0), LIMIT, 0.0, SpeedAdvice()).speed
    assert speed * 3.6 == pytest.approx(20.0)


def test_half_the_sight_on_narrow_roads() -> None:
    full = StoppingSightDistance().advise(believe(100.0), LIMIT, 0.0, SpeedAdvice()).speed
    half = StoppingSightDistance(sight_share=0.5).advise(believe(100.0), LIMIT, 0.0, SpeedAdvice()).speed
    assert half < full


def test_no_advice_advises_nothing() -> None:
    assert NoAdvice().advise(believe(50.0), LIMIT, 0.0, SpeedAdvice(10.0)) == SpeedAdvice()
    assert {"stopping_sight_distance", "fixed_speed", "none"} <= set(ADVISERS)


def test_a_fixed_speed_is_advised_in_any_fog() -> None:
    for visibility in (20.0, 5000.0):
        assert FixedSpeed(20.0).advise(believe(visibility), LIMIT, 0.0, SpeedAdvice(10.0)).speed == 20.0
