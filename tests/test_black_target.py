"""The definition of meteorological visibility, end to end: drawn by the renderer, seen through the fog."""

import contextlib

import numpy as np
import pytest

from fogsim.atmosphere import fogged_radiance
from fogsim.render import make_renderer
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, CameraPose, FogField, Mesh, Scene, Surface
from fogsim.values.pinhole import ray_from_pixel

CAMERA = Camera(320, 240, 600.0, (160, 120), mount_height=1.4)
POSE = CameraPose((0.0, 0.0, 1.4), heading=0.0)
AIRLIGHT = (2900.0, 3000.0, 3100.0)


def black_wall(distance: float) -> Scene:
    """A black wall across the view, its face at a distance ahead of the camera [m]."""
    half = 20.0
    corners = [(distance, y, z) for y in (-half, half) for z in (-half, half)]
    mesh = Mesh(
        positions=np.array(corners, dtype=np.float32),
        normals=np.tile(np.array((-1.0, 0.0, 0.0), dtype=np.float32), (4, 1)),
        reflectance=np.zeros((4, 3), dtype=np.float32),
        surface=np.full(4, Surface.MATT, dtype=np.int32),
        road=np.zeros((4, 4), dtype=np.float32),
        instance=np.full(4, 3, dtype=np.int32),
        faces=np.array(((0, 2, 1), (1, 2, 3)), dtype=np.uint32),
    )
    return Scene(ground=mesh, shapes={}, scenery=())


@pytest.mark.parametrize("visibility", [40.0, 300.0])
def test_a_black_target_at_the_visibility_shows_five_percent_contrast(visibility: float) -> None:
    with contextlib.closing(make_renderer("auto", black_wall(visibility), illuminance=10_000.0)) as renderer:
        view = renderer.render((), CAMERA, POSE)
    fog = FogField(extinction_from_visibility(visibility), AIRLIGHT)
    seen = fogged_radiance(view, fog, POSE.position, ray_from_pixel(CAMERA, POSE))
    middle = seen[120, 160]
    assert view.instance[120, 160] == 3
    assert view.distance[120, 160] == pytest.approx(visibility, rel=1e-4)
    contrast = (np.array(AIRLIGHT) - middle) / np.array(AIRLIGHT)
    assert contrast == pytest.approx([0.05] * 3, rel=1e-3)
