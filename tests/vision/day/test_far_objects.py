"""Things at the horizon, drawn by hand: a wood far away, and a hedge close by, before a sky of unit light."""

import math
from dataclasses import replace

import numpy as np
import pytest

from fogsim.units import extinction_from_visibility
from fogsim.values import Camera
from fogsim.vision.day.far_objects import share_of_far_objects
from fogsim.vision.lines.horizon import Horizon

CAMERA = Camera(320, 240, 300.0, (159.5, 100.0), 1.4, bits=12)
HORIZON = Horizon(100.0, 0.5)
MAST = replace(CAMERA, mount_height=6.0)


def picture(visibility: float, foot: float, light: float = 0.03, camera: Camera = CAMERA, open_to=0.0) -> np.ndarray:
    """A wall of a light, 40 m high, open below a height [m] and `foot` metres away, on ground of 0.2, in fog."""
    rows = np.arange(camera.height)[:, None] * np.ones(camera.width)
    below = rows - HORIZON.row
    distance = np.where(below > 0, camera.row_distance / np.maximum(below, 1e-6), math.inf)
    scene = np.where(below > 0, 0.2, 1.0)
    height = camera.mount_height - below * foot / camera.focal_length
    wall = (distance > foot) & (height < 40.0) & (height >= open_to)
    scene, distance = np.where(wall, light, scene), np.where(wall, foot, distance)
    clear = np.exp(-extinction_from_visibility(visibility) * distance) if visibility < math.inf else 1.0
    return np.rint(3000.0 * (scene * clear + 1.0 - clear)).astype(np.uint16)


@pytest.mark.parametrize(
    ("foot", "visibility"), [(4.0, 50.0), (200.0, 50.0), (10.0, 100.0), (30.0, 300.0), (200.0, 300.0)]
)
def test_fog_hides_what_stands_in_it_as_far_as_it_does(visibility, foot):
    claimed = 0.8 * extinction_from_visibility(visibility)
    assert share_of_far_objects(picture(visibility, foot), CAMERA, HORIZON, claimed) == 0.0


@pytest.mark.parametrize("claimed", [40.0, 100.0, 300.0])
def test_a_wood_in_clear_air_contradicts_fog(claimed):
    image = picture(math.inf, 400.0)
    assert share_of_far_objects(image, CAMERA, HORIZON, extinction_from_visibility(claimed)) == 1.0


def test_neither_crowns_that_overhang_the_ground_before_a_mast_nor_a_hedge_close_by_are_far_objects():
    extinction = extinction_from_visibility(400.0)
    image = picture(400.0, 120.0, camera=MAST, open_to=5.0)
    assert share_of_far_objects(image, MAST, HORIZON, extinction) == 0.0
    assert share_of_far_objects(picture(math.inf, 4.0), CAMERA, HORIZON, extinction_from_visibility(100.0)) == 0.0
