"""What a lens scatters: light is moved and neither made nor lost, and only that of lamps."""

import math

import numpy as np
import pytest

from fogsim.camera import AutoExposure, CameraSensor, LensGlare, Metering, Sensor
from fogsim.camera.glare import BRIGHT, SPREADS
from fogsim.values import Camera, Response

SATURATION, LAMP = 4.0, 1e5
MIDDLE = (240, 320)


def camera(width: int = 640, height: int = 480) -> Camera:
    """As wide a view at any size: 58°."""
    return Camera(width, height, 0.9 * width, (width / 2, height / 2), mount_height=1.4, response=Response.LINEAR)


def dark(width: int = 640, height: int = 480) -> np.ndarray:
    return np.full((height, width, 3), 0.1, np.float32)


def with_lamp(row: int = MIDDLE[0], column: int = MIDDLE[1], luminance: float = LAMP) -> np.ndarray:
    picture = dark()
    picture[row, column] = luminance
    return picture


def glow(picture: np.ndarray, share: float = 0.02) -> np.ndarray:
    """What glare adds to a picture and takes from it."""
    return LensGlare(camera(), share).scatter(picture, SATURATION).astype(float) - picture


def test_light_is_neither_made_nor_lost() -> None:
    picture = with_lamp()
    picture[230:240, 300:316] = (3e4, 1e4, 2e3)
    before = picture.copy()
    change = glow(picture)
    assert np.array_equal(picture, before)
    assert abs(change.sum(axis=(0, 1))) == pytest.approx([0, 0, 0], abs=2e-3 * np.abs(change).sum())


def test_a_lamp_loses_the_share_but_for_what_falls_back_into_its_pixel() -> None:
    """The narrowest Gaussian has a quarter of the light, of which a pixel at its middle gets about 1 / (2 π σ²)."""
    change, excess = glow(with_lamp()), LAMP - BRIGHT * SATURATION
    back = sum(1 / (2 * math.pi * (spread * 576) ** 2) for spread in SPREADS) / len(SPREADS)
    assert change[MIDDLE][0] == pytest.approx(-0.02 * excess * (1 - back), rel=0.02)


def test_glow_is_round_and_falls_off_with_the_inverse_square_of_the_angle() -> None:
    """From 2 to 64 px, the same within the ripple of Gaussians four times apart."""
    change = glow(with_lamp())
    rings = np.array([2, 4, 8, 16, 32, 64])
    profile = change[MIDDLE[0], MIDDLE[1] + rings, 0] * rings**2 / (0.02 * LAMP)
    # With equal light in each factor of 4 of the angle a fourth is spread over 2 π ln 4.
    assert profile == pytest.approx([0.25 / (2 * math.pi * math.log(4))] * 6, rel=0.35)
    row, column = MIDDLE
    for distance, (down, right) in {5: (3, 4), 13: (12, 5), 40: (24, 32), 100: (60, 80)}.items():
        around = [(0, distance), (0, -distance), (distance, 0), (-distance, 0), (down, right), (-right, down)]
        found = [change[row + r, column + c, 0] for r, c in around]
        assert found == pytest.approx([np.mean(found)] * len(found), rel=0.12), distance


def test_glow_moves_with_its_lamp_and_does_not_jump_from_cell_to_cell() -> None:
    for column in range(300, 364, 7):
        added = np.maximum(glow(with_lamp(column=column))[..., 0], 0.0)
        near = added[:, column - 250 : column + 251].sum(axis=0)
        assert near @ np.arange(-250, 251) / near.sum() == pytest.approx(0.0, abs=1.0)


def test_glow_grows_with_the_lamp_and_the_share_without_a_step_and_has_its_colour() -> None:
    at = (MIDDLE[0], MIDDLE[1] + 10, 0)
    one, brighter, larger = glow(with_lamp())[at], glow(with_lamp(luminance=3 * LAMP))[at], glow(with_lamp(), 0.04)[at]
    assert brighter == pytest.approx(3 * one, rel=0.01)
    assert larger == pytest.approx(2 * one, rel=0.01)
    barely = glow(with_lamp(luminance=1.001 * BRIGHT * SATURATION))
    assert 0 < np.abs(barely).max() < 1e-3 * SATURATION
    picture = dark()
    picture[MIDDLE] = (LAMP, 0.2 * LAMP, 0.1 * LAMP)
    red, green, blue = glow(picture)[MIDDLE[0], MIDDLE[1] + 6]
    assert (green / red, blue / red) == pytest.approx((0.2, 0.1), rel=1e-3)
    picture = dark()
    picture[200:300, 100:500] = 0.99 * BRIGHT * SATURATION
    assert LensGlare(camera(), 0.05).scatter(picture, SATURATION) is picture


@pytest.mark.parametrize("size", [(16, 16), (33, 21), (161, 121), (1280, 720)])
def test_lamps_in_the_corners_of_every_size(size: tuple[int, int]) -> None:
    width, height = size
    picture = dark(width, height)
    picture[[0, 0, -1, -1], [0, -1, 0, -1]] = LAMP
    found = LensGlare(camera(width, height), 0.02).scatter(picture, SATURATION).astype(float)
    assert np.isfinite(found).all()
    assert found.min() >= 0.1 * 0.999
    # Some of the light leaves the picture, the more the wider it is spread.
    assert 0.98 * picture.sum(dtype=float) <= found.sum() <= 1.000001 * picture.sum(dtype=float)
    np.testing.assert_allclose(found, found[:, ::-1], rtol=0.15)


def test_a_small_picture_shows_the_glow_of_a_large_one() -> None:
    """A lamp of 4 × 4 pixels is one pixel of an image of a quarter the size; far from it there is as much light."""
    large = dark()
    large[240:244, 320:324] = LAMP
    small = large.reshape(120, 4, 160, 4, 3).mean(axis=(1, 3)).astype(np.float32)
    wide = LensGlare(camera(), 0.02).scatter(large, SATURATION).reshape(120, 4, 160, 4, 3).mean(axis=(1, 3)) - small
    found = LensGlare(camera(160, 120), 0.02).scatter(small, SATURATION) - small
    for distance in (3, 6, 12):
        assert found[60, 80 + distance, 0] == pytest.approx(wide[60, 80 + distance, 0], rel=0.15)


def test_the_camera_sensor_scatters_at_its_exposure() -> None:
    auto = AutoExposure(Metering.HIGHLIGHTS, 0.65, time_constant=0.5, brightest=1e5, ungained=100.0, darkest=4.0)
    sensor = Sensor(SATURATION, 1e9, 0.0)

    def taken(picture: np.ndarray, exposure: AutoExposure | None, *glare: float) -> np.ndarray:
        return CameraSensor(camera(), sensor, exposure, 0.0, 0.1, *glare).take(picture, np.random.default_rng(0))

    night = with_lamp()
    assert np.array_equal(taken(night, auto), taken(night, auto, 0.0))
    assert taken(night, auto, 0.02)[240, 325, 0] > taken(night, auto)[240, 325, 0] + 20
    # By day the same lamp is not much brighter than what is around it, and its picture is the same bit for bit.
    day = np.maximum(night, np.float32(4000.0))
    assert np.array_equal(taken(day, auto, 0.02), taken(day, auto))
