import math
from dataclasses import replace

import numpy as np
import pytest

from fogsim.estimators.huang2015_comparison import (
    BROADEST,
    compare,
    compare_with_itself,
    cut_patch,
    expected_placement,
    known_placement,
    lower,
    placed_at,
    shrink_broad,
)
from fogsim.values import Camera, Response
from fogsim.vision.light.luminance import Clipping
from fogsim.vision.lines.horizon import CannotTellError
from fogsim.vision.vehicle.rear_localisation import RearBox
from fogsim.vision.vehicle.vehicle_crop import SkyReading, vehicle_crop

CAMERA = Camera(320, 240, 900.0, (159.5, 99.5), 1.4, np.radians(2.0), response=Response.LINEAR)
SKY = 200.0
TILES = np.random.default_rng(7).uniform(0.05, 0.6, (5, 6))


def seen(depth: float, left: float = 1.0, gain: float = 1.0):
    """A rear of 1.8 × 1.4 m of random tiles before a road, through fog that leaves a share of its contrast."""
    scale, foot = CAMERA.focal_length / depth, CAMERA.horizon_row + CAMERA.row_distance / depth
    at = (np.arange(4) + 0.5) / 4 - 0.5
    v, u = ((np.arange(n)[:, None] + at).ravel() for n in (CAMERA.height, CAMERA.width))
    x, z = np.meshgrid((u - CAMERA.principal_point[0]) / scale, (foot - v) / scale)
    inside = (np.abs(x) < 0.9) & (z > 0) & (z < 1.4)
    tiles = TILES[np.clip(5 * z / 1.4, 0, 4).astype(int), np.clip(6 * (x / 1.8 + 0.5), 0, 5).astype(int)]
    light = SKY * (1.0 - left * np.where(inside, 1.0 - tiles, 0.2))
    image = gain * light.reshape(CAMERA.height, 4, CAMERA.width, 4).mean(axis=(1, 3)).astype(np.float32)
    sky = SkyReading(gain * SKY, 0.2, Clipping(0.0, 0.0, 0.0), is_clipped=False)
    crop = vehicle_crop(CAMERA, depth, lambda rows, cols: image[rows, cols], lambda: sky)
    return cut_patch(crop, RearBox(CAMERA.principal_point[0], foot, 1.8 * scale), 3, 0.0)


@pytest.mark.parametrize("left", [0.7, 0.3, 0.1])
@pytest.mark.parametrize("gain", [1.0, 0.6])
def test_detail_and_light_fall_as_the_fog_says_at_any_exposure(left, gain):
    near, far = shrink_broad(seen(20.0)), shrink_broad(seen(45.0, left, gain))
    found = compare(near, far, expected_placement(near, far))
    assert found.contrast == pytest.approx(left, rel=0.03)
    assert found.fallen[0] == pytest.approx(left, rel=0.02)
    assert found.mean == pytest.approx(1.0 - left * (1.0 - found.near_mean), rel=0.02)
    assert (found.distance, found.number) == (45.0, 3)


def test_a_picture_is_its_own_reference():
    near = shrink_broad(seen(20.0))
    own = compare_with_itself(near)
    assert (own.contrast, own.mean, own.mean_deviation) == (1.0, own.near_mean, 0.0)
    assert own.deviation == math.inf
    assert own.regression.slope == pytest.approx(1.0, abs=1e-2)


def test_what_fog_has_hidden_cannot_be_followed():
    with pytest.raises(CannotTellError, match="shows nothing"):
        compare_with_itself(shrink_broad(seen(20.0, left=1e-4)))


def test_a_saturated_sky_leaves_the_detail_only():
    near, far = shrink_broad(seen(20.0)), shrink_broad(seen(45.0, 0.4))
    far = replace(far, sky=far.sky._replace(clipping=None))
    found = compare(near, far, expected_placement(near, far))
    assert found.contrast == pytest.approx(0.4, rel=0.03)
    assert found.mean_deviation == math.inf


@pytest.mark.parametrize("depth", [20.0, 45.0])
def test_broad_pictures_are_shrunk_and_keep_their_variance(depth):
    full = seen(depth)
    small = shrink_broad(full)
    assert small.width == pytest.approx(min(full.width, BROADEST))
    assert small.variance == full.variance
    assert small.metre / full.metre == pytest.approx(small.scale)
    found = placed_at(small, full, expected_placement(small, small).placement)
    assert found.variance == pytest.approx(full.variance)
    assert found.patch == small.patch


def test_a_vehicle_that_stands_lower_is_looked_at_lower():
    picture = seen(45.0)
    lowered = lower(picture, 0.1)
    assert lowered.patch.row - picture.patch.row == pytest.approx(0.1 * picture.width)
    assert lowered.variance != picture.variance
    assert lower(picture, 0.0).variance == picture.variance


def test_a_picture_that_was_registered_is_where_it_was():
    near, far = seen(20.0), seen(45.0)
    expected, known = expected_placement(near, far), known_placement(near, far)
    assert known.placement == expected.placement
    assert expected.placement.scale == pytest.approx(20.0 / 45.0)
    assert known.column_deviation < expected.column_deviation
    assert known.row_deviation < expected.row_deviation
