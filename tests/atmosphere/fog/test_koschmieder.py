"""Fogged radiance against the closed form, and the definition of meteorological visibility."""

import math

import numpy as np
import pytest

from fogsim.atmosphere import airlight_from_illuminance, fogged_radiance, optical_depth
from fogsim.units import CONTRAST_THRESHOLD, extinction_from_visibility
from fogsim.values import Camera, CameraPose, FogBank, FogField, View
from fogsim.values.pinhole import ray_from_pixel

CAMERA = Camera(160, 120, 144.0, (80, 60), 1.38, 0.035)
POSE = CameraPose((10.0, 20.0, 1.38), 0.7)
AIRLIGHT = (2900.0, 3000.0, 3100.0)


def view(radiance: float, distance: float) -> View:
    shape = (CAMERA.height, CAMERA.width)
    return View(
        np.full((*shape, 3), radiance, np.float32), np.full(shape, distance, np.float32), np.zeros(shape, np.int32)
    )


@pytest.mark.parametrize("visibility", [30.0, 100.0, 400.0])
def test_a_black_target_at_the_visibility_shows_five_percent_contrast(visibility: float) -> None:
    field = FogField(extinction_from_visibility(visibility), AIRLIGHT)
    seen = fogged_radiance(view(0.0, visibility), field, POSE.position, ray_from_pixel(CAMERA, POSE))
    contrast = (np.array(AIRLIGHT) - seen) / np.array(AIRLIGHT)
    assert np.allclose(contrast, CONTRAST_THRESHOLD, atol=1e-6)


def test_clear_air_changes_nothing() -> None:
    clear = FogField(0.0, AIRLIGHT)
    for distance in (5.0, math.inf):
        seen = fogged_radiance(view(123.0, distance), clear, POSE.position, ray_from_pixel(CAMERA, POSE))
        assert np.array_equal(seen, np.full_like(seen, 123.0))


def test_no_distance_changes_nothing() -> None:
    seen = fogged_radiance(view(123.0, 0.0), FogField(0.1, AIRLIGHT), POSE.position, ray_from_pixel(CAMERA, POSE))
    assert np.allclose(seen, 123.0)


def test_endless_fog_is_airlight() -> None:
    seen = fogged_radiance(view(9e4, math.inf), FogField(0.001, AIRLIGHT), POSE.position, ray_from_pixel(CAMERA, POSE))
    assert np.allclose(seen, AIRLIGHT)


def test_every_pixel_of_a_bank_agrees_with_the_optical_depth() -> None:
    bank = FogBank((10.0, 20.0), (math.cos(0.5), math.sin(0.5)), 20.0, 90.0, 30.0, 0.05)
    field = FogField(0.002, AIRLIGHT, (bank,), top=15.0)
    rays = ray_from_pixel(CAMERA, POSE)
    seen = fogged_radiance(view(0.0, 120.0), field, POSE.position, rays)
    v, u = np.mgrid[0 : CAMERA.height, 0 : CAMERA.width]
    directions = np.einsum("ij,rcj->rci", rays, np.stack((u, v, np.ones_like(u)), axis=-1).astype(float))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    depth = optical_depth(field, POSE.position, np.array(POSE.position) + 120.0 * directions)
    expected = np.array(AIRLIGHT) * (1 - np.exp(-depth))[..., None]
    assert np.allclose(seen, expected, rtol=1e-5, atol=1e-2)


def test_sky_is_seen_through_the_layer_only() -> None:
    field = FogField(0.01, AIRLIGHT, top=11.38)
    seen = fogged_radiance(view(5000.0, math.inf), field, POSE.position, ray_from_pixel(CAMERA, POSE))
    top_left = ray_from_pixel(CAMERA, POSE) @ (0.0, 0.0, 1.0)
    transmittance = math.exp(-0.01 * 10.0 * np.linalg.norm(top_left) / top_left[2])
    assert seen[0, 0, 1] == pytest.approx(5000.0 * transmittance + 3000.0 * (1 - transmittance), rel=1e-5)


def test_airlight_of_an_overcast_day() -> None:
    # physics: L∞ ≈ E_h / π · (0.8 … 1.0); 10 klx give 2500 … 3200 cd/m²
    assert airlight_from_illuminance(10_000.0)[1] == pytest.approx(0.406 * 10_000.0 / math.pi)
    assert airlight_from_illuminance(0.0) == (0.0, 0.0, 0.0)


def test_from_the_top_of_the_fog_one_looks_down_into_it() -> None:
    field = FogField(0.06, AIRLIGHT, top=POSE.position[2])
    seen = fogged_radiance(view(0.0, 20.0), field, POSE.position, ray_from_pixel(CAMERA, POSE))
    assert seen[100, 80, 1] == pytest.approx(3000.0 * (1 - math.exp(-0.06 * 20.0)), rel=1e-4)
    assert seen[20, 80, 1] == pytest.approx(0.0, abs=0.01)
