"""From what is told and seen to what is found: the map says where to look, the picture alone what is there."""

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest

from fogsim.estimators.signs.regions import Registration, project_sightings, register_signs
from fogsim.values import Camera, SignSighting
from fogsim.vision.symmetry.detection import detect_signs

CAMERA = Camera(700, 300, 550.0, (350.0, 140.0), 1.3)
SIGN = SignSighting("s", "speed_limit", 22.2, 28.0, -5.0, 0.9, 2.3)
SETBACK = 2.0


def picture(*standing: SignSighting) -> np.ndarray:
    """Red rings before a wood in fog, with noise, in 8 bits."""
    rng = np.random.default_rng(2)
    wood = 150.0 + 12.0 * cv2.GaussianBlur(rng.normal(0.0, 3.0, (300, 700)), (0, 0), 3.0)
    image = np.repeat(wood[:, :, None], 3, axis=2)
    for sign in standing:
        (seen,) = project_sightings([sign], CAMERA, SETBACK)
        rows, cols = np.mgrid[:300, :700]
        away = np.hypot(rows - seen.v, cols - seen.u)
        for size, colour in ((1.0, (150, 60, 60)), (0.75, (175, 175, 170))):
            share = np.clip(size * seen.radius - away + 0.5, 0.0, 1.0)[:, :, None]
            image = share * np.array(colour) + (1.0 - share) * image
    image = cv2.GaussianBlur(image, (0, 0), 0.7) + rng.normal(0.0, 1.5, image.shape)
    return np.round(image).clip(0, 255).astype(np.uint8)


def found(image: np.ndarray, *told: SignSighting) -> tuple[Registration, ...]:
    signs = project_sightings(told, CAMERA, SETBACK)
    return register_signs(signs, detect_signs(image, [sign.region for sign in signs]))


def test_a_sign_is_found_where_it_stands_though_the_map_errs() -> None:
    image = picture(SIGN)
    for told in (SIGN, replace(SIGN, lateral=-5.6), replace(SIGN, distance=29.0, height=2.45)):
        (one,) = found(image, told)
        (true,) = project_sightings([SIGN], CAMERA, SETBACK)
        assert math.dist((one.detection.u, one.detection.v), (true.u, true.v)) < 0.3
        assert one.detection.radius == pytest.approx(true.radius, rel=0.1)
        assert one.confidence > 0.5


def test_what_the_map_does_not_tell_is_not_found_and_what_does_not_stand_neither() -> None:
    other = replace(SIGN, sign_id="other", distance=40.0, lateral=6.0)
    assert [one.sign.sighting.sign_id for one in found(picture(SIGN), SIGN, other)] == ["s"]
    assert [one.sign.sighting.sign_id for one in found(picture(SIGN, other), other)] == ["other"]
    assert found(picture(), SIGN, other) == ()
    assert found(picture(SIGN)) == ()


def test_a_sign_that_was_moved_is_not_taken_for_the_one_of_the_map() -> None:
    assert found(picture(SIGN), replace(SIGN, height=6.0)) == ()
    assert found(picture(SIGN), replace(SIGN, lateral=-9.0)) == ()


def test_two_signs_on_a_post_are_told_apart() -> None:
    upper = replace(SIGN, sign_id="upper", height=3.3)
    pairs = {one.sign.sighting.sign_id: one for one in found(picture(SIGN, upper), SIGN, upper)}
    assert set(pairs) == {"s", "upper"}
    assert pairs["upper"].detection.v < pairs["s"].detection.v - pairs["s"].detection.radius
