"""Rows that are computed at some of their pixels: which ones, and what the others get."""

import numpy as np
import pytest
from numpy.typing import NDArray

from fogsim.atmosphere.lamps import pieces

PLANE = (1.0 / (0.02 + 0.00001 * np.arange(101))).astype(np.float32)


def read(length: NDArray[np.float32], step: int, values: NDArray[np.float32]) -> tuple[int, NDArray[np.float32]]:
    """How many pixels are chosen, and what a row's values become where only theirs are known."""
    size = len(length)
    rows = pieces.row_pieces(size, step)
    count = int(pieces.choose_pixels(length, rows))
    pixel, chosen = rows.pixel[:count].astype(int), rows.length[:count]
    known, out = pieces.values_of_row(size), pieces.values_of_row(size)
    known[:count] = values[pixel]
    assert np.array_equal(chosen, length[pixel])
    if step == 1:
        return count, known[:size]
    pieces.spread_over_row(known, rows, out)
    return count, out[:size]


def test_a_plane_is_known_by_the_ends_of_its_pieces_and_about_an_edge_by_every_pixel() -> None:
    values = np.linspace(3.0, 5.0, 101, dtype=np.float32)
    count, out = read(PLANE, 8, values)
    assert count == 14
    assert out == pytest.approx(values, rel=1e-5)
    length = PLANE.copy()
    length[50:] *= np.float32(0.5)
    values = np.where(np.arange(101) < 50, 3.0, 7.0).astype(np.float32)
    count, out = read(length, 8, values)
    assert 14 < count < 40
    assert np.array_equal(out, values)
    values = np.sin(np.arange(101)).astype(np.float32)
    assert read(PLANE, 1, values)[0] == 101
    assert np.array_equal(read(PLANE, 1, values)[1], values)
    for focal_length, pixels in [(50.0, 1), (144.0, 1), (576.9, 6), (5000.0, 8)]:
        assert pieces.piece_length(focal_length) == pixels


@pytest.mark.parametrize("step", range(2, 9))
def test_an_edge_anywhere_is_seen_whatever_the_length_of_pieces(step: int) -> None:
    for edge in range(1, 101):
        nearer = np.arange(101) >= edge
        length = np.where(nearer, np.float32(0.5) * PLANE, PLANE)
        values = np.where(nearer, 7.0, 3.0).astype(np.float32)
        count, out = read(length, step, values)
        assert count < 101 // step + 3 * step + 2
        assert np.array_equal(out, values)


def test_points_lie_at_their_distance_along_the_ray() -> None:
    ray_map = np.array([[0.01, 0.0, -0.5], [0.0, 0.01, -0.3], [0.0, 0.0, 1.0]], np.float32)
    pixel, length, points = np.array([0, 100], np.float32), np.array([20, 30], np.float32), np.empty((3, 2), np.float32)
    pieces.row_points(np.uint64(2), ray_map, 30, pixel, length, points)
    assert np.linalg.norm(points, axis=0) == pytest.approx(length, rel=1e-6)
    assert points[:2] / points[2] == pytest.approx(np.array([[-0.5, 0.5], [0.0, 0.0]]), abs=1e-6)
