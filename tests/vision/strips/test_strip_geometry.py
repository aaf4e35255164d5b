from dataclasses import replace

import numpy as np
import pytest

from fogsim.values import Camera
from fogsim.vision.strips.strip_geometry import SIDES, WHOLE_ROWS, strip_geometry

CAMERA = Camera(640, 480, 577.0, (300.0, 250.0), 1.4, np.radians(3.0))


def projected(camera, ahead, right):
    """Column and row of a point of a flat road, by rotating it into the camera."""
    down = camera.mount_height
    depth = ahead * np.cos(camera.pitch) + down * np.sin(camera.pitch)
    lower = down * np.cos(camera.pitch) - ahead * np.sin(camera.pitch)
    u0, v0 = camera.principal_point
    return u0 + camera.focal_length * right / depth, v0 + camera.focal_length * lower / depth


def test_bins_lie_where_the_road_is_seen():
    geometry = strip_geometry(CAMERA, 2.0)
    for distance in (8.0, 15.0, 40.0):
        # Depth is along the optical axis.
        ahead = (distance - CAMERA.mount_height * np.sin(CAMERA.pitch)) / np.cos(CAMERA.pitch)
        _, row = projected(CAMERA, ahead, 0.0)
        seen = np.interp(row - CAMERA.horizon_row, geometry.below[::-1], geometry.distance[::-1])
        assert seen == pytest.approx(distance, rel=0.01)
        for strip, sides in enumerate(SIDES):
            expected = [np.clip(projected(CAMERA, ahead, side)[0], -0.5, CAMERA.width - 0.5) for side in sides]
            found = [np.interp(distance, geometry.distance, side[strip]) for side in (geometry.left, geometry.right)]
            assert found == pytest.approx(expected, abs=3.0)


def test_bins_follow_one_another_without_gaps_and_grow_with_the_rows_below_the_horizon():
    geometry = strip_geometry(CAMERA, 2.0)
    assert geometry.last[0] == CAMERA.height - 1
    assert (geometry.first[:-1] == geometry.last[1:] + 1).all()
    assert geometry.below[-1] >= 2.0
    assert (geometry.rows[geometry.below < WHOLE_ROWS] == 1.0).all()
    assert (np.diff(geometry.rows) <= 0).all()
    assert (np.diff(geometry.distance) > 0).all()
    near, far = (CAMERA.row_distance / (geometry.below[i] + s * geometry.half[i]) for i, s in ((0, 1.0), (-1, -1.0)))
    assert geometry.extent.sum() == pytest.approx(far - near, rel=1e-6)


def test_paths_are_the_length_of_the_rays():
    geometry = strip_geometry(CAMERA, 2.0)
    v = CAMERA.horizon_row + geometry.below
    columns = geometry.left + (geometry.right - geometry.left) * ((np.arange(200) + 0.5) / 200.0)[:, None, None]
    x = (columns - CAMERA.principal_point[0]) / CAMERA.focal_length
    y = (v - CAMERA.principal_point[1]) / CAMERA.focal_length
    slant = np.sqrt(1.0 + x**2 + y**2)
    assert geometry.path == pytest.approx(CAMERA.row_distance * slant.mean(axis=0), rel=1e-3)
    assert geometry.off_axis == pytest.approx((1.0 - slant**-4).mean(axis=0), abs=0.01)
    # A ray straight down the axis is as long as it is deep.
    assert geometry.path.min() >= CAMERA.row_distance


def test_what_is_mostly_outside_the_image_is_left_out():
    narrow = replace(CAMERA, width=120, principal_point=(60.0, 250.0))
    geometry = strip_geometry(narrow, 2.0)
    assert (geometry.right >= geometry.left).all()
    assert geometry.right.max() <= narrow.width - 0.5
    assert (geometry.right == geometry.left)[1:, 0].all()
    only = geometry.only([0, 2])
    assert np.array_equal(only.left, geometry.left[[0, 2]])
    assert np.array_equal(only.distance, geometry.distance)
