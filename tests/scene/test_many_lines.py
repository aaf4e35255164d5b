"""Compiled work on lines is what numpy does with them, one by one, to the bit."""

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.polyline import all_cleaned, arc_length, at_distance, cleaned, refined, refined_lines


def _lines() -> list[NDArray[np.float64]]:
    rng = np.random.default_rng(5)
    lines = [np.cumsum(rng.normal(size=(count, 3)) * (9.0, 9.0, 0.1), axis=0) for count in rng.integers(2, 7, 40)]
    lines[3] = np.repeat(lines[3], 2, axis=0)
    return lines


def test_many_lines_are_cleaned_and_refined_as_each_alone() -> None:
    lines = _lines()
    alone = [refined(cleaned(line), 4.0) for line in lines]
    points, counts = refined_lines(lines, 4.0)
    np.testing.assert_array_equal(points, np.concatenate(alone))
    assert counts.tolist() == [len(line) for line in alone]
    for line, same in zip(lines, all_cleaned(lines), strict=True):
        np.testing.assert_array_equal(same, cleaned(line))
    assert all_cleaned([]) == []


def test_places_along_a_line_are_interpolated_as_by_numpy() -> None:
    for line in _lines():
        length = arc_length(line)
        distance = np.concatenate((np.linspace(-1.0, length[-1] + 1.0, 17), length))
        expected = np.stack([np.interp(distance, length, line[:, axis]) for axis in range(3)], axis=1)
        np.testing.assert_array_equal(at_distance(line, distance), expected)
