"""Calibrations are made once for each camera, by one process at a time, and kept; methods take them by themselves."""

import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fogsim.calibration import cached
from fogsim.calibration.cached import CachedCalibrations
from fogsim.errors import InputError
from fogsim.estimators import make
from fogsim.estimators.night.halos import HaloThreshold
from fogsim.estimators.night.own_light import OwnLight
from fogsim.estimators.signs.operating_range import OperatingRange
from fogsim.scenario.parts.lamp_file import load_lamps
from fogsim.values import Camera, Estimate, Lamp, Observation
from tests.estimators.night.test_gallen2014 import CAMERA as NIGHT_CAMERA
from tests.estimators.night.test_gallen2014 import LAMPS, MEASURED
from tests.estimators.night.test_gallen2014 import seen as night_image
from tests.estimators.signs.test_belaroussi2015 import Told, track

CAMERA = Camera(320, 160, 300.0, (159.5, 79.5), 1.4, pitch=0.01)
RANGE = OperatingRange(300.0, 0.9, (50.0, 100.0, 200.0), (20.1, 40.0, 60.0), (25.0, 45.123456, 65.0), (2.0, 3.0, 4.0))


@pytest.fixture
def measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """Arguments of each calibration that is made; the cache is empty."""
    monkeypatch.setenv("FOGSIM_CACHE_DIR", str(tmp_path / "cache"))
    made: list[object] = []

    def measure(camera: Camera, diameter: float, *, watch: Callable[[int, int], None]) -> OperatingRange:
        made.append((camera, diameter))
        watch(0, 1)
        time.sleep(0.05)
        if camera.focal_length < 100.0:
            raise InputError("too few pixels")
        return RANGE

    def measure_halos(camera: Camera, *, watch: Callable[[int, int], None]) -> HaloThreshold:
        made.append(camera)
        watch(0, 1)
        return MEASURED

    monkeypatch.setattr(cached, "measure_operating_range", measure)
    monkeypatch.setattr(cached, "measure_halo_threshold", measure_halos)
    return made


def test_a_calibration_is_kept_for_its_camera_and_size(measured: list[object]) -> None:
    for _ in range(2):
        assert CachedCalibrations(load_lamps).operating_range(CAMERA, 0.9) == RANGE
        assert CachedCalibrations(load_lamps).halo_threshold(CAMERA) == MEASURED
    assert measured == [(CAMERA, 0.9), CAMERA]
    CachedCalibrations(load_lamps).operating_range(CAMERA, 0.6)
    CachedCalibrations(load_lamps).operating_range(replace(CAMERA, pitch=0.02), 0.9)
    assert len(measured) == 4


def test_a_damaged_file_is_made_again(measured: list[object], tmp_path: Path) -> None:
    CachedCalibrations(load_lamps).operating_range(CAMERA, 0.9)
    (file,) = (tmp_path / "cache" / "calibrations").iterdir()
    file.write_bytes(file.read_bytes().replace(b"45.1", b"54.1"))
    assert CachedCalibrations(load_lamps).operating_range(CAMERA, 0.9) == RANGE
    assert len(measured) == 2


def test_without_a_cache_directory_it_is_made_all_the_same(
    measured: list[object], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("FOGSIM_CACHE_DIR", str(tmp_path / "file"))
    for _ in range(2):
        assert CachedCalibrations(load_lamps).operating_range(CAMERA, 0.9) == RANGE
    assert len(measured) == 2


def test_who_comes_while_it_is_made_waits_for_it(measured: list[object]) -> None:
    waiting = [
        threading.Thread(target=CachedCalibrations(load_lamps).operating_range, args=(CAMERA, 0.9)) for _ in range(4)
    ]
    for thread in waiting:
        thread.start()
    for thread in waiting:
        thread.join()
    assert len(measured) == 1


def test_it_is_announced(measured: list[object], caplog: pytest.LogCaptureFixture) -> None:
    CachedCalibrations(load_lamps).operating_range(CAMERA, 0.9)
    assert "calibrating signs of 0.9 m for a camera of 320 × 160 px, once" in caplog.text
    assert measured


def passes_a_sign(camera: Camera, monkeypatch: pytest.MonkeyPatch) -> Estimate:
    """What the method says once it has seen a sign of 0.9 m come out of the fog 45 m ahead."""
    method, watch = make("belaroussi2015", camera), Told()
    watch.tracks = (track("s", 45.0),)
    monkeypatch.setattr(method, "_watch", watch)
    return method.update(Observation(np.zeros((camera.height, camera.width, 3), np.uint8)))


def test_methods_calibrate_when_they_first_need_to(measured: list[object], monkeypatch: pytest.MonkeyPatch) -> None:
    halo = make("gallen2014_halo", NIGHT_CAMERA)
    assert not measured
    assert passes_a_sign(CAMERA, monkeypatch).visibility == pytest.approx(100.0, rel=0.01)
    assert measured == [(CAMERA, 0.9)]
    lit = night_image(LAMPS, glow=30.0)  # type: ignore[no-untyped-call]  # a helper of another test
    assert halo.update(lit).bounds is not None
    assert measured[1:] == [NIGHT_CAMERA]


def test_a_camera_that_cannot_be_calibrated_says_why(measured: list[object], monkeypatch: pytest.MonkeyPatch) -> None:
    estimate = passes_a_sign(replace(CAMERA, focal_length=50.0), monkeypatch)
    assert not estimate.valid
    assert estimate.diagnostics["reason"] == "too few pixels"
    assert len(measured) == 1


def test_own_light_is_kept_for_its_camera_and_lamps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("FOGSIM_CACHE_DIR", str(tmp_path / "cache"))
    made: list[tuple[object, ...]] = []
    light = OwnLight(np.ones((2, 3, 4), np.float32), np.zeros((2, 3, 4), np.float32), np.ones((2, 4), np.float32))

    def compute(camera: Camera, lamps: Lamp, setback: float, **options: object) -> OwnLight:
        made.append((camera, lamps, setback, options["known"]))
        return light

    monkeypatch.setattr(cached, "lit_fog", compute)
    for head_lamps in ("usual", "usual", "unknown", "unknown"):
        kept = CachedCalibrations(load_lamps).own_light(CAMERA, Lamp.LOW_BEAM, 1.7, head_lamps)
        assert np.array_equal(kept.veil, light.veil)
        assert kept.road.dtype == np.float32
    CachedCalibrations(load_lamps).own_light(CAMERA, Lamp.HIGH_BEAM, 1.7, "usual")
    assert made == [
        (CAMERA, Lamp.LOW_BEAM, 1.7, True),
        (CAMERA, Lamp.LOW_BEAM, 1.7, False),
        (CAMERA, Lamp.HIGH_BEAM, 1.7, True),
    ]
    assert "the light of low_beam 1.7 m ahead for a camera of 320 × 160 px, once" in caplog.text
