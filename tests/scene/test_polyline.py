import numpy as np
import pytest

from fogsim.scene.polyline import arc_length, at_distance, cleaned, parallel, project, refined, true_spans


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


def test_spans_are_the_stretches_between_changes() -> None:
    chosen = np.array([True, True, False, True, False, False, True, True, True])
    assert true_spans(chosen) == [(0, 2), (3, 4), (6, 9)]
    assert true_spans(chosen, least=2) == [(0, 2), (6, 9)]
    assert true_spans(np.zeros(3, np.bool_)) == []
    assert true_spans(np.ones(3, np.bool_)) == [(0, 3)]
