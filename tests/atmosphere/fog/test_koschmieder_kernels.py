"""The vectorised exponential and the per-pixel loop, as exact as quantisation asks for."""

import math

import numpy as np
import pytest

from fogsim.atmosphere import fogged_radiance, optical_depth
from fogsim.atmosphere.fog.koschmieder_kernels import transmittances
from fogsim.values import Camera, CameraPose, FogBank, FogField, View
from fogsim.values.pinhole import ray_from_pixel
from tests.atmosphere.night_scene import rays

AIRLIGHT = (2900.0, 3000.0, 3100.0)
CAMERA = Camera(160, 120, 144.0, (80, 60), 1.38, 0.035)
POSE = CameraPose((10.0, 20.0, 1.38), 0.7)


def exponential(depth: np.ndarray) -> np.ndarray:
    out = np.empty(depth.shape, np.float32)
    transmittances(depth.astype(np.float32), np.empty(depth.shape, np.int32), out)
    return out


def test_transmission_against_the_exponential_in_double_precision() -> None:
    depth = np.concatenate((np.linspace(0.0, 90.0, 300_001), np.geomspace(1e-9, 1.0, 10_000))).astype(np.float32)
    error = np.abs(exponential(depth) - np.exp(-depth.astype(np.float64)))
    assert error.max() < 3e-7
    seen = exponential(np.array([0.0, -0.0, 1e7, 3.4e38, np.inf]))
    assert np.array_equal(seen[:2], [1.0, 1.0])
    assert np.all(seen[2:] >= 0)
    assert np.all(seen[2:] < 1e-30)


def test_a_frame_is_the_closed_form_within_a_quarter_of_a_12_bit_step() -> None:
    for visibility in [20.0, 80.0, 400.0, 5000.0]:
        rng = np.random.default_rng(2)
        shape = (CAMERA.height, CAMERA.width)
        distance = rng.uniform(0.0, 3.0 * visibility, shape).astype(np.float32)
        scene = View(rng.uniform(0, 5000, (*shape, 3)).astype(np.float32), distance, np.zeros(shape, np.int32))
        k = math.log(20.0) / visibility
        pose = CameraPose((0.0, 0.0, 1.38), 0.4)
        seen = fogged_radiance(scene, FogField(k, AIRLIGHT), pose.position, ray_from_pixel(CAMERA, pose))
        transmittance = np.exp(-k * distance.astype(np.float64))[..., None]
        exact = scene.radiance * transmittance + np.array(AIRLIGHT) * (1.0 - transmittance)
        assert np.abs(seen - exact).max() < 0.25 * 5000.0 / 4095.0


def test_every_direction_through_a_bank_within_a_12_bit_step() -> None:
    for station in [-200.0, 45.0, 900.0]:
        for turn in [0.0, 0.3, 1.2, math.pi / 2, 3.0]:
            field = FogField(0.002, AIRLIGHT, (FogBank((0.0, 0.0), (1.0, 0.0), 0.0, 1200.0, 90.0, 0.05),), top=80.0)
            shape = (CAMERA.height, CAMERA.width)
            distance = np.random.default_rng(3).uniform(1.0, 400.0, shape).astype(np.float32)
            pose = CameraPose((station, 5.0, 1.38), turn)
            black = View(np.zeros((*shape, 3), np.float32), distance, np.zeros(shape, np.int32))
            light = fogged_radiance(black, field, pose.position, ray_from_pixel(CAMERA, pose))
            seen = 1.0 - light[..., 1] / AIRLIGHT[1]
            ends = np.array(pose.position) + distance[..., None] * rays(CAMERA, pose)
            depth = optical_depth(field, pose.position, ends)
            assert np.abs(seen - np.exp(-depth)).max() < 1.0 / 4095.0


def drawn(radiance: float, distance: float, field: FogField) -> np.ndarray:
    shape = (CAMERA.height, CAMERA.width)
    light, far = np.full((*shape, 3), radiance, np.float32), np.full(shape, distance, np.float32)
    view = View(light, far, np.zeros(shape, np.int32))
    return fogged_radiance(view, field, POSE.position, ray_from_pixel(CAMERA, POSE))


def test_clear_air_and_no_distance_change_nothing_and_endless_fog_is_airlight() -> None:
    for distance in (5.0, math.inf):
        assert (drawn(123.0, distance, FogField(0.0, AIRLIGHT)) == 123.0).all()
    assert np.allclose(drawn(123.0, 0.0, FogField(0.1, AIRLIGHT)), 123.0)
    assert np.allclose(drawn(9e4, math.inf, FogField(0.001, AIRLIGHT)), AIRLIGHT)


def test_sky_is_seen_through_the_layer_only() -> None:
    field = FogField(0.01, AIRLIGHT, top=11.38)
    seen = drawn(5000.0, math.inf, field)
    top_left = ray_from_pixel(CAMERA, POSE) @ (0.0, 0.0, 1.0)
    transmittance = math.exp(-0.01 * 10.0 * np.linalg.norm(top_left) / top_left[2])
    assert seen[0, 0, 1] == pytest.approx(5000.0 * transmittance + 3000.0 * (1 - transmittance), rel=1e-5)
    field = FogField(0.06, AIRLIGHT, top=POSE.position[2])
    seen = drawn(0.0, 20.0, field)
    assert seen[100, 80, 1] == pytest.approx(3000.0 * (1 - math.exp(-0.06 * 20.0)), rel=1e-4)
    assert seen[20, 80, 1] == pytest.approx(0.0, abs=0.01)
