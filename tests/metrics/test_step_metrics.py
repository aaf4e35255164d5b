import pytest

from fogsim.metrics import deceleration_rate_to_avoid_crash, step_metrics, time_to_collision
from fogsim.recorders import DERIVED_QUANTITIES
from fogsim.units import finite_or_none
from fogsim.values import Leader
from tests.recorders.synthetic import make_step


def test_keys_are_those_that_recorders_are_promised() -> None:
    assert set(step_metrics(make_step())) == set(DERIVED_QUANTITIES)


def test_the_leader_is_measured_as_all_vehicles_are() -> None:
    alone = step_metrics(make_step())
    assert alone["time_to_collision_s"] is alone["drac_mps2"] is None
    for ahead in [0.0, 20.0, 25.0, 30.0]:
        for gap in [-1.0, 0.0, 7.0]:
            derived = step_metrics(make_step(speed=25.0, leader=Leader("other", gap, ahead)))
            assert derived["time_to_collision_s"] == finite_or_none(float(time_to_collision(gap, 25.0, ahead)))
            assert derived["drac_mps2"] == finite_or_none(float(deceleration_rate_to_avoid_crash(gap, 25.0, ahead)))


def test_margin_is_visibility_ahead_minus_the_aashto_stopping_sight_distance_of_100_kmh() -> None:
    derived = step_metrics(make_step(speed=100 / 3.6, visibility=500.0, visibility_ahead=150.0))
    assert derived["stopping_sight_distance_m"] == pytest.approx(182.9, abs=0.05)
    assert derived["visibility_margin_m"] == pytest.approx(150.0 - 182.9, abs=0.05)
