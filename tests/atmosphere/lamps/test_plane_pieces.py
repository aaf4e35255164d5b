"""Pixels that are chosen on planes, and values between them."""

import numpy as np
import pytest
from numpy.typing import NDArray

from fogsim.atmosphere.lamps.road_glow import choose_pixels, piece_length, row_points, spread_over_row

PLANE = (1.0 / (0.02 + 0.00001 * np.arange(101))).astype(np.float32)


def read(length: NDArray[np.float32], step: int, values: NDArray[np.float32]) -> tuple[int, NDArray[np.float32]]:
    """How many pixels are chosen, and what a row's values become where only theirs are known."""
    size = len(length)
    inverse, bent = np.empty(size, np.float32), np.empty(size, np.uint8)
    pixel, chosen = np.empty(size, np.float32), np.empty(size, np.float32)
    first, even, out = np.empty(size, np.uint64), np.empty(size, np.bool_), np.empty(size, np.float32)
    count = int(choose_pixels(length, step, inverse, bent, pixel, chosen, first, even))
    known = np.zeros(size, np.float32)
    known[:count] = values[pixel[:count].astype(int)]
    assert np.array_equal(chosen[:count], length[pixel[:count].astype(int)])
    spread_over_row(known, step, first, even, out)
    return count, out


def test_pieces_are_as_wide_as_light_allows() -> None:
    for focal_length, pixels in [(50.0, 1), (144.0, 1), (576.9, 6), (5000.0, 8)]:
        assert piece_length(focal_length) == pixels


def test_a_plane_is_known_by_the_ends_of_its_pieces() -> None:
    values = np.linspace(3.0, 5.0, 101, dtype=np.float32)
    count, out = read(PLANE, 8, values)
    assert count == 14
    assert out == pytest.approx(values, rel=1e-5)


def test_every_pixel_about_an_edge_is_chosen() -> None:
    length = PLANE.copy()
    length[50:] *= np.float32(0.5)
    values = np.where(np.arange(101) < 50, 3.0, 7.0).astype(np.float32)
    count, out = read(length, 8, values)
    assert 14 < count < 40
    assert np.array_equal(out, values)


def test_a_step_of_one_is_every_pixel() -> None:
    values = np.sin(np.arange(101)).astype(np.float32)
    assert read(PLANE, 1, values)[0] == 101
    assert np.array_equal(read(PLANE, 1, values)[1], values)


def test_points_lie_at_their_distance_along_the_ray() -> None:
    ray_map = np.array([[0.01, 0.0, -0.5], [0.0, 0.01, -0.3], [0.0, 0.0, 1.0]], np.float32)
    pixel, length, points = np.array([0, 100], np.float32), np.array([20, 30], np.float32), np.empty((3, 2), np.float32)
    row_points(np.uint64(2), ray_map, 30, pixel, length, points)
    assert np.linalg.norm(points, axis=0) == pytest.approx(length, rel=1e-6)
    assert points[:2] / points[2] == pytest.approx(np.array([[-0.5, 0.5], [0.0, 0.0]]), abs=1e-6)
