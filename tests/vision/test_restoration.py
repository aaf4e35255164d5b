"""Contrast restoration gives back what fog took, within its bounds, and does no harm."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from fogsim.errors import InputError
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, Response
from fogsim.values.camera_response import respond
from fogsim.vision.restoration import METHODS, restore_contrast
from fogsim.vision.restoration.planar import FARTHEST, road_distance

CAMERA = Camera(160, 120, 150.0, (79.5, 59.5), 1.4, math.radians(3.0), response=Response.SRGB)
DEEP = replace(CAMERA, bits=12, response=Response.LINEAR)
AIRLIGHT = 0.8
K = extinction_from_visibility(80.0)
Floats = NDArray[np.float64]


def road(rng: np.random.Generator) -> Floats:
    """Light of a textured road below the horizon and of the sky above it, (rows, cols, 3)."""
    light = rng.uniform(0.1, 0.3, (CAMERA.height, CAMERA.width, 3))
    light[road_distance(CAMERA)[0] == FARTHEST] = AIRLIGHT
    return light


def fogged(light: Floats, distance: Floats, k: float = K) -> Floats:
    kept = np.exp(-k * distance)[..., None]
    return light * kept + AIRLIGHT * (1.0 - kept)


def image_of(light: Floats, camera: Camera = CAMERA) -> NDArray[np.uint8] | NDArray[np.uint16]:
    full = 2**camera.bits - 1
    values = np.rint(full * np.clip(respond(light, camera.response), 0.0, 1.0))
    return values.astype(np.uint8) if camera.bits == 8 else values.astype(np.uint16)


def airlight(camera: Camera = CAMERA) -> Floats:
    return np.array((2**camera.bits - 1) * respond(np.full(3, AIRLIGHT), camera.response))


@pytest.mark.parametrize(("pitch", "roll"), [(3.0, 0.0), (5.0, 4.0)])
def test_a_road_plane_comes_back_from_koschmieders_law(pitch: float, roll: float) -> None:
    camera = replace(DEEP, pitch=math.radians(pitch), roll=math.radians(roll))
    distance = road_distance(camera)[0].astype(np.float64)
    rng = np.random.default_rng(1)
    light = rng.uniform(0.1, 0.3, (camera.height, camera.width, 3))
    seen = image_of(fogged(light, distance), camera)
    back = restore_contrast(seen, camera, K, airlight(camera), most_gain=1000.0)
    near = distance < 30.0
    # Half a step of 4095, amplified by e^(k d) ≤ 3.1, and as much again where it is written.
    assert np.abs(back.image[near] / 4095 - light[near]).max() < 1e-3
    assert back.transmission[near] == pytest.approx(np.exp(-K * distance[near]), rel=1e-3)


def test_the_distance_of_the_road_is_that_of_its_geometry() -> None:
    whole, blocks = road_distance(CAMERA)
    v = 100
    ahead = CAMERA.row_distance / (v - CAMERA.horizon_row)
    depth = (ahead * math.cos(CAMERA.pitch)) + CAMERA.mount_height * math.sin(CAMERA.pitch)
    length = depth * math.sqrt(1.0 + ((v - 59.5) / 150.0) ** 2 + (0.5 / 150.0) ** 2)
    # λ / (v − v_h) is reckoned from the foot of the camera, but for the tilt of its axis.
    assert whole[v, 80] == pytest.approx(length, rel=0.02)
    angle = CAMERA.pitch + math.atan((v - 59.5) / 150.0)
    assert whole[v, 80] == pytest.approx(CAMERA.mount_height / math.sin(angle), rel=1e-3)
    assert whole[0].min() == FARTHEST
    assert blocks.shape == (30, 40)


def test_noise_rises_by_no_more_than_the_bound() -> None:
    for most_gain in [2.0, 8.0]:
        for method in METHODS:
            rng = np.random.default_rng(2)
            distance = road_distance(DEEP)[0].astype(np.float64)
            light = fogged(road(rng), distance)
            noise = 0.002 * rng.standard_normal(light.shape)
            given = (K, airlight(DEEP))
            noisy, calm = (image_of(one, DEEP) for one in (light + noise, light))
            one, other = (
                restore_contrast(image, DEEP, *given, method=method, most_gain=most_gain) for image in (noisy, calm)
            )
            assert one.transmission.min() >= (1.0 - 1e-6) / most_gain
            sky = distance == FARTHEST
            difference = (one.image.astype(np.float64) - other.image)[sky].std() / 4095
            assert difference <= 1.05 * most_gain * 0.002
            if method == "planar":
                assert difference < 0.65 * most_gain * 0.002  # what is noise alone is smoothed


def test_without_fog_the_image_comes_back_and_fog_that_is_hardly_there_changes_hardly_anything() -> None:
    for image in (image_of(np.full((120, 160, 3), 0.4)), image_of(np.full((120, 160), 0.4))):
        done = restore_contrast(image, CAMERA, extinction_from_visibility(math.inf))
        assert np.array_equal(done.image, image)
        assert done.image is not image
        assert (done.transmission == 1.0).all()
    image = image_of(road(np.random.default_rng(3)))
    done = restore_contrast(image, CAMERA, 1e-7, airlight())
    below = road_distance(CAMERA)[0] < 100.0
    # The soft bound: 2 % of what is not airlight.
    assert np.abs(done.image[below].astype(int) - image[below]).max() <= 4


def test_every_kind_of_image_keeps_its_kind() -> None:
    for grey in [False, True]:
        for camera in [CAMERA, DEEP, replace(CAMERA, response=Response.LINEAR)]:
            for method in METHODS:
                distance = road_distance(camera)[0].astype(np.float64)
                image = image_of(fogged(road(np.random.default_rng(4)), distance), camera)
                image = image[..., 0].copy() if grey else image
                kept = image.copy()
                one, other = (restore_contrast(image, camera, K, method=method) for _ in range(2))
                assert one.image.shape == image.shape
                assert one.image.dtype == image.dtype
                assert np.array_equal(one.image, other.image)
                assert np.array_equal(one.transmission, other.transmission)
                assert np.array_equal(image, kept)
                assert one.image.astype(float).std() > 1.1 * image.astype(float).std()


def test_images_of_16_bits_without_a_depth_use_all_of_them() -> None:
    camera = replace(CAMERA, response=Response.LINEAR)
    distance = road_distance(camera)[0].astype(np.float64)
    light = road(np.random.default_rng(5))
    image = np.rint(65535 * fogged(light, distance)).astype(np.uint16)
    done = restore_contrast(image, camera, K, np.full(3, 65535 * AIRLIGHT), most_gain=1000.0)
    near = distance < 30.0
    assert np.abs(done.image[near] / 65535 - light[near]).max() < 1e-4


def test_what_stands_on_the_road_is_restored_by_its_foot() -> None:
    """A dark vehicle 20 m ahead whose upper half stands before road and sky that are much farther."""
    distance = road_distance(CAMERA)[0].astype(np.float64)
    light = road(np.random.default_rng(6))
    foot = int(np.flatnonzero(distance[:, 80] < 20.0)[0])
    box = (slice(foot - 12, foot), slice(70, 90))
    light[box], distance[box] = 0.08, 20.0
    done = restore_contrast(image_of(fogged(light, distance)), CAMERA, K, airlight())
    inner = (slice(foot - 10, foot - 2), slice(73, 87))
    assert done.transmission[inner] == pytest.approx(math.exp(-20.0 * K), rel=0.25)
    shown = done.image[inner]
    assert (shown > 0).all()
    assert shown.mean() == pytest.approx(255 * respond(np.array(0.08), Response.SRGB), abs=25)


def test_the_airlight_is_that_above_the_horizon_and_leaves_no_edge_below_it() -> None:
    distance = road_distance(CAMERA)[0].astype(np.float64)
    image = image_of(fogged(road(np.random.default_rng(7)), distance))
    for method in METHODS:
        assert restore_contrast(image, CAMERA, K, method=method).airlight == pytest.approx(airlight(), abs=2.0)
    # Foggy skies do: with the light of the upper sky, the road near the horizon would pass for what stands on it.
    distance = road_distance(CAMERA)[0].astype(np.float64)
    light = fogged(road(np.random.default_rng(3)), distance)
    above = CAMERA.horizon_row - np.arange(CAMERA.height)[:, None, None]
    light = np.where((distance == FARTHEST)[..., None], AIRLIGHT * (0.55 + 0.02 * np.maximum(above, 0.0)), 0.55 * light)
    back = restore_contrast(image_of(light), CAMERA, K, most_gain=8.0)
    expected = np.hypot(np.exp(-K * distance), 1.0 / 8.0)
    assert np.abs(back.transmission - expected).max() < 0.02


def test_the_tone_map_neither_blackens_nor_bleaches() -> None:
    distance = road_distance(CAMERA)[0].astype(np.float64)
    image = image_of(fogged(0.1 * road(np.random.default_rng(8)), distance))
    plain, mapped = (restore_contrast(image, CAMERA, K, airlight(), tone_map=wanted).image for wanted in (False, True))
    near = distance < 40.0
    assert plain[near].mean() + 20 < mapped[near].mean() < 200
    assert (mapped == 255).mean() < 0.01


GREY = np.zeros((120, 160), np.uint8)


def test_mistakes_say_what_is_allowed() -> None:
    for image, arguments, told in [
        (np.zeros((12, 16), np.uint8), {"extinction": K}, r"16 × 12 pixels, the camera 160 × 120"),
        (np.zeros((120, 160, 4), np.uint8), {"extinction": K}, r"a grey or colour image .* got \(120, 160, 4\)"),
        (np.zeros((120, 160)), {"extinction": K}, r"uint8 or uint16, got .* float64"),
        (GREY, {}, r"none is given"),
        (GREY, {"extinction": -1.0}, r"extinction must be a finite number .* got -1.0"),
        (GREY, {"extinction": math.nan}, r"extinction must be"),
        (GREY, {"extinction": K, "method": "planer"}, r"did you mean 'planar'"),
        (GREY, {"extinction": K, "most_gain": 0.5}, r"most_gain must lie within 1 … 1000, got 0.5"),
        (GREY, {"extinction": K, "airlight": (1.0, 2.0, 3.0)}, r"airlight must be one pixel value or 1, got 3"),
        (GREY, {"extinction": K, "airlight": (300.0,)}, r"airlight must be brighter than black and at most 255"),
        (GREY, {"extinction": K, "airlight": (math.nan,)}, r"airlight must be brighter"),
    ]:
        with pytest.raises(InputError, match=told):
            restore_contrast(image, CAMERA, **arguments)
    with pytest.raises(InputError, match="the image has 8 bits, the camera 12"):
        restore_contrast(GREY, DEEP, K)
    with pytest.raises(InputError, match="of 12 bits are 0 … 4095, got 5000"):
        restore_contrast(np.full((120, 160), 5000, np.uint16), DEEP, K)
    with pytest.raises(InputError, match="16 bits and no value above 4000: write `bits: 12`"):
        restore_contrast(np.full((120, 160), 4000, np.uint16), CAMERA, K)
