import numpy as np
import pytest

from fogsim.scene.polyline import Chainage, arc_length, at_distance, parallel
from fogsim.values import Lane, LaneMarking


def lane(edge: str, index: int, line: np.ndarray) -> Lane:
    return Lane(f"{edge}_{index}", edge, line, 3.5, 30.0, LaneMarking.DASHED, LaneMarking.DASHED, index == 0)


def test_neighbours_on_a_curve_share_distances_and_edges_count_on() -> None:
    angle = np.linspace(0.0, np.pi / 2, 400)
    outer = 100.0 * np.column_stack((np.sin(angle), 1 - np.cos(angle), np.zeros(len(angle))))
    inner = parallel(outer, 3.5)
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
