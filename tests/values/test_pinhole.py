import math

import numpy as np
import pytest

from fogsim.camera import mounted_pose
from fogsim.values import Camera, CameraPose
from fogsim.values.pinhole import camera_axes, ray_from_pixel

CAMERA = Camera(640, 480, 576.9, (320, 240), 1.38, pitch=0.035)


def test_a_road_point_lies_on_the_row_of_its_distance() -> None:
    """v = v_h + λ / d with d along the optical axis (negru2013 eq. 11)."""
    for distance in [10.0, 50.0, 300.0]:
        for heading in [0.0, 1.0, -2.5]:
            pose = CameraPose((5.0, -3.0, 1.38), heading)
            row = CAMERA.horizon_row + CAMERA.row_distance / distance
            ray = ray_from_pixel(CAMERA, pose) @ (320.0, row, 1.0)
            along = 1.38 / -ray[2]
            hit = np.array(pose.position) + along * ray
            # eq. 10 holds for depth along the optical axis: the ray's forward component is 1, so `along` is that depth.
            assert hit[2] == pytest.approx(0.0, abs=1e-9)
            assert along == pytest.approx(distance, rel=0.005)


def test_the_horizon_is_horizontal() -> None:
    ray = ray_from_pixel(CAMERA, CameraPose((0, 0, 1.38), 0.4)) @ (320.0, CAMERA.horizon_row, 1.0)
    assert ray[2] == pytest.approx(0.0, abs=1e-12)


def test_rotation_is_orthonormal_and_right_handed() -> None:
    camera = Camera(640, 480, 576.9, (320, 240), 1.38, pitch=0.1, roll=0.2)
    matrix = camera_axes(camera, CameraPose((0, 0, 1), 2.0, grade=0.03))
    assert np.allclose(matrix.T @ matrix, np.eye(3))
    assert np.linalg.det(matrix) == pytest.approx(1.0)


def test_image_axes_point_right_and_down() -> None:
    matrix = camera_axes(Camera(640, 480, 576.9, (320, 240), 1.38), CameraPose((0, 0, 1), 0.0))
    assert np.allclose(matrix, ((0, -1, 0), (0, 0, -1), (1, 0, 0)))


def test_a_positive_roll_turns_the_images_right_side_down() -> None:
    """A level point to the right of the axis then appears below the image's middle row."""
    camera = Camera(640, 480, 500.0, (320, 240), 1.38, roll=0.1)
    level_right = np.array([100.0, -20.0, 1.38])
    in_camera = camera_axes(camera, CameraPose((0, 0, 1.38), 0.0)) @ (level_right - (0, 0, 1.38))
    assert in_camera[1] > 0


def test_mounted_behind_the_bumper() -> None:
    pose = mounted_pose(CAMERA, np.array([10.0, 5.0, 2.0]), math.pi / 2, setback=1.7)
    assert pose.position == pytest.approx((10.0, 3.3, 3.38))
