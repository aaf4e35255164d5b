import numpy as np
import pytest

from fogsim.scene.lane_index import LaneIndex
from fogsim.values import RoadNetwork


def test_clearance_is_the_distance_to_the_lanes_edge(motorway: RoadNetwork) -> None:
    index = LaneIndex(motorway.lanes)
    points = np.array([[300.0, -5.0, 0.0], [300.0, 0.5, 0.0], [-10.0, 0.0, 0.0], [300.0, -500.0, 0.0]])
    assert index.clearance(points)[:3] == pytest.approx([3.25, -1.25, 8.25])
    assert index.clearance(points)[3] >= 30.0
    assert index.clearance(np.array([[300.0, 0.0, 6.0]]), same_level=2.5)[0] > 0  # as under a bridge
    assert len(index.clearance(np.zeros((0, 3)))) == 0


def test_room_ends_where_a_lane_begins(motorway: RoadNetwork) -> None:
    index = LaneIndex(motorway.lanes)
    place = np.array([[300.0, -8.0, 0.0], [300.0, -8.0, 9.0]])
    toward = np.array([[0.0, 1.0], [0.0, 1.0]])
    # The rightmost lane lies around y = 0 and is 3.5 m wide; nine metres above it there is room.
    assert index.room(place, toward, 20.0, 2.5) == pytest.approx([6.25, 20.0], abs=0.02)
    assert index.room(place, -toward, 20.0, 2.5) == pytest.approx(20.0)
