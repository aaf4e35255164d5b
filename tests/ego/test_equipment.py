"""The truth about the fog at the ego's camera."""

import math

import pytest

from fogsim.ego.fog_truth import fog_truth
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, CameraPose, FogBank, FogField, SignMap

CAMERA = Camera(64, 48, 60.0, (32.0, 24.0), 1.4)
POSE = CameraPose((0.0, 0.0, 1.4), heading=0.0)


@pytest.mark.parametrize("visibility", [30.0, 80.0, 500.0])
def test_in_homogeneous_fog_the_visibility_ahead_is_that_at_the_camera(visibility: float) -> None:
    truth = fog_truth(FogField(extinction_from_visibility(visibility), (1.0,) * 3), POSE, CAMERA, SignMap())
    assert truth.visibility == pytest.approx(visibility)
    # Found between distances that are 2.5 % apart.
    assert truth.visibility_ahead == pytest.approx(visibility, rel=1e-3)


def test_clear_air_has_no_end_of_sight() -> None:
    truth = fog_truth(FogField(0.0, (1.0,) * 3), POSE, CAMERA, SignMap())
    assert (truth.extinction, truth.extinction_ahead) == (0.0, 0.0)
    assert truth.visibility == math.inf


def test_a_bank_ahead_ends_the_sight_as_far_within_as_its_optical_depth_says() -> None:
    k, begins = extinction_from_visibility(50.0), 200.0
    bank = FogBank(origin=(begins, 0.0), axis=(1.0, 0.0), start=0.0, end=1000.0, edge=1.0, extra_extinction=k)
    truth = fog_truth(FogField(0.0, (1.0,) * 3, banks=(bank,)), POSE, CAMERA, SignMap())
    assert truth.extinction == pytest.approx(0.0, abs=1e-12)
    assert truth.visibility_ahead == pytest.approx(begins + 50.0, rel=0.01)
    behind = fog_truth(
        FogField(0.0, (1.0,) * 3, banks=(bank,)), CameraPose((0.0, 0.0, 1.4), heading=math.pi), CAMERA, SignMap()
    )
    assert behind.extinction_ahead == 0.0
