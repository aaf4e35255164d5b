"""highway-env's lanes as FogSim's: axes, ids and stations."""

import numpy as np
import pytest

pytest.importorskip("highway_env")

from highway_env.road.lane import StraightLane

from fogsim.traffic.highway.network import lane_id, speed_limit, upright


def test_y_points_up_and_the_road_is_level() -> None:
    points = upright([[1.0, 2.0], [3.0, -4.0]])
    assert points.tolist() == [[1.0, -2.0, 0.0], [3.0, 4.0, 0.0]]
    assert not np.signbit(upright([0.0, 0.0])).any()


def test_a_lane_without_a_limit_has_the_highest_speed_of_vehicles() -> None:
    lanes = [StraightLane([0, 0], [100, 0], speed_limit=limit) for limit in (20.0, None)]
    assert speed_limit(lanes[0]) == 20.0
    assert speed_limit(lanes[1]) == pytest.approx(40.0)
    assert lane_id(("a", "b", 2)) == "a>b_2"
