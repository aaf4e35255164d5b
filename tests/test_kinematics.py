import math

import pytest

from fogsim.core.kinematics import decelerated_speed, safe_speed, stopping_sight_distance


def test_aashto_stopping_sight_distances() -> None:
    """AASHTO t = 2.5 s, a = 3.4 m/s²; the book rounds to 65/160/185/220/285 m."""
    for kmh, metres in [(50, 63.1), (90, 154.4), (100, 182.9), (110, 213.7), (130, 282.0)]:
        assert stopping_sight_distance(kmh / 3.6, 2.5, 3.4) == pytest.approx(metres, abs=0.05)


def test_round_trip_and_limits() -> None:
    for distance in (0.0, 1.0, 60.0, 500.0):
        assert stopping_sight_distance(safe_speed(distance, 1.5, 5.0, 0.03), 1.5, 5.0, 0.03) == pytest.approx(distance)
    assert safe_speed(math.inf, 2.5, 3.4) == math.inf


def test_uphill_stops_sooner() -> None:
    assert stopping_sight_distance(30.0, 2.5, 3.4, 0.05) < stopping_sight_distance(30.0, 2.5, 3.4)


def test_decelerated_speed_brakes_no_harder_than_asked() -> None:
    assert decelerated_speed(30.0, 10.0, 2.0, 0.1) == pytest.approx(29.8)
    assert decelerated_speed(10.1, 10.0, 2.0, 0.1) == 10.0
    assert decelerated_speed(5.0, 10.0, 2.0, 0.1) == 10.0
    assert decelerated_speed(30.0, math.inf, 2.0, 0.1) == math.inf
