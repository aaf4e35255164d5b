"""Edges of images, without those that fog draws; OpenCV's where no two neighbours are alike."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from fogsim.vision.lines.edges import MIN_GRADIENT, EdgeDetector, edge_map, peak_offset, squared_lengths, trace_edges


def step(rows=60, cols=80, at=30, low=60.0, high=100.0):
    image = np.full((rows, cols), low, np.float32)
    image[:, at:] = high
    return image


def test_derivatives_of_a_ramp_are_its_slopes_a_step_is_an_edge_and_grain_raises_the_threshold():
    v, u = np.mgrid[:40, :50].astype(np.float32)
    gradient = edge_map(2.0 * u - 3.0 * v, np.zeros(40, np.float32)).gradient
    assert gradient.across[1:-1, 1:-1] == pytest.approx(2.0)
    assert gradient.down[1:-1, 1:-1] == pytest.approx(-3.0)
    edges = edge_map(step(), np.zeros(60, np.float32))
    assert set(np.nonzero(edges.pixels)[1]) <= {29, 30}
    assert edges.pixels.any(axis=1).all()
    assert edges.threshold == MIN_GRADIENT
    noisy = step() + np.random.default_rng(2).normal(0.0, 6.0, (60, 80)).astype(np.float32)
    edges = edge_map(noisy, np.zeros(60, np.float32))
    assert edges.threshold > 5.0 * MIN_GRADIENT


@pytest.mark.parametrize(("fall", "left"), [(3.0, 0.0), (6.0, -2.0), (-3.0, 3.0)])
def test_fog_may_take_off_so_much_of_a_row_and_no_more(fall, left):
    """A brightening upward by `fall` a row: what fog can make is taken off, the rest stays; it darkens nothing."""
    image = np.repeat(np.linspace(200.0, 200.0 - fall * 39, 40, dtype=np.float32)[:, None], 50, axis=1)
    down = edge_map(image, np.full(40, 4.0, np.float32)).gradient.down
    assert down[1:-1] == pytest.approx(left, abs=1e-4)


def test_a_detector_takes_images_of_another_size_and_an_even_one_has_no_edges():
    def along(image, across, down):
        across[:], down[:] = np.gradient(image, axis=1), np.gradient(image, axis=0)

    detector = EdgeDetector(along, of_row=4, of_road=2)
    assert detector(step(), None).pixels.any()
    even = detector(np.full((20, 30), 90.0, np.float32), None)
    assert even.pixels.shape == (20, 30)
    assert not even.pixels.any()


def test_a_parabola_peaks_where_its_formula_says():
    assert peak_offset(*(5.0 - (x - 0.3) ** 2 for x in (-1.0, 0.0, 1.0))) == pytest.approx(0.3)
    assert peak_offset(3.0, 1.0, 2.0) == peak_offset(1.0, 2.0, 3.0) == 0.0


LOW, HIGH = 600.0, 1200.0


def edges_of(across: NDArray[np.floating], down: NDArray[np.floating], slope: float = 0.0) -> NDArray[np.uint8]:
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


@pytest.mark.parametrize("seed", range(2))
def test_edges_are_those_of_opencv(seed: int) -> None:
    across, down = gradient(seed)
    squares = across.astype(np.int64) ** 2 + down.astype(np.int64) ** 2
    assert not ((squares[:, 1:] == squares[:, :-1]) & (squares[:, 1:] > LOW**2)).any()
    expected = cv2.Canny(across, down, LOW, HIGH, L2gradient=True)
    assert 0.01 < (expected > 0).mean() < 0.3
    np.testing.assert_array_equal(edges_of(across, down), expected)
    # The slope is taken off before.
    np.testing.assert_array_equal(edges_of(across, down + 400, slope=400.0), expected)


@pytest.mark.parametrize("seed", range(2))
def test_edges_of_a_mirrored_gradient_are_mirrored(seed: int) -> None:
    """Gradients in steps of 300 have many equal neighbours."""
    across, down = (np.round(part / 300.0) * 300.0 for part in gradient(seed))
    found = edges_of(across, down)
    assert found.any()
    np.testing.assert_array_equal(edges_of(-across[:, ::-1], down[:, ::-1])[:, ::-1], found)


def test_a_weak_ridge_is_an_edge_only_with_a_steep_one_and_edges_reach_the_border() -> None:
    across = np.zeros((12, 21))
    across[:, 5] = across[:, 15] = 0.5 * (LOW + HIGH)
    across[3, 15] = HIGH + 1.0
    found = edges_of(across, np.zeros_like(across))
    assert (found[:, 15] == 255).all()
    assert not found[:, :15].any()
    across = np.full((6, 6), 2.0 * HIGH)
    # A level hill has no ridge but its two rims.
    assert edges_of(across, np.zeros_like(across))[:, [0, 5]].all()
    assert not edges_of(across, np.zeros_like(across))[:, 1:5].any()
    assert not edges_of(np.zeros((6, 6)), np.zeros((6, 6))).any()
