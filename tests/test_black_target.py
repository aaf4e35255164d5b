"""The definition of meteorological visibility, end to end: drawn by the renderer, seen through the fog."""

import contextlib

import numpy as np
import pytest

from fogsim.atmosphere import fogged_radiance
from fogsim.render import make_renderer
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, CameraPose, FogField
from fogsim.values.pinhole import ray_from_pixel
from tests.render.conftest import walls

CAMERA = Camera(320, 240, 600.0, (160, 120), mount_height=1.4)
POSE = CameraPose((0.0, 0.0, 1.4), heading=0.0)
AIRLIGHT = (2900.0, 3000.0, 3100.0)


@pytest.mark.parametrize("visibility", [40.0, 300.0])
def test_a_black_target_at_the_visibility_shows_five_percent_contrast(visibility: float) -> None:
    wall = walls(visibility)
    wall.ground.reflectance[:] = 0.0
    with contextlib.closing(make_renderer("auto", wall, illuminance=10_000.0)) as renderer:
        view = renderer.render((), CAMERA, POSE)
    fog = FogField(extinction_from_visibility(visibility), AIRLIGHT)
    seen = fogged_radiance(view, fog, POSE.position, ray_from_pixel(CAMERA, POSE))
    middle = seen[120, 160]
    assert view.instance[120, 160] == 3
    assert view.distance[120, 160] == pytest.approx(visibility, rel=1e-4)
    contrast = (np.array(AIRLIGHT) - middle) / np.array(AIRLIGHT)
    assert contrast == pytest.approx([0.05] * 3, rel=1e-3)
