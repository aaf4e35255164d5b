import numpy as np
import pytest

from fogsim.values.camera import Camera, Response
from fogsim.values.camera_response import respond
from fogsim.vision.light.luminance import clipping, darker_by, linear_table


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
    camera = Camera(64, 48, 60.0, (31.5, 23.5), 1.3, 0.0, response=response)
    pixels = even_sky(light, noise, response, channels)
    found = clipping(pixels, camera)
    mean = float(linear_table(response, 8)[pixels].mean())
    assert mean + found.loss == pytest.approx(light, abs=0.3)
    assert abs(mean + found.loss - light) < 0.4 * (light - mean)
    assert found.spread == pytest.approx(noise, rel=0.15)


def test_nothing_is_put_back_where_nothing_is_clipped_or_all():
    camera = Camera(64, 48, 60.0, (31.5, 23.5), 1.3, 0.0)
    for light in (200.0, 280.0):
        found = clipping(even_sky(light, 1.5, Response.LINEAR, 3), camera)
        assert (found.loss, found.noise) == (0.0, 0.0)


@pytest.mark.parametrize("fall", [0.5, 1.0, 2.0, 6.0])
def test_what_is_little_darker_than_a_clipped_sky_is_as_dark_as_it_is(fall):
    light = 255.0 - fall + np.random.default_rng(2).normal(0.0, 2.0, 400000)
    seen = 255.0 - float(np.minimum(light, 255.0).mean())
    true, lost = darker_by(seen, 0.0, 2.0)
    assert true == pytest.approx(fall, abs=0.03)
    assert lost == pytest.approx(seen - fall, abs=0.03)
