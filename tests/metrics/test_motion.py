"""How the ego drove: figures by hand."""

import math

import pytest

from fogsim.values import Ending, Leader
from tests.metrics.summaries import summarise
from tests.recorders.synthetic import make_step


def test_distance_and_speed_with_uneven_steps() -> None:
    steps = [
        make_step(0, time=1.0, speed=10.0, route_position=100.0),
        make_step(1, time=1.5, speed=20.0, route_position=110.0),
        make_step(2, time=3.0, speed=12.0, route_position=130.0, ending=Ending.ARRIVED),
    ]
    summary = summarise(steps)
    assert summary["duration_s"] == pytest.approx(2.0)
    assert summary["distance_m"] == pytest.approx(30.0)
    assert summary["mean_speed_mps"] == pytest.approx(15.0)
    assert summary["max_speed_mps"] == 20.0
    assert summary["ending"] == "arrived"
    assert summary["steps"] == 3


def test_times_add_up_without_noise() -> None:
    steps = [make_step(i, time=i / 10, speed=25.0, leader=Leader("other", 5.0, 20.0)) for i in range(39)]
    summary = summarise(steps, time_to_collision=4.0)
    assert summary["duration_s"] == 3.8
    assert summary["time_exposed_time_to_collision_s"] == 3.8


def test_braking_and_jerk() -> None:
    accelerations = (0.0, -2.0, -2.0, 0.5)
    summary = summarise(make_step(i, time=0.5 * i, acceleration=a) for i, a in enumerate(accelerations))
    assert summary["max_deceleration_mps2"] == 2.0
    assert summary["rms_jerk_mps3"] == pytest.approx(math.sqrt((4.0**2 + 0.0 + 5.0**2) / 3))


def test_speed_above_the_advice_counts_only_while_there_is_one() -> None:
    advised = (math.inf, math.inf, 20.0, 25.0, 24.9)
    summary = summarise(make_step(i, time=float(i), speed=25.0, advised=a) for i, a in enumerate(advised))
    assert summary["advised_time_share"] == pytest.approx(3 / 4)
    assert summary["mean_advised_speed_mps"] == pytest.approx((20.0 + 25.0 + 24.9) / 3)
    assert summary["above_advice_time_share"] == pytest.approx(1 / 4)
    strict = summarise((make_step(i, time=float(i), advised=a) for i, a in enumerate(advised)), advice_tolerance=0.0)
    assert strict["above_advice_time_share"] == pytest.approx(2 / 4)


def test_compliance_is_by_the_time_with_an_advice_and_changes_are_by_the_way() -> None:
    advised = (math.inf, 20.0, 20.1, 25.0, 24.9, math.inf)
    summary = summarise(make_step(i, time=float(i), speed=25.0, advised=a) for i, a in enumerate(advised))
    assert summary["advice_compliance_share"] == pytest.approx(2 / 4)
    # It appears, rises to 25 m/s and ends; a tenth of a metre a second is no change.
    assert summary["advice_changes_per_km"] == pytest.approx(3 / 0.125)
