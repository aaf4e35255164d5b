"""Staged scenes of the papers' evaluations."""

import numpy as np
import pytest

from fogsim.calibration.staged_road import (
    AIRLIGHT,
    StagedVehicle,
    foggy_image,
    foggy_radiance,
    staged_traffic,
    standing_cars,
)
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, CameraPose, Response, View

CAMERA = Camera(64, 48, 60.0, (32.0, 24.0), 1.4, response=Response.LINEAR)
POSE = CameraPose((0.0, 0.0, 1.4), heading=0.0)


def black_at(distance: float) -> View:
    shape = (CAMERA.height, CAMERA.width)
    return View(np.zeros((*shape, 3), np.float32), np.full(shape, distance, np.float32), np.zeros(shape, np.int32))


@pytest.mark.parametrize("visibility", [50.0, 200.0])
def test_a_black_target_at_the_visibility_has_95_percent_of_the_airlight(visibility: float) -> None:
    seen = foggy_radiance(black_at(visibility), POSE, CAMERA, extinction_from_visibility(visibility))
    np.testing.assert_allclose(seen, 0.95 * AIRLIGHT, rtol=1e-5)


def test_the_airlight_fills_the_pixels_and_black_nearby_does_not() -> None:
    assert np.all(foggy_image(black_at(1e6), POSE, CAMERA, 0.05) == 255)
    assert np.all(foggy_image(black_at(0.0), POSE, CAMERA, 0.05) == 0)


def test_vehicles_stand_with_their_rears_where_they_are_put() -> None:
    lorry = StagedVehicle("truck", 16.5, 2.55, 4.0, left=-3.5, name="lorry")
    state = staged_traffic([(40.0, lorry), (90.0, StagedVehicle())], speed=25.0)
    np.testing.assert_array_equal(state.position, [[56.5, -3.5, 0.0], [94.5, 0.1, 0.0]])
    assert (state.ids, state.types) == (("lorry", "followed"), ("truck", "car"))
    np.testing.assert_array_equal(state.speed, [25.0, 25.0])
    assert standing_cars(()).position.shape == (0, 3)
    assert standing_cars([(10.0, 1.0)]).ids == ("car 0",)
