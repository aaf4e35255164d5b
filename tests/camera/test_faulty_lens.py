"""Dirt, water and glare before the camera."""

import math
from dataclasses import replace

import numpy as np
import pytest

from fogsim.camera import FaultyLens
from fogsim.camera.faulty_lens import PUPIL, passed_light, scattered_blots, shared_area
from fogsim.values import Camera, Fault, RunningFault
from fogsim.values.fault import DirtyLens, FaultKind, FrozenFrame, Glare, TimeStamp, WetLens

CAMERA = Camera(320, 240, 290.0, (160.0, 120.0), 1.4)
GREY = np.full((240, 320, 3), 50.0, np.float32)
HALF = np.where(np.arange(240)[:, None, None] < 120, 100.0, 10.0).astype(np.float32) * np.ones((1, 320, 3), np.float32)


def seen(radiance: np.ndarray, *kinds: FaultKind, seed: int = 4, camera: Camera = CAMERA) -> np.ndarray:
    faults = [RunningFault(Fault(kind), 0.0, math.inf, np.random.default_rng(seed)) for kind in kinds]
    return FaultyLens().look_through(radiance, camera, faults)


def test_circles_share_what_geometry_says() -> None:
    for distance, one, other, area in [
        (0.0, 1.0, 2.0, math.pi),
        (1.0, 3.0, 2.0, 4.0 * math.pi),
        (3.0, 1.0, 2.0, 0.0),
        # Two circles of radius 1 whose middles lie on each other: 2π/3 − √3/2.
        (1.0, 1.0, 1.0, 2.0 * math.pi / 3.0 - math.sqrt(3.0) / 2.0),
    ]:
        assert float(shared_area(np.array([distance]), one, other)[0]) == pytest.approx(area, abs=1e-9)


def test_blots_take_as_much_light_as_they_cover() -> None:
    """At random over one another, they leave e^(−coverage) on average (a Boolean model of discs)."""
    blots = [scattered_blots(CAMERA, 0.3, 0.002, np.random.default_rng(seed)) for seed in range(12)]
    assert np.mean([passed_light(CAMERA, one).mean() for one in blots]) == pytest.approx(math.exp(-0.3), rel=0.03)


def test_a_blot_smaller_than_the_pupil_hides_its_share_of_it_and_is_as_wide() -> None:
    one = scattered_blots(CAMERA, 0.3, 0.001, np.random.default_rng(1))._replace(
        right=np.zeros(1), down=np.zeros(1), radius=np.array([0.5 * PUPIL])
    )
    passed = passed_light(CAMERA, one)[..., 0]
    assert passed[120, 160] == pytest.approx(1.0 - 0.25)
    reach = 1.5 * PUPIL * CAMERA.focal_length
    assert np.flatnonzero(passed[120] < 1.0).max() - 160 == pytest.approx(reach, abs=1.0)


def test_water_dirt_as_bright_as_an_even_scene_and_faults_of_the_signal_leave_its_light_alone() -> None:
    assert seen(GREY, FrozenFrame(TimeStamp.DELIVERY)) is GREY
    np.testing.assert_allclose(seen(GREY, WetLens(0.3, 0.004, 0.005)), GREY, rtol=1e-3)
    np.testing.assert_allclose(seen(GREY, DirtyLens(0.1, 0.002, 1.0)), GREY, rtol=1e-5)
    dark = seen(GREY, DirtyLens(0.2, 0.004, 0.0))
    assert dark.min() < 0.05 * 50.0
    assert dark.max() == pytest.approx(50.0)


def test_drops_show_the_scene_upside_down() -> None:
    """In the sky they are dark above, before the road bright below; the film blurs the edge between."""
    wet = seen(HALF, WetLens(0.3, 0.006, 0.0))
    changed = np.abs(wet - HALF).max(axis=2) > 5.0
    assert wet[:100][changed[:100]].max() < 100.0
    assert wet[140:][changed[140:]].min() > 10.0
    assert wet.min() >= 10.0 - 1e-3
    assert wet.max() <= 100.0 + 1e-3
    film = seen(HALF, WetLens(0.0, 0.003, math.radians(0.5)))
    assert film[119, 160, 0] == pytest.approx(55.0 + 45.0 * math.erf(0.5 / (math.radians(0.5) * 290.0 * 2**0.5)), abs=2)


def test_dirt_stays_where_it_is_until_it_is_another_fault() -> None:
    lens, fault = FaultyLens(), RunningFault(Fault(DirtyLens(0.1, 0.002, 0.3)), 0.0, 9.0, np.random.default_rng(4))
    first = lens.look_through(GREY, CAMERA, [fault])
    np.testing.assert_array_equal(lens.look_through(GREY, CAMERA, [fault]), first)
    lens.reset()
    np.testing.assert_array_equal(lens.look_through(GREY, CAMERA, [fault]), first)
    assert not np.array_equal(seen(GREY, DirtyLens(0.1, 0.002, 0.3), seed=5), first)


def test_a_source_adds_its_illuminance_and_a_veil_that_falls_with_the_angle() -> None:
    camera = Camera(320, 240, 1000.0, (160.0, 120.0), 1.4)
    glare = seen(np.zeros_like(GREY), Glare(0.0, 0.0, 1000.0, 1.0), camera=camera)[..., 0].astype(float)
    # The sun's disc of 0.27° is 4.7 px here; its light over the solid angle of the pixels is its illuminance.
    disc = glare[110:131, 150:171]
    assert (disc - disc[0, 0]).sum() / 1000.0**2 == pytest.approx(1000.0, rel=0.05)
    far = 0.4 * 561.0 / 88_900.0
    for pixels in (17, 35, 70):
        angle = math.degrees(math.atan(pixels / 1000.0))
        assert glare[120, 160 + pixels] == pytest.approx(1000.0 * (1.0 / angle**2 + far), rel=1e-4)


def test_a_source_on_the_left_and_above_is_drawn_there_whatever_the_pitch() -> None:
    glare = Glare(math.radians(10.0), math.radians(4.0), 1000.0, 1.0)
    bright = seen(np.zeros_like(GREY), glare, camera=replace(CAMERA, pitch=math.radians(5.0)))[..., 0]
    row, column = np.unravel_index(int(bright.argmax()), bright.shape)
    # tan 10° to the left of the axis, over cos 5° of the way along it; 4° and 5° above it.
    assert int(column) == pytest.approx(160 - 290 * math.tan(math.radians(10.0)), abs=2.5)
    assert int(row) == pytest.approx(120 - 290 * math.tan(math.radians(9.0)), abs=2.5)
