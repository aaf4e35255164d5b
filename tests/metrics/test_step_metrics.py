import math

import pytest

from fogsim.metrics import SafetyStandard, deceleration_rate_to_avoid_crash, step_metrics, time_to_collision
from fogsim.recorders import DERIVED_QUANTITIES
from fogsim.units import finite_or_none
from fogsim.values import Leader
from tests.recorders.synthetic import make_step


def test_keys_are_those_that_recorders_are_promised() -> None:
    assert set(step_metrics(make_step())) == set(DERIVED_QUANTITIES)


def test_conflict_with_a_leader() -> None:
    derived = step_metrics(make_step(speed=25.0, leader=Leader("other", 20.0, 20.0)))
    assert derived["time_to_collision_s"] == pytest.approx(4.0)
    assert derived["drac_mps2"] == pytest.approx(0.625)


def test_no_leader_and_contact_leave_the_measures_undefined() -> None:
    assert step_metrics(make_step())["time_to_collision_s"] is None
    assert step_metrics(make_step())["drac_mps2"] is None
    touching = step_metrics(make_step(speed=25.0, leader=Leader("other", 0.0, 20.0)))
    assert touching["time_to_collision_s"] == 0.0
    assert touching["drac_mps2"] is None


def test_the_leader_is_measured_as_everybody_is() -> None:
    for ahead in [0.0, 20.0, 25.0, 30.0]:
        for gap in [-1.0, 0.0, 7.0]:
            derived = step_metrics(make_step(speed=25.0, leader=Leader("other", gap, ahead)))
            assert derived["time_to_collision_s"] == finite_or_none(float(time_to_collision(gap, 25.0, ahead)))
            assert derived["drac_mps2"] == finite_or_none(float(deceleration_rate_to_avoid_crash(gap, 25.0, ahead)))


def test_margin_is_visibility_ahead_minus_the_aashto_stopping_sight_distance_of_100_kmh() -> None:
    derived = step_metrics(make_step(speed=100 / 3.6, visibility=500.0, visibility_ahead=150.0))
    assert derived["stopping_sight_distance_m"] == pytest.approx(182.9, abs=0.05)
    assert derived["visibility_margin_m"] == pytest.approx(150.0 - 182.9, abs=0.05)


def test_the_standard_decides_the_stopping_sight_distance() -> None:
    alert = SafetyStandard(reaction_time=1.0, deceleration=5.0)
    assert step_metrics(make_step(speed=20.0), alert)["stopping_sight_distance_m"] == pytest.approx(20.0 + 40.0)


def test_clear_air_limits_nothing() -> None:
    assert step_metrics(make_step(visibility=math.inf))["visibility_margin_m"] is None
