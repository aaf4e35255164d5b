import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.values import Response
from fogsim.values.camera_response import exposure_of
from fogsim.vision.light.linear_table import linear_table
from fogsim.vision.light.luminance import linear_luminance


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
