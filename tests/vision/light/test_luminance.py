import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.values import Camera, Response
from fogsim.values.camera_response import exposure_of
from fogsim.vision.light.luminance import linear_luminance, linear_pixels, linear_table
from fogsim.vision.light.pixel_kernels import even_column, pixel_luminance, row_luminance


@pytest.mark.parametrize("response", list(Response))
def test_table_is_monotone_between_its_fixed_ends(response):
    table = linear_table(response)
    assert table[0] == 0.0
    assert table[255] == 255.0
    assert np.all(np.diff(table) > 0)


def test_srgb_has_the_published_values():
    # physics.md section 8 / IEC 61966-2-1: 0.18 → 0.461356, 0.5 → 0.735357
    table = linear_table(Response.SRGB) / 255.0
    encoded = np.arange(256) / 255.0
    assert np.interp([0.461356, 0.735357], encoded, table) == pytest.approx([0.18, 0.5], abs=2e-5)


def test_gamma_is_a_power_law():
    assert linear_table(Response.GAMMA)[128] == pytest.approx(255 * (128 / 255) ** 2.2, rel=1e-6)


def test_linear_is_the_identity():
    assert linear_table(Response.LINEAR) == pytest.approx(np.arange(256))


def test_grey_and_equal_channels_agree():
    grey = np.random.default_rng(1).integers(0, 256, (20, 30), dtype=np.uint8)
    colour = np.repeat(grey[:, :, None], 3, axis=2)
    for response in Response:
        assert linear_luminance(colour, response) == pytest.approx(linear_luminance(grey, response), rel=1e-5)


def test_colour_is_weighed_as_luminance():
    primaries = np.zeros((1, 3, 3), np.uint8)
    primaries[0, [0, 1, 2], [0, 1, 2]] = 255
    assert linear_luminance(primaries, Response.SRGB)[0] / 255 == pytest.approx([0.2126, 0.7152, 0.0722], rel=1e-5)


def test_views_of_any_layout_are_taken():
    grey = np.random.default_rng(2).integers(0, 256, (20, 30), dtype=np.uint8)
    assert np.array_equal(linear_luminance(grey[::-1, ::2], Response.LINEAR), grey[::-1, ::2])


@pytest.mark.parametrize("response", list(Response))
@pytest.mark.parametrize("bits", [10, 12])
def test_more_bits_are_the_same_light(response, bits):
    deep = np.linspace(0, 2**bits - 1, 300).round().astype(np.uint16).reshape(10, 30)
    share = deep / (2**bits - 1)
    assert linear_luminance(deep, response, bits) == pytest.approx(255 * exposure_of(share, response), rel=1e-5)


def test_a_type_that_the_bit_depth_does_not_have_is_an_error():
    with pytest.raises(InputError, match="12 bits must have dtype uint16, got uint8"):
        linear_luminance(np.zeros((2, 2), np.uint8), Response.LINEAR, 12)


@pytest.mark.parametrize("shape", [(6, 9), (6, 9, 3)])
def test_pixels_looked_up_one_by_one_and_row_by_row_have_the_images_luminance(shape):
    camera = Camera(9, 6, 10.0, (4.0, 2.5), 1.3, 0.0, response=Response.SRGB)
    image = np.random.default_rng(3).integers(0, 256, shape, dtype=np.uint8)
    paired, line = linear_pixels(image, camera), np.empty(9, np.float32)
    for row, expected in enumerate(linear_luminance(image, camera.response)):
        row_luminance(*paired, row, line)
        assert line == pytest.approx(expected, rel=1e-6)
        assert [pixel_luminance(paired, row, col) for col in range(9)] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("count", [1, 5, 24])
def test_even_columns_are_a_mirror_image_of_themselves(count):
    columns = [even_column(j, count, -0.5, 319.5) for j in range(count)]
    assert columns == sorted(columns)
    left = columns[: count // 2]
    assert [319 - col for col in left[::-1]] == columns[count - count // 2 :]
