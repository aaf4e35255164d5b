"""A calibration that no camera can have is refused by name, value and what is allowed."""

import copy
import math
from dataclasses import asdict, replace

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.values import Camera, Response

CAMERA = Camera(640, 480, 577.0, (319.5, 239.5), mount_height=1.38)


def test_what_is_no_finite_number_is_refused() -> None:
    for field in ["width", "height", "focal_length", "mount_height", "pitch", "roll", "bits"]:
        for value in [math.nan, math.inf, -math.inf, None, "wide", True, [1.0]]:
            with pytest.raises(InputError, match=rf"camera {field} must .*, got ") as told:
                replace(CAMERA, **{field: value})
            assert str(told.value).endswith(f"got {value!r}")


def test_numbers_out_of_range_are_refused() -> None:
    for field, value, allowed in [
        ("width", 640.5, "whole number of pixels ≥ 1"),
        ("height", 0, "whole number of pixels ≥ 1"),
        ("focal_length", 0.0, "positive"),
        ("mount_height", -1.0, "positive"),
        ("pitch", math.pi / 2, "±π/2"),
        ("roll", 3.2, "±π"),
        ("bits", 9, "8, 10 or 12"),
        ("bits", 8.5, "8, 10 or 12"),
    ]:
        with pytest.raises(InputError, match=f"camera {field} must .*{allowed}.*, got {value}"):
            replace(CAMERA, **{field: value})


def test_a_principal_point_is_two_finite_numbers() -> None:
    for point in [(math.nan, 1.0), (1.0, math.inf), (1.0,), (1.0, 2.0, 3.0), None, 5.0, ("1", 2.0)]:
        with pytest.raises(InputError, match="camera principal_point must be two finite numbers, got"):
            replace(CAMERA, principal_point=point)


def test_an_unknown_response_answers_with_the_known_ones() -> None:
    for response in ["log", None, math.nan]:
        with pytest.raises(InputError, match=r"camera response: .*linear, gamma, srgb, got"):
            replace(CAMERA, response=response)


def test_numbers_of_any_type_make_the_same_camera() -> None:
    other = Camera(
        np.int64(640),
        480.0,
        np.float32(577.0),
        np.array([319.5, 239.5]),
        mount_height=1.38,
        bits=np.uint8(8),
        response="linear",
    )
    assert other == CAMERA
    assert hash(other) == hash(CAMERA)
    assert [type(size) for size in (other.width, other.height, other.bits)] == [int, int, int]
    assert [type(one) for one in (other.focal_length, other.mount_height, other.pitch, other.roll)] == 4 * [float]
    assert other.response is Response.LINEAR


def test_what_a_camera_has_computed_changes_neither_its_copies_nor_what_equals_it() -> None:
    used = Camera(**asdict(CAMERA))
    assert hash(used) + used.horizon_row + used.row_distance > 0.0
    assert used == CAMERA == copy.deepcopy(used)
    assert asdict(used) == asdict(CAMERA)
    pitched = replace(used, pitch=0.03)
    assert (pitched.horizon_row, hash(pitched)) != (used.horizon_row, hash(used))
