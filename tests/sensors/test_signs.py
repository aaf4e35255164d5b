import math

import numpy as np
import pytest

from fogsim.sensors import signs_ahead
from fogsim.values import Sign, SignMap


def sign(name: str, x: float, y: float, heading: float = 0.0) -> Sign:
    return Sign(name, "speed_limit", 30.0, (x, y, 2.6), heading, 0.9)


def test_only_signs_ahead_that_face_the_vehicle_nearest_first() -> None:
    signs = SignMap(
        (
            sign("far", 180.0, -6.0),
            sign("near", 40.0, -6.0),
            sign("behind", -5.0, -6.0),
            sign("oncoming", 60.0, 6.0, math.pi),
            sign("elsewhere", 50.0, 80.0),
            sign("too far", 400.0, -6.0),
        )
    )
    seen = signs_ahead(signs, np.zeros(3), 0.0, reach=250.0)
    assert [s.sign_id for s in seen] == ["near", "far"]


def test_distance_and_offset_in_the_vehicles_frame() -> None:
    (seen,) = signs_ahead(SignMap((sign("s", 3.0, 50.0, math.pi / 2),)), np.zeros(3), math.pi / 2, reach=100.0)
    assert seen.distance == pytest.approx(50.0)
    assert seen.lateral == pytest.approx(-3.0)  # to the right


def test_height_counts_from_the_road_and_facing_from_square() -> None:
    face = Sign("s", "stop", 0.0, (-50.0, -4.0, 12.5), 0.1 - math.pi, 0.9)
    (seen,) = signs_ahead(SignMap((face,)), np.array([0.0, 0.0, 10.0]), math.pi, reach=100.0)
    assert seen.height == pytest.approx(2.5)
    assert seen.facing == pytest.approx(0.1)


def test_uphill_a_sign_stands_as_high_above_the_road_as_on_the_level() -> None:
    grade = math.radians(4.0)
    face = Sign("s", "stop", 0.0, (80.0, -4.0, 80.0 * math.tan(grade) + 2.5), 0.0, 0.9)
    (seen,) = signs_ahead(SignMap((face,)), np.zeros(3), 0.0, reach=100.0, grade=grade)
    assert seen.height == pytest.approx(2.5 * math.cos(grade))
