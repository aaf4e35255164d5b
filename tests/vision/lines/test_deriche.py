import cv2
import numpy as np
import pytest

from fogsim.vision.lines.edges import CannyDeriche, derivative_kernel, derivatives, smoothed, smoothing_kernel


def recursion(signal, alpha):
    """Deriche's smoothing as he wrote it: a causal and an anticausal recursion."""
    e = np.exp(-alpha)
    b1, b2, s = -2 * e, e * e, (1 - e) ** 2 / (1 + 2 * alpha * e - e * e)
    forth, back = np.zeros(signal.size + 4), np.zeros(signal.size + 4)
    x = np.pad(signal, 2)
    for n in range(2, x.size - 2):
        forth[n] = s * x[n] + s * (alpha - 1) * e * x[n - 1] - b1 * forth[n - 1] - b2 * forth[n - 2]
    for n in range(x.size - 3, 1, -1):
        back[n] = s * (alpha + 1) * e * x[n + 1] - s * e * e * x[n + 2] - b1 * back[n + 1] - b2 * back[n + 2]
    return (forth + back)[2:-2]


def test_check_values_of_the_kernels():
    # physics.md section 5.2, α = 1: h(0) = 0.2496691508; S = 3.98459
    smooth, derivative = smoothing_kernel(1.0), derivative_kernel(1.0)
    middle = smooth.size // 2
    assert smooth[middle] == pytest.approx(0.2496691508, abs=1e-10)
    n = np.arange(1, middle + 1)
    assert derivative[middle + 1 :] * 3.98459 == pytest.approx(n * np.exp(-n), rel=1e-5)


@pytest.mark.parametrize("alpha", [0.5, 1.0, 1.5])
def test_kernel_is_what_the_recursion_gives_and_the_derivative_of_a_ramp_its_slope(alpha):
    impulse = np.zeros(121)
    impulse[60] = 1.0
    kernel = smoothing_kernel(alpha)
    reach = kernel.size // 2
    assert recursion(impulse, alpha)[60 - reach : 61 + reach] == pytest.approx(kernel, abs=1e-12)
    assert kernel.sum() == pytest.approx(1.0, abs=0.01)
    kernel = derivative_kernel(alpha)
    n = np.arange(kernel.size) - kernel.size // 2
    assert float(kernel @ (3.0 * n)) == pytest.approx(3.0, rel=0.04)
    assert float(kernel.sum()) == pytest.approx(0.0, abs=1e-12)


def test_an_edge_is_found_where_it_is_and_fog_draws_none():
    image = np.full((80, 100), 60.0, np.float32)
    image[:, 40:] = 120.0
    edges = CannyDeriche()(image, None)
    assert set(np.flatnonzero(edges.pixels[40])) <= {39, 40}
    assert edges.pixels[40].any()
    assert edges.gradient.across[40, 39:41].max() > 10
    ramp = np.repeat(np.linspace(200, 60, 80, dtype=np.float32)[:, None], 100, axis=1)
    assert not CannyDeriche()(ramp, np.full(80, 5.0, np.float32)).pixels.any()


@pytest.mark.parametrize("shape", [(80, 101), (5, 40), (40, 3)])
def test_derivatives_are_the_kernels_along_one_axis_and_across_it(shape):
    image = np.random.default_rng(1).uniform(0.0, 255.0, shape).astype(np.float32)
    across, down = np.empty_like(image), np.empty_like(image)
    derivatives(image, across, down)
    smooth, derivative = smoothing_kernel(), derivative_kernel()
    border = cv2.BORDER_REPLICATE
    for found, by_row, by_column in ((across, derivative, smooth), (down, smooth, derivative)):
        expected = cv2.sepFilter2D(image, cv2.CV_64F, by_row, by_column, borderType=border)
        assert found == pytest.approx(expected, abs=1e-3)
    mirrored = np.ascontiguousarray(image[:, ::-1])
    mirrored_across, mirrored_down = np.empty_like(image), np.empty_like(image)
    derivatives(mirrored, mirrored_across, mirrored_down)
    assert (mirrored_across[:, ::-1] == -across).all()
    assert (mirrored_down[:, ::-1] == down).all()


@pytest.mark.parametrize("shape", [(80, 101), (2, 40), (40, 1)])
def test_smoothing_is_a_gaussian_of_one_pixel(shape):
    image = np.random.default_rng(2).uniform(0.0, 255.0, shape).astype(np.float32)
    expected = cv2.GaussianBlur(image, (5, 5), 1.0, borderType=cv2.BORDER_REPLICATE)
    assert smoothed(image) == pytest.approx(expected, abs=1e-3)
