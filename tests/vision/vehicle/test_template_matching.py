import numpy as np
import pytest

from fogsim.vision.vehicle.patch import correlations, match_cost, vertex

RNG = np.random.default_rng(5)
IMAGE, TEMPLATE = RNG.normal(100.0, 20.0, (19, 23)), RNG.normal(50.0, 10.0, (6, 7))


def test_correlations_are_pearsons():
    found = correlations(IMAGE, TEMPLATE)
    assert found.shape == (14, 17)
    for row, col in ((0, 0), (5, 9), (13, 16)):
        part = IMAGE[row : row + 6, col : col + 7]
        assert found[row, col] == pytest.approx(np.corrcoef(part.ravel(), TEMPLATE.ravel())[0, 1], abs=1e-12)


@pytest.mark.parametrize(("gain", "offset", "sign"), [(1.0, 0.0, 1.0), (0.1, 180.0, 1.0), (-0.5, 30.0, -1.0)])
def test_brightness_and_contrast_do_not_matter_but_their_sign_does(gain, offset, sign):
    image = np.full((12, 13), offset)
    image[3:9, 4:11] = gain * TEMPLATE + offset
    assert correlations(image, TEMPLATE)[3, 4] == pytest.approx(sign, abs=1e-12)


def test_nothing_looks_like_an_even_surface():
    assert not correlations(np.full((9, 9), 80.0), TEMPLATE).any()
    assert not correlations(IMAGE, np.full((6, 7), 3.0)).any()


def test_of_two_places_that_look_alike_the_expected_one_is_taken():
    image = np.zeros((8, 30))
    image[1:7, 2:9] = image[1:7, 20:27] = TEMPLATE
    near_left, near_right = (np.abs(np.arange(24.0) - at)[None, :] * np.ones((3, 1)) * 1e-3 for at in (2, 20))
    assert match_cost(image, TEMPLATE, near_left)[2:] == (1, 2)
    assert match_cost(image, TEMPLATE, near_right)[2:] == (1, 20)


def test_what_looks_like_nothing_is_placed_by_what_is_known():
    prior = np.abs(np.arange(17.0) - 12.0)[None, :] + np.abs(np.arange(14.0) - 3.0)[:, None]
    assert match_cost(np.full_like(IMAGE, 7.0), TEMPLATE, prior)[2:] == (3, 12)


@pytest.mark.parametrize("middle", [2.6, 3.0, 3.45])
def test_vertex_of_a_parabola(middle):
    values = 2.0 * (np.arange(7.0) - middle) ** 2 - 5.0
    assert 3 + vertex(values, 3) == pytest.approx(middle)


def test_no_vertex_at_the_border_or_on_a_line():
    assert vertex(np.array([0.0, 1.0, 2.0]), 0) == 0.0
    assert vertex(np.array([2.0, 1.0, 0.0]), 2) == 0.0
    assert vertex(np.array([0.0, 1.0, 2.0]), 1) == 0.0
