"""The picture of the sign map in an observation."""

import dataclasses
import math

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.scene.signs import SIGN_KINDS
from fogsim.values import Camera, Frame, Observation, SignSighting
from fogsim.values.observation import sign_kind_code

CAMERA = Camera(320, 240, 400.0, (159.5, 119.5), 1.4, pitch=0.02)
SIGN = SignSighting("a", "speed_limit", 20.0, 38.0, -4.0, 0.9, 2.4)


def seen(*signs: SignSighting, camera: Camera = CAMERA) -> Observation:
    image = np.zeros((camera.height, camera.width, 3), np.uint8)
    return Observation(Frame(0.0, image, camera), signs=signs, camera_setback=2.0)


def test_a_sign_is_where_the_told_camera_has_it() -> None:
    picture = seen(SIGN).sign_map
    rows, columns = np.nonzero(picture[:, :, 0])
    depth = 40.0 * math.cos(0.02) - 1.0 * math.sin(0.02)
    assert columns.mean() == pytest.approx(159.5 + 400.0 * 4.0 / depth, abs=0.6)
    assert rows.mean() == pytest.approx(119.5 - 400.0 * (40.0 * math.sin(0.02) + 1.0 * math.cos(0.02)) / depth, abs=0.6)
    assert len(rows) == pytest.approx(math.pi * (0.45 * 400.0 / depth) ** 2, rel=0.15)
    assert picture[rows[0], columns[0]].tolist() == [sign_kind_code("speed_limit"), 255 - 38, round(255 * 0.45)]


def test_roll_turns_it_and_a_turned_sign_is_narrow() -> None:
    upside_down = seen(SIGN, camera=dataclasses.replace(CAMERA, roll=math.pi)).sign_map
    np.testing.assert_array_equal(upside_down, seen(SIGN).sign_map[::-1, ::-1])
    turned = seen(dataclasses.replace(SIGN, facing=math.radians(75.0))).sign_map
    assert np.ptp(np.nonzero(turned[:, :, 0])[1]) < 0.4 * np.ptp(np.nonzero(turned[:, :, 0])[0])


def test_nearer_signs_hide_farther_ones_and_far_ones_are_a_pixel() -> None:
    in_line = {"distance": 250.0, "lateral": -4.0 * 252.0 / 40.0, "height": 7.7}
    behind = dataclasses.replace(SIGN, sign_id="b", kind="stop", **in_line)
    picture = seen(behind, SIGN).sign_map
    assert set(np.unique(picture[:, :, 1])) == {0, 255 - 38}
    alone = seen(behind).sign_map
    assert 1 <= np.count_nonzero(alone[:, :, 0]) <= 12


@pytest.mark.parametrize("sign", [dataclasses.replace(SIGN, distance=-5.0), dataclasses.replace(SIGN, lateral=-900.0)])
def test_what_is_behind_or_beside_is_not_painted(sign: SignSighting) -> None:
    assert not seen(sign).sign_map.any()
    assert not seen().sign_map.any()
    assert not seen().sign_map_from_above.any()


def test_from_above() -> None:
    picture = seen(SIGN, dataclasses.replace(SIGN, distance=300.0)).sign_map_from_above
    assert np.argwhere(picture).tolist() == [[63 - 9, 35]]
    assert picture.max() == sign_kind_code("speed_limit")


def test_a_bare_array_has_no_camera() -> None:
    with pytest.raises(InputError, match=r"expected a fogsim\.Frame"):
        _ = Observation(np.zeros((4, 4, 3), np.uint8), signs=(SIGN,)).sign_map


def test_kinds_that_are_drawn_have_codes_of_their_own() -> None:
    codes = [sign_kind_code(kind) for kind in SIGN_KINDS]
    assert len(set(codes)) == len(codes)
    assert min(codes) >= 1
    assert max(codes) <= 255
