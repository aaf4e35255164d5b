"""Frames of uneven fog: the grid against brute force, against the closed form, and what it costs."""

import dataclasses
import math

import numpy as np
import pytest
from numpy.typing import NDArray

from fogsim.atmosphere import Air, fogged_radiance, frustum_grid, optical_depth, radiance_through_grid
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, CameraPose, FogChange, FogField, View
from fogsim.values.pinhole import ray_from_pixel
from tests.atmosphere.fields import AIRLIGHT, BANK, CAMERA, POSE, UNEVEN, brute_force
from tests.atmosphere.night_scene import rays

SMALL = Camera(160, 120, 144.0, (80, 60), 1.38, 0.035)


def black_road(camera: Camera, pose: CameraPose) -> View:
    """A level black road with black boxes on it, under a black sky."""
    towards = rays(camera, pose)[..., 2]
    with np.errstate(divide="ignore"):
        distance = np.where(towards < 0, -pose.position[2] / towards, np.inf)
    rng = np.random.default_rng(4)
    for box in (8, 15, 25, 40, 60, 90, 130, 200, 300, 500) * 3:
        half = int(1 + 1.2 * camera.focal_length / box)
        v = int(camera.horizon_row + rng.uniform(-2, 1) * half)
        u = int(rng.integers(0, camera.width))
        part = (slice(max(0, v - half), max(0, v + half)), slice(max(0, u - half), u + half))
        distance[part] = np.minimum(distance[part], box)
    shape = distance.shape
    return View(np.zeros((*shape, 3), np.float32), distance.astype(np.float32), np.zeros(shape, np.int32))


def transmittance(radiance: NDArray[np.float32]) -> NDArray[np.float64]:
    return 1.0 - radiance[..., 1].astype(np.float64) / AIRLIGHT[1]


def slow_transmission(field: FogField, view: View, camera: Camera, pose: CameraPose, every: int) -> NDArray[np.float64]:
    """Brute force over the first 6 km of every so manieth ray, by far the most of what can be seen."""
    part = (slice(every // 2, None, every), slice(every // 2, None, every))
    eye, ends = np.array(pose.position), np.minimum(view.distance[part].astype(np.float64), 6000.0)
    inner = eye + np.minimum(ends, 600.0)[..., None] * rays(camera, pose)[part]
    outer = eye + ends[..., None] * rays(camera, pose)[part]
    lines = zip(inner.reshape(-1, 3), outer.reshape(-1, 3), strict=True)
    beyond = np.stack([brute_force(field, a, b, 300) for a, b in lines])
    return np.exp(-brute_force(field, eye, inner, 600) - beyond.reshape(ends.shape))


def test_whole_frames_against_brute_force() -> None:
    for name in UNEVEN:
        view = black_road(CAMERA, POSE)
        seen = transmittance(Air(UNEVEN[name]).radiance(view, CAMERA, POSE))[12::24, 12::24]
        slow = slow_transmission(UNEVEN[name], view, CAMERA, POSE, 24)
        assert np.sqrt(np.mean(np.square(seen - slow))) <= 0.005


def test_small_frames_with_a_rolled_camera_against_brute_force() -> None:
    camera, pose = dataclasses.replace(SMALL, roll=0.15), CameraPose((30.0, 20.0, 1.38), 0.9, grade=0.04)
    view = black_road(camera, pose)
    field = UNEVEN["all at once"]
    seen = transmittance(Air(field).radiance(view, camera, pose))[2::4, 2::4]
    slow = slow_transmission(field, view, camera, pose, 4)
    assert np.sqrt(np.mean(np.square(seen - slow))) <= 0.005


@pytest.mark.parametrize("field", [FogField(0.03, AIRLIGHT, top=250.0), FogField(0.002, AIRLIGHT, (BANK,), top=60.0)])
def test_the_grid_agrees_with_the_closed_form(field: FogField) -> None:
    view = black_road(CAMERA, POSE)
    through_grid = radiance_through_grid(view, frustum_grid(field, CAMERA, POSE), field.airlight)
    exact = fogged_radiance(view, field, POSE.position, ray_from_pixel(CAMERA, POSE))
    assert np.sqrt(np.mean(np.square(transmittance(through_grid) - transmittance(exact)))) <= 0.002


def test_a_source_on_the_grid_comes_to_the_pixels() -> None:
    grid = frustum_grid(UNEVEN["ground fog"], SMALL, POSE)
    view = black_road(SMALL, POSE)
    # A source that is linear in distance, row and column is interpolated exactly.
    reach = np.minimum(grid.distances, 400.0)
    plane = grid.rows[:, None, None] + 2.0 * grid.columns[:, None] + 3.0 * reach
    source = np.repeat(plane[..., None], 3, axis=-1).astype(np.float32)
    added = radiance_through_grid(view, grid, AIRLIGHT, source) - radiance_through_grid(view, grid, AIRLIGHT)
    v, u = np.mgrid[0 : SMALL.height, 0 : SMALL.width]
    near = view.distance < grid.distances[np.searchsorted(grid.distances, 400.0) - 1]
    assert np.allclose(added[near][:, 0], (v + 2.0 * u + 3.0 * view.distance)[near], rtol=1e-3, atol=0.5)


def test_a_camera_above_the_fog_sees_into_it() -> None:
    field, pose = FogField(0.05, AIRLIGHT, top=10.0), CameraPose((0.0, 0.0, 30.0), 0.0)
    view = black_road(SMALL, pose)
    seen = transmittance(Air(field).radiance(view, SMALL, pose))
    down = rays(SMALL, pose)[..., 2]
    level = np.abs(down) < 0.3
    expected = np.exp(-0.05 * np.where(down < 0, (view.distance - 20.0 / np.maximum(-down, 1e-9)).clip(0.0), 0.0))
    road = (down < -0.02) & np.isclose(view.distance, -30.0 / np.minimum(down, -1e-9), rtol=1e-3)
    assert np.sqrt(np.mean(np.square(seen - expected)[road])) < 0.01
    assert np.allclose(seen[(down > 0.01) & level & np.isinf(view.distance)], 1.0, atol=1e-4)


def test_clear_uneven_air_changes_nothing() -> None:
    field = dataclasses.replace(UNEVEN["ground fog"], extinction=0.0)
    view = black_road(SMALL, POSE)
    light = np.random.default_rng(0).uniform(0, 9e3, view.radiance.shape).astype("f4")
    bright = dataclasses.replace(view, radiance=light)
    assert np.array_equal(Air(field).radiance(bright, SMALL, POSE), bright.radiance)


def test_fog_moves_with_time() -> None:
    field = dataclasses.replace(UNEVEN["patches"], wind=(8.0, 0.0))
    denser = dataclasses.replace(
        field, wind=(0.0, 0.0), changes=(FogChange(0.0, 1.0, -math.inf, 250.0), FogChange(9.0, 4.0, -math.inf, 250.0))
    )
    view = black_road(SMALL, POSE)
    start, later = (transmittance(Air(field).radiance(view, SMALL, POSE, time=t)) for t in (0.0, 4.0))
    assert np.abs(start - later).max() > 0.05
    assert transmittance(Air(denser).radiance(view, SMALL, POSE, time=9.0)).mean() < start.mean()


def test_shaded_airlight_is_darker_where_fog_is_deep_and_the_field_s_own_on_the_ground() -> None:
    even = FogField(0.05, AIRLIGHT, top=60.0)
    shaded = dataclasses.replace(even, airlight_shading=0.1)
    view = black_road(SMALL, POSE)
    level, up = SMALL.height - 1, 0
    one, other = (Air(field).radiance(view, SMALL, POSE) for field in (even, shaded))
    # At the ground the shaded airlight is the even one; upwards there is less fog overhead, and more light.
    assert np.allclose(other[level], one[level], rtol=0.02)
    assert np.all(other[up] > 1.02 * one[up])
    even = FogField(0.05, AIRLIGHT, top=250.0)
    # Nor is a level view through a deep layer touched.
    row = round(SMALL.horizon_row)
    one, other = (Air(dataclasses.replace(even, airlight_shading=s)).radiance(view, SMALL, POSE)[row] for s in (0, 0.1))
    assert np.allclose(other, one, rtol=0.02)


def test_lamps_fade_in_dense_fog_with_a_soft_top() -> None:
    field = FogField(extinction_from_visibility(50.0), (0.0, 0.0, 0.0), top=250.0, top_edge=20.0)
    shape = (SMALL.height, SMALL.width)
    view = View(np.full((*shape, 3), 3e4, np.float32), np.full(shape, 250.0, np.float32), np.zeros(shape, np.int32))
    seen = Air(field).radiance(view, SMALL, POSE)[round(SMALL.horizon_row), 80, 1]
    assert seen == pytest.approx(3e4 * math.exp(-250.0 * field.extinction), rel=0.05)


def test_a_thin_layer_between_two_nodes_is_seen() -> None:
    field = FogField(extinction_from_visibility(50.0), AIRLIGHT, top=110.0, base=100.0)
    grid = frustum_grid(field, SMALL, POSE)
    up = grid.directions[..., 2] > 0.01
    exact = optical_depth(field, grid.eye, grid.eye + 2e5 * grid.directions[up])
    assert np.allclose(grid.depth[up][:, -1], np.minimum(exact, 60.0), rtol=1e-3)
