"""Edges of images, without those that fog draws."""

import cv2
import numpy as np
import pytest

from fogsim.vision.lines.edges import MIN_GRADIENT, EdgeDetector, edge_map


def step(rows=60, cols=80, at=30, low=60.0, high=100.0):
    image = np.full((rows, cols), low, np.float32)
    image[:, at:] = high
    return image


def test_derivatives_of_a_ramp_are_its_slopes():
    v, u = np.mgrid[:40, :50].astype(np.float32)
    gradient = edge_map(2.0 * u - 3.0 * v, np.zeros(40, np.float32)).gradient
    assert gradient.across[1:-1, 1:-1] == pytest.approx(2.0)
    assert gradient.down[1:-1, 1:-1] == pytest.approx(-3.0)


def test_a_step_is_an_edge_where_it_is():
    edges = edge_map(step(), np.zeros(60, np.float32))
    assert set(np.nonzero(edges.pixels)[1]) <= {29, 30}
    assert edges.pixels.any(axis=1).all()
    assert edges.threshold == MIN_GRADIENT


def test_edges_of_a_mirrored_image_are_mirrored():
    image, rng = np.full((60, 80), 90.0, np.float32), np.random.default_rng(1)
    for row, col in rng.integers(0, (30, 70), (6, 2)):
        image[row : row + 12, col : col + 9] = rng.uniform(60.0, 200.0)
    image = cv2.GaussianBlur(image, (0, 0), 1.5)
    slope = np.full(60, 1.0, np.float32)
    found = edge_map(image, slope).pixels
    assert found.any()
    mirrored = edge_map(np.ascontiguousarray(image[:, ::-1]), slope).pixels
    np.testing.assert_array_equal(mirrored[:, ::-1], found)


@pytest.mark.parametrize("fall", [3.0, 6.0])
def test_fog_may_take_off_so_much_of_a_row_and_no_more(fall):
    """A brightening upward by `fall` a row: what fog can make is taken off, the rest stays."""
    image = np.repeat(np.linspace(200.0, 200.0 - fall * 39, 40, dtype=np.float32)[:, None], 50, axis=1)
    down = edge_map(image, np.full(40, 4.0, np.float32)).gradient.down
    assert down[1:-1] == pytest.approx(min(0.0, 4.0 - fall), abs=1e-4)


def test_darkening_upward_is_none_of_fog():
    image = np.repeat(np.linspace(80.0, 200.0, 40, dtype=np.float32)[:, None], 50, axis=1)
    assert edge_map(image, np.full(40, 9.0, np.float32)).gradient.down[1:-1] == pytest.approx(120.0 / 39, abs=1e-4)


def test_grain_raises_the_threshold():
    noisy = step() + np.random.default_rng(2).normal(0.0, 6.0, (60, 80)).astype(np.float32)
    edges = edge_map(noisy, np.zeros(60, np.float32))
    assert edges.threshold > 5.0 * MIN_GRADIENT


def test_a_detector_takes_images_of_another_size_and_an_even_one_has_no_edges():
    def along(image, across, down):
        across[:], down[:] = np.gradient(image, axis=1), np.gradient(image, axis=0)

    detector = EdgeDetector(along, of_row=4, of_road=2)
    assert detector(step(), None).pixels.any()
    even = detector(np.full((20, 30), 90.0, np.float32), None)
    assert even.pixels.shape == (20, 30)
    assert not even.pixels.any()
