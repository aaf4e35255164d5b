from dataclasses import replace

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.values import Camera, Response
from fogsim.values.camera_response import exposure_of, respond
from fogsim.vision.light.luminance import clipping, darker_by, linear_luminance, linear_pixels, linear_table
from fogsim.vision.light.pixel_kernels import even_column, pixel_luminance, row_luminance


def test_grey_and_equal_channels_agree_colour_is_weighed_and_views_of_any_layout_are_taken():
    grey = np.random.default_rng(1).integers(0, 256, (20, 30), dtype=np.uint8)
    colour = np.repeat(grey[:, :, None], 3, axis=2)
    for response in Response:
        assert linear_luminance(colour, response) == pytest.approx(linear_luminance(grey, response), rel=1e-5)
    primaries = np.zeros((1, 3, 3), np.uint8)
    primaries[0, [0, 1, 2], [0, 1, 2]] = 255
    assert linear_luminance(primaries, Response.SRGB)[0] / 255 == pytest.approx([0.2126, 0.7152, 0.0722], rel=1e-5)
    assert np.array_equal(linear_luminance(grey[::-1, ::2], Response.LINEAR), grey[::-1, ::2])
    with pytest.raises(InputError, match="12 bits must have dtype uint16, got uint8"):
        linear_luminance(np.zeros((2, 2), np.uint8), Response.LINEAR, 12)


@pytest.mark.parametrize("response", list(Response))
@pytest.mark.parametrize("bits", [8, 10, 12])
def test_light_is_that_of_the_response_at_any_depth(response, bits):
    deep = np.linspace(0, 2**bits - 1, 300).round().astype(np.uint8 if bits == 8 else np.uint16).reshape(10, 30)
    share = deep / (2**bits - 1)
    assert linear_luminance(deep, response, bits) == pytest.approx(255 * exposure_of(share, response), rel=1e-5)


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


CAMERA = Camera(64, 48, 60.0, (31.5, 23.5), 1.3)


def even_sky(light, noise, response, channels):
    lit = light + np.random.default_rng(1).normal(0.0, noise, (20000, channels))
    signal = respond(np.clip(lit / 255.0, 0.0, 1.0), response)
    pixels = np.rint(255.0 * signal).astype(np.uint8)
    return pixels if channels == 3 else pixels[:, 0]


@pytest.mark.parametrize(
    ("light", "noise", "channels", "response"),
    [
        (253.0, 2.0, 1, Response.LINEAR),
        (255.0, 1.5, 3, Response.SRGB),
        (255.0, 3.0, 1, Response.GAMMA),
        (256.5, 2.5, 3, Response.LINEAR),
    ],
)
def test_the_light_and_the_noise_behind_a_clipped_sky_come_back(response, channels, light, noise):
    camera = replace(CAMERA, response=response)
    pixels = even_sky(light, noise, response, channels)
    found = clipping(pixels, camera)
    mean = float(linear_table(response, 8)[pixels].mean())
    assert mean + found.loss == pytest.approx(light, abs=0.3)
    assert abs(mean + found.loss - light) < 0.4 * (light - mean)
    assert found.spread == pytest.approx(noise, rel=0.15)


def test_nothing_is_put_back_where_nothing_is_clipped_or_all():
    for light in (200.0, 280.0):
        found = clipping(even_sky(light, 1.5, Response.LINEAR, 3), CAMERA)
        assert (found.loss, found.noise) == (0.0, 0.0)


@pytest.mark.parametrize("fall", [0.5, 1.0, 2.0, 6.0])
def test_what_is_little_darker_than_a_clipped_sky_is_as_dark_as_it_is(fall):
    light = 255.0 - fall + np.random.default_rng(2).normal(0.0, 2.0, 400000)
    seen = 255.0 - float(np.minimum(light, 255.0).mean())
    true, lost = darker_by(seen, 0.0, 2.0)
    assert true == pytest.approx(fall, abs=0.03)
    assert lost == pytest.approx(seen - fall, abs=0.03)
