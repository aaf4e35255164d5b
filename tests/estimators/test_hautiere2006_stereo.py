"""Visibility from two cameras: pairs of pictures made here, and drives."""

import dataclasses
import functools
import math

import numpy as np
import pytest
from early_motorway import EARLY

import fogsim
from fogsim.errors import InputError
from fogsim.estimators import make
from fogsim.values import Camera, Estimate, Frame, Observation, Response, SecondView, Step

CAMERA = Camera(640, 480, 600.0, (319.5, 239.5), 1.4, math.radians(2.0), response=Response.LINEAR)
BASELINE, AIRLIGHT, DARK = 0.5, 200.0, 10.0
DISPARITIES = (3, 4, 5, 6, 8, 10, 12, 15, 20)
QUIET = (EARLY, "traffic.events=[]", "clocks.camera_period_s=1", "clocks.decision_period_s=1", "duration_s=4")
SMALL = ("camera.width=320", "camera.height=240", "estimators=[negru2013]")
RIG = "camera.stereo={baseline_m: 0.4, baseline_error_percent: 10}"


@functools.cache
def pair(
    visibility: float, disparities: tuple[int, ...] = DISPARITIES, shift: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """Dark boards of random outline in fog before the sky, one for each disparity, seen by two cameras."""
    rng, k = np.random.default_rng(1), math.log(20.0) / visibility
    left, right = (np.full((480, 640), AIRLIGHT) for _ in range(2))
    for i, disparity in enumerate(disparities):
        d = CAMERA.focal_length * BASELINE / disparity
        light = AIRLIGHT + (DARK - AIRLIGHT) * math.exp(-k * d)
        for row in range(60, 250, 5):
            start = 60 + 60 * i + int(rng.integers(0, 12))
            end = start + 25 + int(rng.integers(0, 12))
            left[row : row + 5, start:end] = light
            right[row : row + 5, start - disparity - shift : end - disparity - shift] = light
    road = np.arange(480)[:, None] > CAMERA.horizon_row + 60
    noisy = [np.where(road, 90.0, picture) + rng.normal(0.0, 0.7, picture.shape) for picture in (left, right)]
    return tuple(np.clip(np.rint(picture), 0, 255).astype(np.uint8) for picture in noisy)


def seen(left: np.ndarray, right: np.ndarray | None, baseline: float = BASELINE, **options: object) -> Estimate:
    view = None if right is None else SecondView(right, baseline)
    return make("hautiere2006_stereo", CAMERA, **options).update(Observation(Frame(0.0, left, CAMERA), right=view))


@pytest.mark.parametrize("visibility", [60.0, 100.0, 150.0])
def test_boards_in_fog_tell_its_extinction(visibility):
    found = seen(*pair(visibility))
    assert found.valid
    assert found.visibility == pytest.approx(visibility, rel=0.12)
    low, high = found.visibility_interval
    assert low < visibility < high
    assert found.reach <= CAMERA.focal_length * BASELINE / min(DISPARITIES) + 1.0


def test_as_published_the_farthest_thing_of_five_percent_is_the_visibility():
    found = seen(*pair(100.0), as_published=True)
    assert found.visibility == pytest.approx(found.diagnostics["visible_distance"], rel=0.01)
    # Of 95 % without fog, 5 % is left at the visibility: boards stand at 75 and 100 m.
    assert 60.0 < found.visibility < 105.0


def test_a_wrong_baseline_scales_the_visibility():
    images = pair(100.0)
    assert seen(*images, baseline=1.2 * BASELINE).visibility == pytest.approx(1.2 * seen(*images).visibility, rel=0.02)


def test_cameras_that_squint_read_wrong():
    assert seen(*pair(100.0, shift=1)).visibility < 0.95 * seen(*pair(100.0)).visibility


def test_where_nothing_is_far_enough_only_the_most_fog_is_told():
    found = seen(*pair(800.0, disparities=(12, 15, 20)))
    assert not found.valid
    assert "too little contrast" in str(found.diagnostics["reason"])
    assert math.log(20.0) / 800.0 < found.bounds.most < math.log(20.0) / 60.0


def test_pictures_without_edges_tell_nothing():
    grey = np.full((480, 640), 150, np.uint8)
    assert "contrast" in seen(grey, grey).diagnostics["reason"]


def test_without_a_second_camera_it_says_what_is_missing():
    assert "camera.stereo" in seen(pair(100.0)[0], None).diagnostics["reason"]


def test_bad_pairs_are_refused():
    left, right = pair(100.0)
    with pytest.raises(InputError, match="640×480"):
        seen(left, right[:, 1:])
    with pytest.raises(InputError, match="image must be an array of uint8"):
        seen(left, right.astype(float))
    for baseline in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(InputError, match="baseline"):
            seen(left, right, baseline)


def test_twelve_bits_are_read_as_eight():
    deep = dataclasses.replace(CAMERA, bits=12)
    left, right = (np.rint(picture * (4095 / 255)).astype(np.uint16) for picture in pair(100.0))
    found = make("hautiere2006_stereo", deep).update(Observation(Frame(0.0, left, deep), right=SecondView(right, 0.5)))
    assert found.visibility == pytest.approx(seen(*pair(100.0)).visibility, rel=0.03)


def drive(*settings: str) -> list[Step]:
    return list(fogsim.run(fogsim.load_scenario("motorway_fog_bank", [*QUIET, *settings]), 3))


def test_a_drive_in_fog_is_read_by_a_rig():
    steps = drive("fog={visibility_m: 120}", "camera.stereo={}", "estimators=[hautiere2006_stereo]")
    told = [step.estimates[0] for step in steps]
    assert all(one.valid for one in told)
    assert np.median([one.visibility for one in told]) == pytest.approx(120.0, rel=0.15)


@pytest.fixture(scope="module")
def rig() -> list[Step]:
    return drive(*SMALL, RIG)


def test_a_second_camera_changes_nothing_of_the_first_and_has_the_error_of_its_calibration(rig):
    for one, other in zip(drive(*SMALL), rig, strict=True):
        assert one.observation.right is None
        np.testing.assert_array_equal(one.observation.image, other.observation.image)
        assert one.traffic.position.tolist() == other.traffic.position.tolist()
        assert other.observation.right.image.shape == other.observation.image.shape
        assert not np.array_equal(other.observation.right.image, other.observation.image)
        assert other.observation.right.baseline == pytest.approx(0.44)


def test_both_pictures_are_late_together(rig):
    late = drive(*SMALL, RIG, "sensors.faults=[{sensor: camera, fault: latency, delay_s: 1}]")
    for before, now in zip(rig[1:], late[2:], strict=False):
        if np.array_equal(before.observation.image, now.observation.image):
            np.testing.assert_array_equal(before.observation.right.image, now.observation.right.image)
            break
    else:
        raise AssertionError("no late picture was one of those that came in time")


def test_where_nothing_is_drawn_the_rig_is_black():
    steps = drive("renderer=none", "camera.stereo={}", "estimators=[]")
    assert not steps[-1].observation.right.image.any()
