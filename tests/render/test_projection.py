import pytest

from fogsim.render.projection import clip_from_camera
from fogsim.values import Camera, CameraPose
from fogsim.values.pinhole import camera_axes, ray_from_pixel

CAMERA = Camera(640, 480, 577.0, (310.0, 250.0), 1.38, pitch=0.05, roll=0.04)
POSE = CameraPose((3.0, 4.0, 1.38), heading=0.7, grade=0.01)


def test_pixel_centres_lie_half_a_window_unit_in_and_rays_project_back_to_their_pixels() -> None:
    x, y, _, w = clip_from_camera(CAMERA) @ (0.0, 0.0, 5.0, 1.0)
    assert (x / w + 1) / 2 * CAMERA.width - 0.5 == pytest.approx(310.0)
    assert (y / w + 1) / 2 * CAMERA.height - 0.5 == pytest.approx(250.0)
    for pixel in ((0, 0), (639, 479), (123, 45)):
        ray = ray_from_pixel(CAMERA, POSE) @ (*pixel, 1.0)
        right, down, ahead = camera_axes(CAMERA, POSE) @ ray
        assert ahead == pytest.approx(1.0)
        assert (310 + 577 * right, 250 + 577 * down) == pytest.approx(pixel)
