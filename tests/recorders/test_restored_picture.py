"""The video's picture with contrast restored in its right half."""

import dataclasses

import numpy as np
import pytest
from early_motorway import EARLY

import fogsim
from fogsim.recorders.panel.camera_picture import draw_camera_picture, draw_restored_picture
from fogsim.values import LightMeasurement, Step

SMALL = (EARLY, "camera.width=320", "camera.height=240", "traffic.events=[]", "duration_s=1")


def last_step(visibility: float) -> Step:
    scenario = fogsim.load_scenario("motorway_fog_bank", [*SMALL, f"fog={{visibility_m: {visibility}}}"])
    *_, last = fogsim.run(scenario, 1)
    return last


@pytest.fixture(scope="module")
def foggy() -> Step:
    return last_step(80.0)


def spread_below_horizon(picture: np.ndarray) -> float:
    """Standard deviation of the far road and what stands beside it."""
    return float(picture[215:300].std())


def test_the_right_half_gets_contrast_and_the_left_one_stays(foggy: Step) -> None:
    plain, restored = (np.asarray(draw(foggy), float) for draw in (draw_camera_picture, draw_restored_picture))
    np.testing.assert_array_equal(restored[:, :320], plain[:, :320])
    assert spread_below_horizon(restored[:, 330:610]) > 1.25 * spread_below_horizon(plain[:, 330:610])


def test_without_fog_by_night_and_without_a_calibration_it_is_the_picture_alone(foggy: Step) -> None:
    clear = last_step(5000.0)
    observation = foggy.observation
    night = dataclasses.replace(foggy, observation=dataclasses.replace(observation, light=LightMeasurement(0.5)))
    bare = dataclasses.replace(foggy, observation=dataclasses.replace(observation, frame=observation.image))
    for step in (clear, night, bare):
        np.testing.assert_array_equal(np.asarray(draw_restored_picture(step)), np.asarray(draw_camera_picture(step)))
