import numpy as np
import pytest

from fogsim.scene.chainage import Chainage
from fogsim.scene.lane_index import LaneIndex
from fogsim.scene.polyline import arc_length, at_distance, cleaned, parallel, project, refined
from fogsim.values import Lane, LaneMarking, RoadNetwork


def circle(radius: float, count: int = 400) -> np.ndarray:
    angle = np.linspace(0.0, np.pi / 2, count)
    return np.column_stack((radius * np.sin(angle), radius * (1 - np.cos(angle)), np.zeros(count)))


def test_a_parallel_of_a_circle_is_a_circle() -> None:
    left = parallel(circle(100.0), 10.0)  # the circle turns left around (0, 100)
    assert np.hypot(left[:, 0], left[:, 1] - 100.0) == pytest.approx(90.0, abs=1e-3)


def test_refining_keeps_vertices_and_length() -> None:
    line = np.array([[0.0, 0, 0], [7, 0, 1], [7, 20, 1]])
    fine = refined(line, 3.0)
    assert np.diff(arc_length(fine)).max() <= 3.0
    assert arc_length(fine)[-1] == pytest.approx(27.0)
    assert any(np.allclose(point, line[1]) for point in fine)


def test_doubled_points_are_cleaned_away() -> None:
    assert len(cleaned(np.array([[0.0, 0, 0], [0, 0, 0], [5, 0, 0], [5, 0.001, 0]]))) == 2


def test_projection_inverts_the_place_at_a_distance() -> None:
    line = circle(80.0)
    distance = np.array([0.0, 11.0, 77.7])
    beside = at_distance(line, distance) + np.array([0.0, 0.0, 3.0])
    assert project(beside, line) == pytest.approx(distance, abs=1e-6)


def test_clearance_is_the_distance_to_the_lanes_edge(motorway: RoadNetwork) -> None:
    index = LaneIndex(motorway.lanes)
    points = np.array([[300.0, -5.0, 0.0], [300.0, 0.5, 0.0], [-10.0, 0.0, 0.0], [300.0, -500.0, 0.0]])
    assert index.clearance(points)[:3] == pytest.approx([3.25, -1.25, 8.25])
    assert index.clearance(points)[3] >= 30.0


def test_clearance_on_one_level_passes_under_a_bridge(motorway: RoadNetwork) -> None:
    index = LaneIndex(motorway.lanes)
    assert index.clearance(np.array([[300.0, 0.0, 6.0]]), same_level=2.5)[0] > 0


def lane(edge: str, index: int, line: np.ndarray) -> Lane:
    return Lane(f"{edge}_{index}", edge, line, 3.5, 30.0, LaneMarking.DASHED, LaneMarking.DASHED, index == 0)


def test_neighbours_on_a_curve_share_distances_and_edges_count_on() -> None:
    outer, inner = circle(100.0), parallel(circle(100.0), 3.5)
    onward = outer[-1] + np.array([[0.0, 0, 0], [0, 50.0, 0]])
    lanes = [lane("curve", 0, outer), lane("curve", 1, inner), lane("straight", 0, onward)]
    chainage = Chainage(lanes)
    assert chainage.along(lanes[1], inner) == pytest.approx(chainage.along(lanes[0], outer), abs=0.02)
    assert chainage.along(lanes[2], onward)[0] == pytest.approx(arc_length(outer)[-1])


def test_a_ring_of_edges_has_distances() -> None:
    corners = np.array([[0.0, 0, 0], [50, 0, 0], [50, 50, 0], [0, 50, 0], [0, 0, 0]])
    lanes = [lane(str(i), 0, corners[i : i + 2]) for i in range(4)]
    chainage = Chainage(lanes)
    assert all(np.isfinite(chainage.along(each, each.centreline)).all() for each in lanes)


def test_both_directions_of_a_road_put_the_dashes_of_their_common_line_at_the_same_places() -> None:
    pieces = [np.array([[0.0, 0, 0], [100, 0, 0]]), np.array([[100.0, 0, 0], [231, 0, 0]])]
    there = [lane(f"there{i}", 0, piece) for i, piece in enumerate(pieces)]
    back = [lane(f"back{i}", 0, piece[::-1] + np.array([0, 3.5, 0])) for i, piece in enumerate(pieces)]
    chainage = Chainage([*there, *back])
    for one, other in zip(there, back, strict=True):
        points = at_distance(one.centreline, np.linspace(1.0, 99.0, 50))
        painted = [np.mod(chainage.along(each, points), 18.0) < 6.0 for each in (one, other)]
        assert np.mean(painted[0] == painted[1]) > 0.95
        assert 0.2 < np.mean(painted[0]) < 0.5


def test_a_parallel_on_the_inside_of_a_tight_bend_never_runs_backwards() -> None:
    line = np.array([[0.0, 0, 0], [10, 0, 0], [11, 0.3, 0], [11.6, 1, 0], [11.7, 2, 0], [11.7, 12, 0]])
    inside = parallel(line, 2.2)
    assert len(inside) == len(line)
    forward = np.sum(np.diff(inside[:, :2], axis=0) * np.diff(line[:, :2], axis=0), axis=1)
    assert forward.min() > -1e-6
    # The two straight parts keep their distance, and meet.
    assert inside[0, 1] == pytest.approx(2.2)
    assert inside[-1, 0] == pytest.approx(9.5)
    assert inside[2, :2] == pytest.approx([9.5, 2.2], abs=0.01)


def test_no_points_have_no_clearance(motorway: RoadNetwork) -> None:
    assert len(LaneIndex(motorway.lanes).clearance(np.zeros((0, 3)))) == 0


def test_room_ends_where_a_lane_begins(motorway: RoadNetwork) -> None:
    index = LaneIndex(motorway.lanes)
    place = np.array([[300.0, -8.0, 0.0], [300.0, -8.0, 9.0]])
    toward = np.array([[0.0, 1.0], [0.0, 1.0]])
    # The rightmost lane lies around y = 0 and is 3.5 m wide; nine metres above it there is room.
    assert index.room(place, toward, 20.0, 2.5) == pytest.approx([6.25, 20.0], abs=0.02)
    assert index.room(place, -toward, 20.0, 2.5) == pytest.approx(20.0)
