"""Straight distances between bodies."""

import math

import pytest

from fogsim.conditions.moment import Body, clearance

CAR = Body(0.0, 0.0, 0.0, 4.0, 2.0)


def test_the_distance_between_two_bodies() -> None:
    for other, apart in [
        (Body(14.0, 0.0, 0.0, 4.0, 2.0), 10.0),  # ahead: its rear is at x = 10 m
        (Body(-7.0, 0.0, 0.0, 4.0, 2.0), 3.0),  # behind: the rear is at x = −4 m
        (Body(0.0, 5.0, 0.0, 4.0, 2.0), 3.0),  # next to it: sides at y = 1 m and y = 4 m
        # Oncoming: its front is at x = 3 m, a side at y = 4 m.
        (Body(3.0, 5.0, math.pi, 4.0, 2.0), math.hypot(3.0, 3.0)),
        (Body(2.0, 2.0, math.pi / 4, 1.0, 0.2), None),  # askew: between the nearest corner and the corner of the front
        (Body(-2.0, 3.0, math.pi / 2, 6.0, 0.5), 0.0),  # across it, with no corner in the other
        (CAR, 0.0),
    ]:
        nearest = min(math.hypot(max(x, 0.0), max(y - 1.0, 0.0)) for x, y in other.corners())
        expected = pytest.approx(nearest if apart is None else apart, abs=1e-9)
        assert clearance(CAR, other) == expected
        assert clearance(other, CAR) == expected


def test_points_of_a_body() -> None:
    x, y = Body(10.0, 20.0, math.pi / 2, 4.0, 2.0).behind(3.0, 0.5)
    assert (x, y) == pytest.approx((9.5, 17.0))
