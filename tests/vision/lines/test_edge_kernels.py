"""Canny's edges are OpenCV's where no two neighbours are alike, and those of a mirrored image are mirrored anyway."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from fogsim.vision.lines.edge_kernels import squared_lengths, trace_edges

LOW, HIGH = 600.0, 1200.0


def edges(across: NDArray[np.floating], down: NDArray[np.floating], slope: float = 0.0) -> NDArray[np.uint8]:
    """Edges of a gradient."""
    rows, cols = across.shape
    side, height = (np.ascontiguousarray(part, np.float32) for part in (across, down))
    squares, pixels = np.zeros((rows + 2, cols + 2), np.float32), np.full((rows, cols), 7, np.uint8)
    squared_lengths(side, height, np.full(rows, slope, np.float32), squares)
    trace_edges(side, height, squares, LOW, HIGH, pixels)
    return pixels


def gradient(seed: int, size: tuple[int, int] = (60, 90)) -> tuple[NDArray[np.int16], NDArray[np.int16]]:
    """Gradient in whole numbers of a random picture, such as 16 bits hold."""
    rng = np.random.default_rng(seed)
    smooth = cv2.GaussianBlur(rng.normal(0.0, 1.0, size), (0, 0), 3.0)
    parts = (cv2.Sobel(smooth, cv2.CV_64F, *order, scale=6e4 / 8) for order in ((1, 0), (0, 1)))
    across, down = (np.rint(part).astype(np.int16) for part in parts)
    return across, down


@pytest.mark.parametrize("seed", range(5))
def test_edges_are_those_of_opencv(seed: int) -> None:
    across, down = gradient(seed)
    squares = across.astype(np.int64) ** 2 + down.astype(np.int64) ** 2
    assert not ((squares[:, 1:] == squares[:, :-1]) & (squares[:, 1:] > LOW**2)).any()
    expected = cv2.Canny(across, down, LOW, HIGH, L2gradient=True)
    assert 0.01 < (expected > 0).mean() < 0.3
    np.testing.assert_array_equal(edges(across, down), expected)
    # The slope is taken off before.
    np.testing.assert_array_equal(edges(across, down + 400, slope=400.0), expected)


@pytest.mark.parametrize("seed", range(5))
def test_edges_of_a_mirrored_image_are_mirrored(seed: int) -> None:
    """Gradients in steps of 300 have many equal neighbours."""
    across, down = (np.round(part / 300.0) * 300.0 for part in gradient(seed))
    found = edges(across, down)
    assert found.any()
    np.testing.assert_array_equal(edges(-across[:, ::-1], down[:, ::-1])[:, ::-1], found)


def test_a_weak_ridge_is_an_edge_only_with_a_steep_one() -> None:
    across = np.zeros((12, 21))
    across[:, 5] = across[:, 15] = 0.5 * (LOW + HIGH)
    across[3, 15] = HIGH + 1.0
    found = edges(across, np.zeros_like(across))
    assert (found[:, 15] == 255).all()
    assert not found[:, :15].any()


def test_edges_reach_the_border_and_nothing_is_no_edge() -> None:
    across = np.full((6, 6), 2.0 * HIGH)
    # A level hill has no ridge but its two rims.
    assert edges(across, np.zeros_like(across))[:, [0, 5]].all()
    assert not edges(across, np.zeros_like(across))[:, 1:5].any()
    assert not edges(np.zeros((6, 6)), np.zeros((6, 6))).any()
