import numpy as np
import pytest

from fogsim.values import Camera, Response
from fogsim.vision.light.luminance import Clipping
from fogsim.vision.lines.horizon import CannotTellError
from fogsim.vision.vehicle.vehicle_crop import SkyReading, daytime_crop, noise_gain, vehicle_crop

CAMERA = Camera(640, 480, 600.0, (319.5, 239.5), 1.4, np.radians(2.0), response=Response.LINEAR)
SKY = SkyReading(200.0, 1.5, Clipping(0.0, 0.0, 0.0), is_clipped=False)


def crop(depth: float, light: float = 120.0, road: float = 120.0, least_noise: float = 0.0):
    image = np.full((CAMERA.height, CAMERA.width), light, np.float32)
    image[int(CAMERA.horizon_row) + 2 :] = road
    return vehicle_crop(CAMERA, depth, lambda rows, cols: image[rows, cols], lambda: SKY, least_noise)


@pytest.mark.parametrize(("depth", "aside"), [(8.0, -0.8), (25.0, 0.0), (90.0, 0.5)])
def test_places_in_metres_and_in_pixels_are_the_same(depth, aside):
    found = crop(depth)
    picture = found.expected(aside, 1.8)
    assert found.lateral_offset(picture) == pytest.approx(aside)
    assert found.pitch_error(picture) == pytest.approx(0.0, abs=1e-12)
    assert found.pitch_error(picture.displaced(0.0, 0.01 * depth)) == pytest.approx(0.01)
    box = found.box_of(picture)
    assert box.foot == pytest.approx(CAMERA.horizon_row + CAMERA.row_distance / depth)
    assert box.width == pytest.approx(1.8 * CAMERA.focal_length / depth)
    again = found.picture(box, picture.scale)
    assert (again.column, again.foot, again.width) == pytest.approx((picture.column, picture.foot, picture.width))


def test_contrast_is_to_the_sky_and_noise_has_a_least_value():
    assert crop(30.0, light=50.0, road=50.0).expected(0.0, 1.8).contrast == pytest.approx(0.75)
    assert crop(30.0).noise == pytest.approx(SKY.noise)
    assert crop(30.0, least_noise=4.0).noise == 4.0


def test_what_is_too_near_or_too_far_and_roads_brighter_than_the_sky_are_refused():
    for depth in (0.8, 800.0):
        with pytest.raises(CannotTellError, match="too small in the image, or outside it"):
            crop(depth)
    with pytest.raises(CannotTellError, match="brighter than the sky"):
        crop(30.0, road=230.0)
    with pytest.raises(CannotTellError, match="no vehicle stands out"):
        crop(30.0).localise()


def test_a_sky_that_is_nowhere_as_bright_as_beside_the_vehicle_is_told(monkeypatch):
    sky = np.random.default_rng(0).normal(200.0, 1.0, (CAMERA.height, CAMERA.width))
    sky[int(CAMERA.horizon_row) + 2 :] = 90.0
    image = np.clip(np.rint(sky), 0, 255).astype(np.uint8)
    assert daytime_crop(image, CAMERA, 30.0, 0.002).sky.luminance == pytest.approx(200.0, abs=1.0)
    monkeypatch.setattr("fogsim.vision.vehicle.vehicle_crop.neighbouring_airlight", lambda *_: 150.0)
    with pytest.raises(CannotTellError, match="no part of the sky is as bright"):
        daytime_crop(image, CAMERA, 30.0, 0.002)


@pytest.mark.parametrize(("light", "expected"), [(180.0, 1.0), (45.0, 0.25 ** (1.2 / 2.2))])
def test_noise_grows_with_the_slope_of_the_response(light, expected):
    luminance = np.full((4, 4), light, np.float32)
    assert noise_gain(luminance, 180.0, CAMERA) == pytest.approx(1.0, rel=1e-3)
    gamma = Camera(640, 480, 600.0, (319.5, 239.5), 1.4, 0.03, response=Response.GAMMA)
    # Light goes as the 2.2th power of the value, and its slope as the 1.2th.
    assert noise_gain(luminance, 180.0, gamma) == pytest.approx(expected, rel=0.02)


def test_rows_levelled_with_one_extinction_become_those_with_another():
    """Over a sky that brightens upward; a picture's contrast to its airlight is the same either way."""
    rows = np.arange(CAMERA.height, dtype=float)[:, None]
    above = np.maximum(CAMERA.horizon_row - rows, 0.0) / CAMERA.focal_length
    light = np.where(rows < CAMERA.horizon_row + 1, 120.0 * (1.0 + 2.0 * above), 60.0)
    image = np.rint(light + np.random.default_rng(0).normal(0.0, 1.0, (CAMERA.height, CAMERA.width))).astype(np.uint8)
    thin, dense = (daytime_crop(image, CAMERA, 30.0, 0.002, extinction) for extinction in (0.01, 0.1))
    change = thin.levelled.change(0.1)
    assert np.abs(change - 1.0).max() > 0.01
    told = thin.luminance / thin.sky.luminance * change[:, None]
    assert told == pytest.approx(dense.luminance / dense.sky.luminance, rel=0.01)
    assert thin.levelled.change(0.01) == pytest.approx(np.ones(change.size))
