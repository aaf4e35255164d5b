"""Airlight of an overcast day, and how it dims under the fog overhead."""

import dataclasses
import math

import numpy as np
import pytest

from fogsim.atmosphere import airlight_from_illuminance, frustum_grid
from fogsim.atmosphere.fog.airlight import airlight_source
from fogsim.units import luminance_of
from fogsim.values import Camera, CameraPose, FogField

CAMERA = Camera(160, 120, 144.0, (80, 60), 1.38)
POSE = CameraPose((0.0, 0.0, 1.38), 0.0)
LAYER = FogField(0.02, (1000.0, 1000.0, 1000.0), top=60.0, top_edge=20.0)


def test_airlight_is_that_of_a_white_diffuser_times_its_share() -> None:
    assert luminance_of(airlight_from_illuminance(10_000.0)) == pytest.approx(0.406 * 10_000.0 / math.pi, rel=3e-3)
    assert airlight_from_illuminance(0.0) == (0.0, 0.0, 0.0)
    for illuminance in [-1.0, math.nan, math.inf]:
        with pytest.raises(ValueError, match="illuminance must be finite and not negative"):
            airlight_from_illuminance(illuminance)


def test_a_path_upward_is_brighter_and_one_along_the_ground_as_it_was() -> None:
    shaded = dataclasses.replace(LAYER, airlight_shading=0.1)
    grid = frustum_grid(shaded, CAMERA, POSE)
    assert airlight_source(LAYER, grid) is None
    source = airlight_source(shaded, grid)
    assert source is not None
    assert source.shape[-1] == 3
    assert np.all(source[..., 0, :] == 0.0)
    up, level = source[0, 0, -1, 0], source[np.argmin(np.abs(grid.directions[:, 0, 2])), 0, -1, 0]
    assert up > 10.0
    # Seen level, all light comes from the height of the eye, over which 1.38 m less of fog lie than over the ground.
    excess = (1.0 + 0.1 * 0.02 * 60.0) / (1.0 + 0.1 * 0.02 * (60.0 - 1.38)) - 1.0
    assert level == pytest.approx(1000.0 * excess, abs=0.2)


@pytest.mark.parametrize("base_edge", [0.0, 4.0])
def test_under_lifted_fog_the_ground_has_all_of_it_overhead(base_edge: float) -> None:
    lifted = FogField(0.03, (1000.0,) * 3, top=80.0, base=5.0, base_edge=base_edge, airlight_shading=0.1)
    source = airlight_source(lifted, frustum_grid(lifted, CAMERA, POSE))
    assert source is not None
    assert source.min() > -1.0
    # Most of what is seen of the fog has more than 1.5 of its optical depth of 2.25 overhead.
    assert 20.0 < source.max() < 1000.0 * (1.225 / 1.15 - 1.0)
