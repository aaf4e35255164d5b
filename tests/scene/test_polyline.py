"""Polylines, distances along roads, and compiled work on many lines, which is numpy's one by one, to the bit."""

import numpy as np
import pytest
from numpy.typing import NDArray

from fogsim.scene import polyline
from fogsim.values import Lane, LaneMarking


def circle(radius: float, count: int = 400) -> np.ndarray:
    angle = np.linspace(0.0, np.pi / 2, count)
    return np.column_stack((radius * np.sin(angle), radius * (1 - np.cos(angle)), np.zeros(count)))


def test_a_parallel_of_a_circle_is_a_circle() -> None:
    left = polyline.parallel(circle(100.0), 10.0)  # the circle turns left around (0, 100)
    assert np.hypot(left[:, 0], left[:, 1] - 100.0) == pytest.approx(90.0, abs=1e-3)


def test_refining_keeps_vertices_and_length_and_doubled_points_are_cleaned_away() -> None:
    line = np.array([[0.0, 0, 0], [7, 0, 1], [7, 20, 1]])
    fine = polyline.refined(line, 3.0)
    assert np.diff(polyline.arc_length(fine)).max() <= 3.0
    assert polyline.arc_length(fine)[-1] == pytest.approx(27.0)
    assert any(np.allclose(point, line[1]) for point in fine)
    assert len(polyline.cleaned(np.array([[0.0, 0, 0], [0, 0, 0], [5, 0, 0], [5, 0.001, 0]]))) == 2


def test_projection_inverts_the_place_at_a_distance() -> None:
    line = circle(80.0)
    distance = np.array([0.0, 11.0, 77.7])
    beside = polyline.at_distance(line, distance) + np.array([0.0, 0.0, 3.0])
    assert polyline.project(beside, line) == pytest.approx(distance, abs=1e-6)


def test_a_parallel_on_the_inside_of_a_tight_bend_never_runs_backwards() -> None:
    line = np.array([[0.0, 0, 0], [10, 0, 0], [11, 0.3, 0], [11.6, 1, 0], [11.7, 2, 0], [11.7, 12, 0]])
    inside = polyline.parallel(line, 2.2)
    assert len(inside) == len(line)
    forward = np.sum(np.diff(inside[:, :2], axis=0) * np.diff(line[:, :2], axis=0), axis=1)
    assert forward.min() > -1e-6
    # The two straight parts keep their distance, and meet.
    assert inside[0, 1] == pytest.approx(2.2)
    assert inside[-1, 0] == pytest.approx(9.5)
    assert inside[2, :2] == pytest.approx([9.5, 2.2], abs=0.01)


def test_spans_are_the_stretches_between_changes() -> None:
    chosen = np.array([True, True, False, True, False, False, True, True, True])
    assert polyline.true_spans(chosen) == [(0, 2), (3, 4), (6, 9)]
    assert polyline.true_spans(chosen, least=2) == [(0, 2), (6, 9)]
    assert polyline.true_spans(np.zeros(3, np.bool_)) == []
    assert polyline.true_spans(np.ones(3, np.bool_)) == [(0, 3)]


def _lines() -> list[NDArray[np.float64]]:
    rng = np.random.default_rng(5)
    lines = [np.cumsum(rng.normal(size=(count, 3)) * (9.0, 9.0, 0.1), axis=0) for count in rng.integers(2, 7, 40)]
    lines[3] = np.repeat(lines[3], 2, axis=0)
    return lines


def test_many_lines_are_cleaned_and_refined_as_each_alone() -> None:
    lines = _lines()
    alone = [polyline.refined(polyline.cleaned(line), 4.0) for line in lines]
    points, counts = polyline.refined_lines(lines, 4.0)
    np.testing.assert_array_equal(points, np.concatenate(alone))
    assert counts.tolist() == [len(line) for line in alone]
    for line, same in zip(lines, polyline.all_cleaned(lines), strict=True):
        np.testing.assert_array_equal(same, polyline.cleaned(line))
    assert polyline.all_cleaned([]) == []
    for line in _lines():
        length = polyline.arc_length(line)
        distance = np.concatenate((np.linspace(-1.0, length[-1] + 1.0, 17), length))
        expected = np.stack([np.interp(distance, length, line[:, axis]) for axis in range(3)], axis=1)
        np.testing.assert_array_equal(polyline.at_distance(line, distance), expected)


def lane(edge: str, index: int, line: np.ndarray) -> Lane:
    return Lane(f"{edge}_{index}", edge, line, 3.5, 30.0, LaneMarking.DASHED, LaneMarking.DASHED, index == 0)


def test_neighbours_on_a_curve_share_distances_and_edges_count_on() -> None:
    angle = np.linspace(0.0, np.pi / 2, 400)
    outer = 100.0 * np.column_stack((np.sin(angle), 1 - np.cos(angle), np.zeros(len(angle))))
    inner = polyline.parallel(outer, 3.5)
    onward = outer[-1] + np.array([[0.0, 0, 0], [0, 50.0, 0]])
    lanes = [lane("curve", 0, outer), lane("curve", 1, inner), lane("straight", 0, onward)]
    chainage = polyline.Chainage(lanes)
    assert chainage.along(lanes[1], inner) == pytest.approx(chainage.along(lanes[0], outer), abs=0.02)
    assert chainage.along(lanes[2], onward)[0] == pytest.approx(polyline.arc_length(outer)[-1])
    corners = np.array([[0.0, 0, 0], [50, 0, 0], [50, 50, 0], [0, 50, 0], [0, 0, 0]])
    lanes = [lane(str(i), 0, corners[i : i + 2]) for i in range(4)]
    chainage = polyline.Chainage(lanes)
    assert all(np.isfinite(chainage.along(each, each.centreline)).all() for each in lanes)


def test_both_directions_of_a_road_put_the_dashes_of_their_common_line_at_the_same_places() -> None:
    pieces = [np.array([[0.0, 0, 0], [100, 0, 0]]), np.array([[100.0, 0, 0], [231, 0, 0]])]
    there = [lane(f"there{i}", 0, piece) for i, piece in enumerate(pieces)]
    back = [lane(f"back{i}", 0, piece[::-1] + np.array([0, 3.5, 0])) for i, piece in enumerate(pieces)]
    chainage = polyline.Chainage([*there, *back])
    for one, other in zip(there, back, strict=True):
        points = polyline.at_distance(one.centreline, np.linspace(1.0, 99.0, 50))
        painted = [np.mod(chainage.along(each, points), 18.0) < 6.0 for each in (one, other)]
        assert np.mean(painted[0] == painted[1]) > 0.95
        assert 0.2 < np.mean(painted[0]) < 0.5
