"""Distances on the road by how far its texture moves."""

import math
from dataclasses import replace

import numpy as np
import pytest
from early_motorway import EARLY

import fogsim
from fogsim.offline import find_source, guess_camera
from fogsim.offline.drive.road_scale import RoadMotion


@pytest.fixture(scope="module")
def steps():
    scenario = fogsim.load_scenario("motorway_fog_bank", [EARLY, "fog.visibility_m=120", "duration_s=1.5"])
    return [(step.observation.frame, step.observation.speed) for step in fogsim.run(scenario, seed=1)]


@pytest.mark.parametrize("factor", [0.8, 1.0, 1.3])
def test_the_product_of_focal_length_and_height_follows_from_the_way(steps, factor: float) -> None:
    true = steps[0][0].camera
    pitch = math.atan(math.tan(true.pitch) / factor)
    motion = RoadMotion(replace(true, focal_length=true.focal_length * factor, pitch=pitch))
    way = np.concatenate(([0.0], np.cumsum([0.1 * speed for _, speed in steps[1:]])))
    for (frame, _), at in zip(steps, way, strict=True):
        motion.add(frame.image, float(at))
    scale = motion.scale()
    assert scale.factor * factor == pytest.approx(1.0, abs=2.0 * scale.deviation)
    assert scale.deviation < 0.05


def test_nothing_follows_from_standing_or_from_a_blank_road(steps) -> None:
    standing, blank = RoadMotion(steps[0][0].camera), RoadMotion(steps[0][0].camera)
    for index, (frame, _) in enumerate(steps):
        standing.add(frame.image, 0.0)
        blank.add(np.full_like(frame.image, 90), 2.0 * index)
    assert standing.scale() is None
    assert blank.scale() is None


def test_a_guess_takes_the_scale_from_the_way(drive) -> None:
    source = find_source(drive.folder / "drive.mp4")
    guess = guess_camera(source, way=lambda time: drive.speed * time)
    true = drive.camera.focal_length * drive.camera.mount_height
    assert guess.camera.focal_length * guess.camera.mount_height == pytest.approx(true, rel=0.06)
    assert guess.deviations.scale < 0.06
    assert "the road moves" in guess.reasons["focal_length_px"]
    standing = guess_camera(source, way=lambda _: 0.0)
    assert any("the track does not give the scale: no two images are" in warning for warning in standing.warnings)
