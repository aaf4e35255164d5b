"""Fog and tunnels: none inside, all of it outside, and the same law between for whoever asks."""

import dataclasses
import math

import numpy as np
import pytest

from fogsim.atmosphere import Air, FieldAccess, extinction, optical_depth, optical_depth_along
from fogsim.scenario import build, load_scenario
from fogsim.values import Camera, CameraPose, FogField, FogShelter, Structure, StructureKind, View

K = 0.06
SHELTER = FogShelter(((100.0, 0.0, 0.0), (500.0, 0.0, 0.0)), 5.0, 5.2, 10.0)
OPEN = FogField(K, (3000.0, 3000.0, 3000.0))
FIELD = dataclasses.replace(OPEN, shelters=(SHELTER,))
EYES = 1.2


def test_fog_ends_within_its_reach_behind_the_portals() -> None:
    at = [(x, 0.0, EYES) for x in (0.0, 100.0, 105.0, 110.0, 300.0, 490.0, 495.0, 500.0, 600.0)]
    shares = [1.0, 1.0, 0.5, 0.0, 0.0, 0.0, 0.5, 1.0, 1.0]
    assert extinction(FIELD, at) / K == pytest.approx(shares, abs=1e-12)
    assert extinction(FIELD, (300.0, 60.0, EYES)) == pytest.approx(K)
    assert extinction(FIELD, (300.0, 34.0, EYES)) == 0.0
    windy = dataclasses.replace(FIELD, wind=(10.0, 0.0))
    assert extinction(windy, (300.0, 0.0, EYES), 30.0) == 0.0
    access = FieldAccess(FIELD)
    assert (access.minimum_extinction, access.maximum_extinction) == (0.0, K)
    assert FieldAccess(OPEN).minimum_extinction == K


def test_optical_depth_is_that_of_the_way_outside() -> None:
    # Of each edge of 10 m a half counts.
    through = optical_depth(FIELD, (50.0, 0.0, EYES), (550.0, 2.0, EYES))
    assert through == pytest.approx(K * (50.0 + 50.0 + 2 * 5.0) * math.hypot(500.0, 2.0) / 500.0, rel=1e-9)
    assert optical_depth(FIELD, (550.0, 2.0, EYES), (50.0, 0.0, EYES)) == pytest.approx(float(through), rel=1e-12)
    assert optical_depth(FIELD, (120.0, 0.0, EYES), (480.0, 0.0, EYES)) == 0.0
    along = optical_depth_along(FIELD, (50.0, 0.0, EYES), (1.0, 0.0, 0.0), (10.0, 50.0, 60.0, 300.0, 500.0))
    assert along == pytest.approx(K * np.array([10.0, 50.0, 55.0, 55.0, 110.0]), rel=1e-9)
    aside = optical_depth(FIELD, (300.0, 0.0, EYES), (300.0, 100.0, EYES))
    assert aside == pytest.approx(K * (100.0 - 45.0), rel=1e-9)


def tunnel_field(*settings: str) -> FogField:
    line = np.array([[200.0, 3.0, 0.0], [600.0, 3.0, 0.0]])
    sizes = ((0.6, 0.0, 5.2), (12.0, 5.2, 6.0))
    structures = [Structure("t", StructureKind.TUNNEL, line, *size) for size in sizes]
    scenario = load_scenario("motorway_fog_bank", [f"fog.{s}" for s in ("visibility_m=50", *settings)])
    return build.world_config(scenario).fog.along(np.array([[0.0, 0.0, 0.0], [900.0, 0.0, 0.0]]), structures)


def test_a_scenarios_tunnels_keep_its_fog_out_unless_asked() -> None:
    (shelter,) = tunnel_field().shelters
    assert shelter == FogShelter(((200.0, 3.0, 0.0), (600.0, 3.0, 0.0)), 6.0, 5.2, 10.0)
    assert tunnel_field("in_tunnels_m=50").shelters[0].reach == 50.0
    assert tunnel_field("in_tunnels_m=inf").shelters == ()
    sharp = tunnel_field("in_tunnels_m=0")
    assert extinction(sharp, (200.6, 3.0, EYES)) == 0.0


def test_from_outside_only_the_tunnel_itself_is_clear() -> None:
    """A camera 20 m before the portal: fog up to it, none behind it, and all of it past the tunnel's side."""
    camera, pose = Camera(64, 48, 60.0, (31.5, 23.5), 1.4), CameraPose((80.0, 0.0, 1.4), 0.0)
    black = np.zeros((48, 64, 3), np.float32)
    view = View(black, np.full((48, 64), 200.0, np.float32), np.zeros((48, 64), np.int32))
    radiance = Air(FIELD).radiance(view, camera, pose)[..., 1]
    air = 3000.0
    within, past = radiance[24, 32], radiance[24, 10]
    assert within == pytest.approx(air * (1.0 - math.exp(-K * 25.0)), rel=0.02)
    assert past == pytest.approx(air * (1.0 - math.exp(-K * 200.0)), rel=0.001)
    inside = dataclasses.replace(pose, position=(250.0, 0.0, 1.4))
    share = Air(FIELD).transmittance(view, camera, pose)
    assert share[24, 32] == pytest.approx(math.exp(-K * 25.0), rel=0.02)
    assert share[24, 10] == pytest.approx(math.exp(-K * 200.0), abs=1e-4)
    assert Air(FIELD).radiance(view, camera, inside)[24, 32, 1] == pytest.approx(0.0, abs=1.0)
