"""highway-env's lanes as FogSim's: axes, ids and stations."""

import numpy as np
import pytest

pytest.importorskip("highway_env")

from highway_env.road.lane import StraightLane

from fogsim.traffic.highway.network import lane_id, speed_limit, station_along, upright


def test_y_points_up_and_the_road_is_level() -> None:
    points = upright([[1.0, 2.0], [3.0, -4.0]])
    assert points.tolist() == [[1.0, -2.0, 0.0], [3.0, 4.0, 0.0]]
    assert not np.signbit(upright([0.0, 0.0])).any()


def test_stations_along_a_polyline_are_a_round_trip() -> None:
    line = np.array([[0.0, 0.0, 0.0], [30.0, 40.0, 0.0], [30.0, 140.0, 0.0]])
    assert station_along(line, np.array([30.0, 90.0, 0.0])) == (pytest.approx(100.0), pytest.approx(150.0))
    # A point beside the line counts at its nearest place, one beyond an end at that end.
    aside = 0.3 * line[1] + 2.0 * np.array([-0.8, 0.6, 0.0])
    assert station_along(line, aside)[0] == pytest.approx(15.0)
    assert station_along(line, np.array([-5.0, -5.0, 0.0]))[0] == 0.0
    assert station_along(line, np.array([30.0, 999.0, 0.0]))[0] == pytest.approx(150.0)


def test_a_lane_without_a_limit_has_the_highest_speed_of_vehicles() -> None:
    lanes = [StraightLane([0, 0], [100, 0], speed_limit=limit) for limit in (20.0, None)]
    assert speed_limit(lanes[0]) == 20.0
    assert speed_limit(lanes[1]) == pytest.approx(40.0)
    assert lane_id(("a", "b", 2)) == "a>b_2"
