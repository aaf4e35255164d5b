"""The video's picture with contrast restored in its right half."""

import dataclasses

import numpy as np

import fogsim
from fogsim.recorders.panel.camera_picture import draw_camera_picture, draw_restored_picture
from fogsim.values import LightMeasurement, Step

SMALL = ("camera.width=320", "camera.height=240", "traffic.events=[]", "duration_s=2")


def last_step(visibility: float) -> Step:
    scenario = fogsim.load_scenario("motorway_fog_bank", [*SMALL, f"fog={{visibility_m: {visibility}}}"])
    *_, last = fogsim.run(scenario, 1)
    return last


def spread_below_horizon(picture: np.ndarray) -> float:
    """Standard deviation of the far road and what stands beside it."""
    return float(picture[215:300].std())


def test_the_right_half_gets_contrast_and_the_left_one_stays():
    step = last_step(80.0)
    plain, restored = (np.asarray(draw(step), float) for draw in (draw_camera_picture, draw_restored_picture))
    np.testing.assert_array_equal(restored[:, :320], plain[:, :320])
    assert spread_below_horizon(restored[:, 330:610]) > 1.25 * spread_below_horizon(plain[:, 330:610])


def test_without_fog_by_night_and_without_a_calibration_it_is_the_picture_alone():
    clear, foggy = last_step(5000.0), last_step(80.0)
    observation = foggy.observation
    night = dataclasses.replace(foggy, observation=dataclasses.replace(observation, light=LightMeasurement(0.5)))
    bare = dataclasses.replace(foggy, observation=dataclasses.replace(observation, frame=observation.image))
    for step in (clear, night, bare):
        np.testing.assert_array_equal(np.asarray(draw_restored_picture(step)), np.asarray(draw_camera_picture(step)))
