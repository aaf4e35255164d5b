"""The vectorised exponential and the per-pixel loop, as exact as quantisation asks for."""

import math

import numpy as np

from fogsim.atmosphere import fogged_radiance, optical_depth
from fogsim.atmosphere.fog.koschmieder_kernels import transmittances
from fogsim.values import Camera, CameraPose, FogBank, FogField, View
from fogsim.values.pinhole import ray_from_pixel

AIRLIGHT = (2900.0, 3000.0, 3100.0)
CAMERA = Camera(160, 120, 144.0, (80, 60), 1.38, 0.035)


def exponential(depth: np.ndarray) -> np.ndarray:
    out = np.empty(depth.shape, np.float32)
    transmittances(depth.astype(np.float32), np.empty(depth.shape, np.int32), out)
    return out


def test_transmission_against_the_exponential_in_double_precision() -> None:
    depth = np.concatenate((np.linspace(0.0, 90.0, 300_001), np.geomspace(1e-9, 1.0, 10_000))).astype(np.float32)
    error = np.abs(exponential(depth) - np.exp(-depth.astype(np.float64)))
    assert error.max() < 3e-7


def test_transmission_of_nothing_and_of_everything() -> None:
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
            seen = (
                1.0 - fogged_radiance(black, field, pose.position, ray_from_pixel(CAMERA, pose))[..., 1] / AIRLIGHT[1]
            )
            v, u = np.mgrid[0 : CAMERA.height, 0 : CAMERA.width]
            rays = np.stack((u, v, np.ones_like(u)), axis=-1) @ ray_from_pixel(CAMERA, pose).T
            rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
            depth = optical_depth(field, pose.position, np.array(pose.position) + distance[..., None] * rays)
            assert np.abs(seen - np.exp(-depth)).max() < 1.0 / 4095.0
