"""Fog by the halos about lamps: the mean of a picture, of a second, and the threshold's file."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.estimators.night.halos import HaloThreshold, HaloWatch, largest_sharpness
from fogsim.values import Camera, Response
from tests.vision.sources.night_pictures import picture

CAMERA = Camera(320, 240, 300.0, (159.5, 119.5), 1.4, response=Response.SRGB)
MEASURED = HaloThreshold(320, 240, 300.0, "srgb", 0.0, 30.0, 25.0, 0.01, 0.01, 100)
LAMPS = ((80.0, 100.0, 4.0, 300.0), (220.0, 120.0, 6.0, 300.0))


def test_a_second_of_pictures_outvotes_one() -> None:
    foggy, clear = picture(LAMPS, glow=40.0), picture(LAMPS)
    watch = HaloWatch(threshold=20.0)
    for _ in range(24):
        assert watch.look(foggy).is_fog
    one = watch.look(clear)
    assert one.value > 20.0 > one.smoothed
    assert one.is_fog
    watch.reset()
    assert watch.look(clear).is_fog is False
    assert HaloWatch(threshold=20.0, window=1).look(clear).is_fog is False


def test_one_sharp_lamp_shows_that_there_is_no_fog() -> None:
    wide, sharp = picture(LAMPS[:1], glow=40.0), picture(LAMPS[1:])
    both = np.maximum(wide, sharp)
    by_mean, by_largest = HaloWatch().look(both), HaloWatch(25.0, largest_sharpness).look(both)
    assert len(by_largest.halos) == 2
    assert by_largest.value > by_mean.value
    assert by_largest.is_fog is False
    assert HaloWatch(25.0, largest_sharpness).look(wide).is_fog


def test_without_a_lamp_there_is_nothing_to_tell() -> None:
    reading = HaloWatch().look(picture(()))
    assert (reading.value, reading.smoothed, reading.is_fog, reading.halos) == (None, None, None, ())


def test_a_threshold_is_written_and_read(tmp_path: Path) -> None:
    file = tmp_path / "halos.json"
    file.write_text(MEASURED.as_json(), encoding="utf-8")
    assert HaloThreshold.read(file) == MEASURED
    assert MEASURED.checked_for(CAMERA) is MEASURED


def test_a_threshold_of_another_camera_is_refused_and_both_are_named() -> None:
    with pytest.raises(InputError, match=r"320x240 px.*640x240 px.*fogsim calibrate halos"):
        MEASURED.checked_for(dataclasses.replace(CAMERA, width=640))
    with pytest.raises(InputError, match=r"response srgb.*response gamma"):
        MEASURED.checked_for(dataclasses.replace(CAMERA, response=Response.GAMMA))


@pytest.mark.parametrize("text", ["", "[]", '{"width": 3}'])
def test_what_is_no_threshold_is_refused(tmp_path: Path, text: str) -> None:
    file = tmp_path / "halos.json"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="halos must be a file of"):
        HaloThreshold.read(file)


@pytest.mark.parametrize(
    ("key", "value"), [("steepness", -1), ("width", "wide"), ("response", "log"), ("mean_errors", None)]
)
def test_numbers_that_do_not_fit_are_refused(tmp_path: Path, key: str, value: object) -> None:
    file = tmp_path / "halos.json"
    file.write_text(json.dumps({**dataclasses.asdict(MEASURED), key: value}), encoding="utf-8")
    with pytest.raises(InputError, match=rf"halos.json.*({key} must be a number|expected finite numbers)"):
        HaloThreshold.read(file)
