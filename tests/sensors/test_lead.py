import numpy as np
import pytest

from fogsim.sensors import LeadSensor, measure_lead
from fogsim.values import Leader

SENSOR = LeadSensor(reach=150.0, distance_deviation=0.5, speed_deviation=0.2)


def test_mean_and_spread_of_measurements() -> None:
    rng = np.random.default_rng(0)
    measured = [measure_lead(Leader("lead", 60.0, 20.0), 25.0, SENSOR, rng) for _ in range(4000)]
    distances = np.array([m.distance for m in measured if m])
    speeds = np.array([m.relative_speed for m in measured if m])
    assert distances.mean() == pytest.approx(60.0, abs=0.03)
    assert distances.std() == pytest.approx(0.5, rel=0.05)
    assert speeds.mean() == pytest.approx(-5.0, abs=0.015)


def test_nothing_within_reach() -> None:
    rng = np.random.default_rng(0)
    assert measure_lead(None, 25.0, SENSOR, rng) is None
    assert measure_lead(Leader("lead", 151.0, 20.0), 25.0, SENSOR, rng) is None


def test_draws_do_not_depend_on_there_being_a_leader() -> None:
    one, other = np.random.default_rng(1), np.random.default_rng(1)
    measure_lead(None, 0.0, SENSOR, one)
    measure_lead(Leader("lead", 10.0, 1.0), 0.0, SENSOR, other)
    assert one.random() == other.random()


def test_a_distance_is_never_negative() -> None:
    rng = np.random.default_rng(2)
    assert all(measure_lead(Leader("lead", 0.0, 0.0), 0.0, SENSOR, rng).distance >= 0.0 for _ in range(50))
