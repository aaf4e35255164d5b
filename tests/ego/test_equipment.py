"""The truth about the fog at the ego's camera."""

import math

import numpy as np
import pytest

from fogsim.simulation.ego.fog_truth import KnownWay, fog_truth
from fogsim.units import extinction_from_visibility
from fogsim.values import Camera, CameraPose, FogBank, FogField, SignMap

CAMERA = Camera(64, 48, 60.0, (32.0, 24.0), 1.4)
POSE = CameraPose((0.0, 0.0, 1.4), heading=0.0)


def test_in_homogeneous_fog_the_visibility_ahead_is_that_at_the_camera() -> None:
    truth = fog_truth(FogField(extinction_from_visibility(30.0), (1.0,) * 3), POSE, CAMERA, SignMap())
    assert truth.visibility == pytest.approx(30.0)
    # Found between distances that are 2.5 % apart.
    assert truth.visibility_ahead == pytest.approx(30.0, rel=1e-3)


def test_clear_air_has_no_end_of_sight_and_a_logarithm_too() -> None:
    way = KnownWay(np.array([[0.0, 0.0, 0.0], [400.0, 0.0, 0.0]]))
    truth = fog_truth(FogField(0.0, (1.0,) * 3), POSE, CAMERA, SignMap(), way=way, place=0.0)
    assert (truth.extinction, truth.extinction_ahead, truth.visibility) == (0.0, 0.0, math.inf)
    assert truth.profile.log_extinction == pytest.approx(math.log(1e-6))


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


def test_the_fog_along_the_route_is_told_as_far_as_the_route_goes() -> None:
    route = np.array([[0.0, 0.0, 0.0], [400.0, 0.0, 0.0], [400.0, 300.0, 0.0]])
    # A slab across the second leg of the way, 100 m beyond its corner.
    bank = FogBank(origin=(400.0, 0.0), axis=(0.0, 1.0), start=100.0, end=1000.0, edge=1.0, extra_extinction=0.05)
    fog = FogField(0.002, (1.0,) * 3, banks=(bank,))
    told = fog_truth(fog, POSE, CAMERA, SignMap(), way=KnownWay(route), place=100.0).profile
    assert (told.distance[0], told.distance[-1]) == (-100.0, 600.0)
    assert told.at(350.0) == pytest.approx((math.log(0.002), 0.0))
    assert told.at(450.0) == pytest.approx((math.log(0.052), 0.0))
    assert fog_truth(fog, POSE, CAMERA, SignMap(), way=KnownWay(route)).profile is None
    assert fog_truth(fog, POSE, CAMERA, SignMap(), place=100.0).profile is None
