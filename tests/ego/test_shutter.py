"""What moves while the shutter is open is smeared over as many pixels as it passes, and loses no light."""

from typing import Any

import numpy as np
import pytest

import fogsim
from fogsim.camera import AutoExposure, CameraSensor, Metering, Sensor, Shutter
from fogsim.simulation.ego.motion_blur import exposed, moved
from fogsim.values import Camera, CameraPose, TrafficState, View
from tests.helpers.vehicles import vehicles

POSE = CameraPose((100.0, 50.0, 1.4), 0.0)


def traffic(*speeds: float, heading: float = 0.0, grade: float = 0.0) -> TrafficState:
    count = len(speeds)
    return vehicles(np.zeros(count), heading=heading, speed=speeds, lane="a", grade=np.full(count, grade))


def draw(state: TrafficState, pose: CameraPose) -> tuple[View, np.ndarray]:
    """A picture with a bright point, a column further for each tenth of a metre that the camera has come forward."""
    radiance = np.zeros((3, 41, 3), np.float32)
    radiance[1, 20 + round((pose.position[0] - 100.0) / 0.1)] = 9.0
    return View(radiance, np.full((3, 41), pose.position[0], np.float32), np.zeros((3, 41), np.int32)), radiance


def test_a_point_is_smeared_over_the_way_and_keeps_its_light() -> None:
    # 25 m/s for 36 ms are 0.9 m: nine columns, with nine instants one each.
    view, radiance = exposed(draw, Shutter(0.036, 9), traffic(25.0), 0, POSE)
    assert np.flatnonzero(radiance[1, :, 0]).tolist() == list(range(16, 25))
    assert radiance.sum() == pytest.approx(3 * 9.0, rel=1e-6)
    assert radiance[1, 16, 0] == pytest.approx(1.0)
    # What is told of the scene is of the middle.
    assert view.distance[0, 0] == 100.0


def test_nothing_moves_or_a_closed_shutter_freezes_it() -> None:
    by_day = Shutter(0.036, 9, follows_exposure=True).at(0.005)
    for shutter, speed in ((Shutter(), 25.0), (Shutter(0.036, 9), 0.0), (by_day, 25.0)):
        calls: list[CameraPose] = []

        def once(state: TrafficState, pose: CameraPose, calls: list[CameraPose] = calls) -> tuple[View, np.ndarray]:
            calls.append(pose)
            return draw(state, pose)

        exposed(once, shutter, traffic(speed), 0, POSE)
        assert calls == [POSE]


def test_without_a_picture_there_is_none() -> None:
    view = draw(traffic(1.0), POSE)[0]
    assert exposed(lambda *_: (view, None), Shutter(0.02, 3), traffic(20.0), 0, POSE) == (view, None)


def test_vehicles_go_straight_on_uphill_too() -> None:
    later = moved(traffic(10.0, 0.0, heading=np.pi / 2, grade=0.1), 0.1)
    np.testing.assert_allclose(later.position[0], [0.0, np.cos(0.1), np.sin(0.1)], atol=1e-12)
    np.testing.assert_array_equal(later.position[1], 0.0)


def test_a_drive_is_smeared_and_the_frame_keeps_its_brightness() -> None:
    def last(*settings: str) -> Any:
        sizes = ["camera.width=160", "camera.height=120", "camera.read_noise_e=0", "camera.full_well_e=1e9"]
        scenario = fogsim.load_scenario("clear_day", [*sizes, "duration_s=0.4", "expect={}", "vary={}", *settings])
        return list(fogsim.run(scenario, seed=1))[-1].observation.image.astype(float)

    sharp, smeared = last(), last("camera.motion_blur={open_time: 40 ms, instants: 5}")
    assert smeared.mean() == pytest.approx(sharp.mean(), rel=0.01)

    # Marks and texture beside the own lane run together along the road.
    def steepness(image: np.ndarray) -> float:
        return float(np.abs(np.diff(image[80:], axis=0)).mean())

    assert steepness(smeared) < 0.9 * steepness(sharp)


def test_the_shutter_follows_the_exposure_if_asked() -> None:
    assert Shutter(0.02, 5, follows_exposure=True).at(0.25) == Shutter(0.005, 5, follows_exposure=True)
    assert Shutter(0.02, 5).at(0.25) == Shutter(0.02, 5)


@pytest.mark.parametrize(("light", "share"), [(20.0, 1.0), (100.0, 100.0 * 0.65 / 100.0), (1000.0, 0.065)])
def test_the_camera_knows_how_long_it_exposes(light: float, share: float) -> None:
    """Light of a luminance that is held at 65 % of saturation; 100 cd/m² saturate the longest exposure."""
    camera = Camera(16, 12, 15.0, (8.0, 6.0), 1.4)
    auto = AutoExposure(Metering.HIGHLIGHTS, 0.65, time_constant=0.0, brightest=1e5, ungained=100.0, darkest=4.0)
    taking = CameraSensor(camera, Sensor(5000.0), auto, 0.0, 0.1)
    assert taking.share_of_longest_exposure == 0.0
    taking.take(np.full((12, 16, 3), light, np.float32), np.random.default_rng(0))
    assert taking.share_of_longest_exposure == pytest.approx(share, rel=1e-5)
    taking.reset()
    assert taking.share_of_longest_exposure == 0.0
    assert CameraSensor(camera, Sensor(5000.0), None, 0.0, 0.1).share_of_longest_exposure == 1.0
