"""Halos where there are lamps, the veil where there are none, in pictures that no renderer drew; thresholds."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.estimators import make
from fogsim.estimators.night.gallen2014 import Gallen2014, Gallen2014Halo, fog_class
from fogsim.estimators.night.halos import HaloThreshold, HaloWatch, largest_sharpness
from fogsim.values import Camera, Frame, Lamp, LeadMeasurement, Observation, Response
from tests.vision.sources.night_pictures import in_colour, picture

CAMERA = Camera(320, 240, 300.0, (159.5, 119.5), 1.4, pitch=0.03, response=Response.SRGB)
MEASURED = HaloThreshold(320, 240, 300.0, "srgb", 0.0, 25.0, 30.0, 0.01, 0.01, 100)
LAMPS = ((80.0, 60.0, 4.0, 300.0), (220.0, 70.0, 6.0, 300.0))
LIT = Lamp.POSITION | Lamp.LOW_BEAM


def seen(lamps=(), glow=0.0):
    """A road that own lamps light, under a dark sky."""
    level = picture(lamps, glow=glow)
    level[140:] = np.maximum(level[140:], 60)
    return Observation(in_colour(level), lamps=LIT)


def test_halos_tell_fog_but_not_how_much() -> None:
    method = Gallen2014(CAMERA).calibrated(MEASURED)
    foggy = method.update(seen(LAMPS, glow=30.0))
    assert (foggy.method, foggy.valid, foggy.diagnostics["by"]) == ("gallen2014", False, "halos")
    assert foggy.diagnostics["detected"]
    assert foggy.diagnostics["lamps"] == 2
    assert foggy.visibility_interval[1] < 2000.0
    method.reset()
    clear = method.update(seen(LAMPS))
    assert clear.diagnostics["detected"] is False
    assert clear.visibility_interval[0] > 100.0
    assert clear.visibility_interval[1] == float("inf")


def test_halos_before_a_long_gap_are_forgotten() -> None:
    method = Gallen2014(CAMERA).calibrated(MEASURED)
    for time, glow in ((0.0, 30.0), (60.0, 0.0)):
        observed = seen(LAMPS, glow=glow)
        found = method.update(dataclasses.replace(observed, frame=Frame(time, observed.image, CAMERA)))
    assert found.diagnostics["smoothed"] == found.diagnostics["value"]


def test_lamps_of_a_vehicle_close_ahead_say_nothing() -> None:
    near, far = (
        Gallen2014Halo(CAMERA)
        .calibrated(MEASURED)
        .update(dataclasses.replace(seen(LAMPS), lead=LeadMeasurement(distance, 0.0)))
        for distance in (4.0, 40.0)
    )
    assert (near.bounds, near.valid) == (None, False)
    assert far.bounds is not None


def test_without_lamps_the_veil_is_asked() -> None:
    told = Gallen2014(CAMERA).calibrated(MEASURED).update(seen())
    assert told.method == "gallen2014"
    assert told.diagnostics["by"] == "veil"
    assert "no calibration" in told.diagnostics["reason"]


def test_halos_alone_ask_no_veil() -> None:
    method = Gallen2014Halo(CAMERA).calibrated(MEASURED)
    assert method.update(seen(LAMPS, glow=30.0)).diagnostics["detected"]
    told = Gallen2014Halo(CAMERA).calibrated(MEASURED).update(seen())
    assert (told.method, told.valid) == ("gallen2014_halo", False)
    assert "no lamp is seen" in str(told.diagnostics["reason"])


def test_published_threshold_and_daylight() -> None:
    halo = seen(LAMPS, glow=10.0)
    ours, calibrated = (
        make("gallen2014", CAMERA, window=1, as_published=flag).calibrated(MEASURED).update(halo).diagnostics
        for flag in (False, True)
    )
    told = Gallen2014(CAMERA, window=1).update(halo)
    uncalibrated = told.diagnostics
    assert "fogsim calibrate halos" in uncalibrated["reason"]
    assert told.bounds is None
    assert 9.0 < calibrated["value"] == uncalibrated["value"] < 25.0
    assert (ours["detected"], calibrated["detected"], uncalibrated["detected"]) == (True, True, False)
    day = np.full((240, 320, 3), 200, np.uint8)
    day[125:] = 90
    assert "for the night" in Gallen2014(CAMERA).update(Observation(day, lamps=LIT)).diagnostics["reason"]


def test_files_and_thresholds_of_others_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"halos must be a file of `fogsim calibrate halos`, got .*none.json"):
        Gallen2014(CAMERA, halos=str(tmp_path / "none.json"))
    file = tmp_path / "halos.json"
    file.write_text(dataclasses.replace(MEASURED, width=640).as_json(), encoding="utf-8")
    with pytest.raises(InputError, match=r"640x240 px.*320x240 px.*fogsim calibrate halos"):
        Gallen2014(CAMERA, halos=str(file))
    with pytest.raises(InputError, match=r"response srgb.*response gamma"):
        MEASURED.checked_for(dataclasses.replace(CAMERA, response=Response.GAMMA))
    file.write_text(MEASURED.as_json(), encoding="utf-8")
    assert HaloThreshold.read(file) == MEASURED
    assert Gallen2014(CAMERA, halos=str(file)).update(seen(LAMPS, glow=30.0)).diagnostics["detected"]


def test_classes_of_fog() -> None:
    assert [fog_class(one) for one in (50.0, 100.0, 300.0, 301.0)] == [3, 2, 2, 1]


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


def test_what_is_no_threshold_is_refused(tmp_path: Path) -> None:
    file, wrong = tmp_path / "halos.json", dict.fromkeys(("", "[]", '{"width": 3}'), "halos must be a file of")
    for key, value in (("steepness", -1), ("width", "wide"), ("response", "log"), ("mean_errors", None)):
        text = json.dumps({**dataclasses.asdict(MEASURED), key: value})
        wrong[text] = rf"halos.json.*({key} must be a number|expected finite numbers)"
    for text, message in wrong.items():
        file.write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match=message):
            HaloThreshold.read(file)
