"""Halos where there are lamps, the veil where there are none, in pictures that no renderer drew."""

import dataclasses

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.estimators import make
from fogsim.estimators.night.gallen2014 import Gallen2014, Gallen2014Halo, fog_class
from fogsim.estimators.night.halos import HaloThreshold
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


def test_files_and_thresholds_of_others_are_refused(tmp_path) -> None:
    with pytest.raises(InputError, match=r"halos must be a file of `fogsim calibrate halos`, got .*none.json"):
        Gallen2014(CAMERA, halos=str(tmp_path / "none.json"))
    file = tmp_path / "halos.json"
    file.write_text(dataclasses.replace(MEASURED, width=640).as_json(), encoding="utf-8")
    with pytest.raises(InputError, match=r"640x240.*320x240"):
        Gallen2014(CAMERA, halos=str(file))
    file.write_text(MEASURED.as_json(), encoding="utf-8")
    assert Gallen2014(CAMERA, halos=str(file)).update(seen(LAMPS, glow=30.0)).diagnostics["detected"]


def test_classes_of_fog() -> None:
    assert [fog_class(one) for one in (50.0, 100.0, 300.0, 301.0)] == [3, 2, 2, 1]
