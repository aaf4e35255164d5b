"""The camera's options in the closed loop."""

import math
from itertools import islice

import numpy as np
import pytest
from early_motorway import EARLY

import fogsim
from fogsim.values import Frame, Step

SMALL = (EARLY, "camera.width=160", "camera.height=120", "duration_s=0.6", "fog.visibility_m=100")


def steps(*overrides: str, count: int = 7) -> list[Step]:
    scenario = fogsim.load_scenario("motorway_fog_bank", [*SMALL, *overrides])
    return list(islice(fogsim.run(scenario, seed=2), count))


@pytest.fixture(scope="module")
def plain() -> list[Step]:
    return steps()


def test_the_airlight_stands_at_65_percent_of_the_light_that_saturates(plain: list[Step]) -> None:
    """sRGB of 0.65 is 0.827 (IEC 61966-2-1)."""
    for step in plain:
        sky = np.isinf(step.view.distance)
        assert step.observation.image[sky][:, 1].mean() == pytest.approx(0.827 * 255, abs=2.0)
    # sRGB of 0.6 / 1.02 is 0.791.
    (fixed,) = steps("camera.exposure.mode=fixed", count=1)
    sky = np.isinf(fixed.view.distance)
    assert fixed.observation.image[sky][:, 1].mean() == pytest.approx(0.791 * 255, abs=2.0)


def test_samples_smooth_silhouettes_and_change_no_size(plain: list[Step]) -> None:
    (smooth,) = steps("camera.samples=2", count=1)
    assert smooth.observation.image.shape == (120, 160, 3)
    assert smooth.view.distance.shape == smooth.view.instance.shape == (120, 160)
    # What is far from any silhouette looks as it did, but for noise and the texture of the road.
    ids = plain[0].view.instance
    inside = np.ones(ids.shape, bool)
    for axis in (0, 1):
        for shift in (-2, -1, 1, 2):
            inside &= np.roll(ids, shift, axis) == ids
    difference = smooth.observation.image.astype(float) - plain[0].observation.image
    assert abs(difference[inside].mean()) < 0.5
    assert np.abs(difference[~inside]).mean() > 1.5 * np.abs(difference[inside]).mean()
    assert (smooth.view.instance == ids).mean() > 0.95


def test_deep_images_go_through_the_whole_loop(plain: list[Step]) -> None:
    deep = steps("camera.bits=12")[-1]
    frame = deep.observation.frame
    assert isinstance(frame, Frame)
    assert (frame.image.dtype, frame.camera.bits) == (np.uint16, 12)
    assert frame.image.max() < 2**12
    assert frame.image.mean() / (2**12 - 1) == pytest.approx(plain[-1].observation.image.mean() / 255, abs=0.005)
    assert deep.belief.visibility == pytest.approx(plain[-1].belief.visibility, rel=0.1)


def test_braking_pitches_the_camera_and_nobody_is_told() -> None:
    pitched = steps("camera.body={pitch_deg_per_mps2: 0.5, time_constant_s: 0}", "estimators=[negru2013]")
    for step in pitched:
        pose, frame = step.truth.pose, step.observation.frame
        assert pose is not None
        assert isinstance(frame, Frame)
        assert pose.grade == pytest.approx(math.radians(0.5) * step.traffic.acceleration[step.ego])
        assert frame.camera == step.truth.camera
    assert any(step.truth.pose is not None and step.truth.pose.grade != 0 for step in pitched)


def test_the_same_seed_gives_the_same_run_whatever_the_options() -> None:
    options = ("camera.samples=2", "camera.bits=12", "camera.lens_shading=0.7", "camera.body.pitch_deg_per_mps2=0.2")
    first, again = (b"".join(s.observation.image.tobytes() for s in steps(*options, count=3)) for _ in range(2))
    assert first == again
