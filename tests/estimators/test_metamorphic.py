"""What holds for each method whatever the picture: scale, mirror, gain, no truth, bad input."""

import copy
from dataclasses import replace

import numpy as np
import pytest

from fogsim.estimators import make
from fogsim.values import Camera, LeadMeasurement, Observation

METHODS = ["negru2013", "joint_road", "lead_contrast"]
RANGES = (14.0, 18.0, 22.0, 27.0, 33.0, 39.0, 46.0)
CAMERA = Camera(480, 360, 433.0, (239.5, 179.5), 1.38, np.radians(2.0))


@pytest.fixture(scope="module")
def frames(render):
    def make_frames(road):
        return [render(replace(road, camera=CAMERA, lead_distance=d + 1.7), i) for i, d in enumerate(RANGES)]

    return make_frames


def last(method, images, camera, scale=1.0, **options):
    estimator = make(method, camera, **options)
    pairs = zip(images, RANGES, strict=True)
    return [estimator.update(Observation(i, lead=LeadMeasurement(scale * d, 0.0))) for i, d in pairs][-1]


@pytest.mark.parametrize("method", METHODS)
def test_visibility_scales_with_the_world(frames, road, method):
    # Twice the focal length, the horizon on the same row, twice the ranges: the picture of a world twice as deep.
    images = frames(road)
    pitch = np.arctan(np.tan(CAMERA.pitch) / 2)
    deep = replace(CAMERA, focal_length=2 * CAMERA.focal_length, pitch=pitch)
    options = {"setback": 3.4, "range_deviation": 0.5, "pitch_deviation": np.radians(0.05)}
    found = last(method, images, CAMERA)
    assert found.valid
    options = options if method == "lead_contrast" else {"pitch_deviation": np.radians(0.05)}
    twice = last(method, images, deep, 2.0, **options).visibility
    # Patches of the road have a size in metres, and the slant path is that of another angle.
    assert twice == pytest.approx(2 * found.visibility, rel=0.04)


@pytest.mark.parametrize("method", METHODS)
def test_mirroring_changes_nothing(frames, road, method):
    images = frames(road)
    found = last(method, images, CAMERA)
    mirrored = last(method, [image[:, ::-1] for image in images], CAMERA)
    assert found.valid
    assert mirrored.visibility == pytest.approx(found.visibility, rel=0.02)


@pytest.mark.parametrize("method", METHODS)
def test_gain_changes_nothing_while_unsaturated(frames, road, method):
    bright = road.but(noise=0.5)
    dim = bright.but(airlight=140.0, asphalt=42.0, mark=105.0, terrain=31.5, lead_paint=21.0)
    assert last(method, frames(dim), CAMERA).visibility == pytest.approx(
        last(method, frames(bright), CAMERA).visibility, rel=0.05
    )


@pytest.mark.parametrize("method", METHODS)
def test_nothing_but_pixels_calibration_and_sensors_is_used(frames, road, method):
    images = frames(road)
    found = last(method, images, CAMERA)
    again = last(method, copy.deepcopy(images), replace(CAMERA))
    assert (again.extinction, again.standard_deviation) == (found.extinction, found.standard_deviation)


@pytest.mark.parametrize("method", METHODS)
def test_images_are_left_alone(frames, road, method):
    images = frames(road)
    kept = [image.copy() for image in images]
    for image in images:
        image.flags.writeable = False
    last(method, images, CAMERA)
    assert all(np.array_equal(a, b) for a, b in zip(images, kept, strict=True))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("bits", "factor"), [(10, 4), (12, 16)])
def test_more_bits_and_colour_of_the_same_picture_change_nothing(frames, road, method, bits, factor):
    images = frames(road)
    found = last(method, images, CAMERA)
    deep = [np.repeat((image.astype(np.uint16) * factor)[:, :, None], 3, axis=2) for image in images]
    assert last(method, deep, replace(CAMERA, bits=bits)).extinction == pytest.approx(found.extinction, rel=0.01)


RNG = np.random.default_rng(9)
LIT_ROAD = np.where(np.arange(360) > 168, 120 * np.clip((np.arange(360) - 168) / 190, 0, 1) ** 2, 2)
TELLS_NOTHING = {
    "black": np.zeros((360, 480), np.uint8),
    "white": np.full((360, 480), 255, np.uint8),
    "grey": np.full((360, 480), 128, np.uint8),
    "noise": RNG.integers(0, 256, (360, 480), dtype=np.uint8),
    "colour noise": RNG.integers(0, 256, (360, 480, 3), dtype=np.uint8),
    "night": np.clip(LIT_ROAD[:, None] + RNG.normal(0, 1, (360, 480)), 0, 255).astype(np.uint8),
    "lit night": np.clip(LIT_ROAD[:, None] + 12 + RNG.normal(0, 1, (360, 480)), 0, 255).astype(np.uint8),
    "checkerboard": (np.indices((360, 480)).sum(axis=0) // 7 % 2 * 255).astype(np.uint8),
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", TELLS_NOTHING)
def test_an_image_without_a_foggy_road_is_refused_with_a_reason(method, name):
    found = last(method, [TELLS_NOTHING[name]] * len(RANGES), CAMERA)
    if (method, name) == ("lead_contrast", "checkerboard"):
        # A box that keeps its contrast at every range: to this method that is clear air.
        assert found.visibility > 10_000
        return
    assert not found.valid
    assert found.diagnostics["reason"]
    assert (found.extinction, found.standard_deviation) == (0.0, np.inf)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("size", [(1, 1), (16, 16), (2, 300), (300, 2), (33, 20)])
def test_tiny_images_are_refused(method, size):
    camera = Camera(*size, 100.0, (size[0] / 2, size[1] / 2), 1.4)
    for value in (0, 90, 255):
        assert not last(method, [np.full(size[::-1], value, np.uint8)] * len(RANGES), camera).valid


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("pitch", [-40.0, 40.0, 89.0])
def test_a_horizon_outside_the_image_is_refused(render, road, method, pitch):
    image = render(road.but(camera=CAMERA))
    assert not last(method, [image] * len(RANGES), replace(CAMERA, pitch=np.radians(pitch))).valid


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("seed", range(15))
def test_nothing_odd_gets_out_of_random_pictures(method, seed):
    rng = np.random.default_rng(seed)
    camera = Camera(96, 72, rng.uniform(30, 300), (48.0, rng.uniform(0, 72)), 1.4, rng.uniform(-0.3, 0.3))
    rows = np.interp(np.arange(72), np.sort(rng.uniform(0, 72, 5)), rng.uniform(0, 300, 5))
    image = np.clip(rows[:, None] + rng.normal(0, rng.choice([0, 1, 20]), (72, 96)), 0, 255).astype(np.uint8)
    found = last(method, [image] * len(RANGES), camera)
    assert np.isfinite(found.extinction)
    assert found.extinction >= 0
    assert found.valid == np.isfinite(found.standard_deviation)
