"""Fog from the veil of the own head lamps and the road behind it."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from fogsim.atmosphere.lamps.phase_function import Droplets
from fogsim.calibration.cached import supply
from fogsim.calibration.veil_references import PUBLISHED_VISIBILITIES, compute_references
from fogsim.errors import InputError
from fogsim.estimators import make
from fogsim.estimators.night.night_road import NightRoad
from fogsim.estimators.night.reference_file import read_references, references_as_bytes
from fogsim.values import Camera, Estimate, Lamp, LeadMeasurement, Observation
from tests.estimators.night.pictures import CAMERA, SETBACK, night_picture


def estimate(picture: NDArray[np.uint8], camera: Camera = CAMERA, **known: object) -> Estimate:
    told = {"lamps": Lamp.LOW_BEAM, "camera_setback": SETBACK, **known}
    return night_road(camera).update(Observation(picture, **told))


def night_road(camera: Camera = CAMERA, frames: int = 3) -> NightRoad:
    made = NightRoad(camera, frames=frames)
    supply(made)
    return made


@pytest.mark.parametrize("visibility", [17.0, 60.0, 180.0])
def test_what_is_drawn_is_found_whatever_the_exposure(visibility: float) -> None:
    for saturation in (1.5, 4.0):
        found = estimate(night_picture(visibility, saturation=saturation))
        assert found.visibility == pytest.approx(visibility, rel=0.04)
        low, high = found.visibility_interval
        assert low < visibility < high


def test_a_clear_night_has_no_fog() -> None:
    found = estimate(night_picture(np.inf))
    assert (found.valid, found.extinction) == (True, 0.0)
    assert 1000.0 < found.visibility_interval[0] < np.inf


@pytest.mark.parametrize(
    ("change", "within"),
    [
        ({"asphalt": 0.0195}, 0.06),
        ({"droplets": Droplets.HEAVY_RADIATION}, 0.10),
        ({"droplets": Droplets.HEAVY_ADVECTION}, 0.10),
    ],
    ids=["half as bright again", "larger droplets", "advection fog"],
)
def test_other_asphalt_and_droplets_do_little(change: dict[str, float], within: float) -> None:
    assert estimate(night_picture(80.0, **change)).visibility == pytest.approx(80.0, rel=within)


def test_a_pitch_that_is_not_the_told_one_does_little() -> None:
    picture = night_picture(80.0, camera=dataclasses.replace(CAMERA, pitch=CAMERA.pitch + np.radians(0.1)))
    assert estimate(picture).visibility == pytest.approx(80.0, rel=0.05)


def test_grey_pictures_and_a_black_level_are_read_alike() -> None:
    grey = np.ascontiguousarray(night_picture(60.0)[:, :, 1])
    assert estimate(grey).visibility == pytest.approx(60.0, rel=0.04)
    raised = dataclasses.replace(CAMERA, black_level=0.04)
    assert estimate(night_picture(60.0, camera=raised, noise=0.01), raised).visibility == pytest.approx(60.0, rel=0.06)


def test_what_it_cannot_tell() -> None:
    night = night_picture(60.0)
    day = night_picture(60.0, daylight=300.0, saturation=400.0)
    for picture, known, why in (
        (day, {}, "light of the day"),
        (np.full_like(night, 255), {}, "too bright nor too dark"),
        (np.full_like(night, 1), {}, "too dark"),
        (night, {"lamps": Lamp.POSITION}, "no head lamp is lit"),
        (night, {"lead": LeadMeasurement(5.0, 0.0)}, "close ahead"),
    ):
        found = estimate(picture, **known)
        assert not found.valid
        assert why in str(found.diagnostics["reason"])
    alone = NightRoad(CAMERA).update(Observation(night, lamps=Lamp.LOW_BEAM))
    assert "fogsim calibrate veil" in str(alone.diagnostics["reason"])
    densest = estimate(night_picture(6.0))
    assert not densest.valid
    assert densest.bounds is not None
    assert densest.bounds.least > 3.0 / 20.0


def test_vehicles_ahead_and_lamps_of_others_are_left_out() -> None:
    picture = night_picture(100.0)
    picture[58:66, 74:86] = 30  # its rear, 20 m ahead
    picture[50:56, 30:36] = 255
    found = estimate(picture, lead=LeadMeasurement(20.0, 0.0))
    assert found.visibility == pytest.approx(100.0, rel=0.1)


def test_a_change_of_lamps_begins_anew() -> None:
    estimator = night_road(frames=50)
    high = Lamp.LOW_BEAM | Lamp.HIGH_BEAM
    for _ in range(3):
        estimator.update(Observation(night_picture(60.0), lamps=Lamp.LOW_BEAM, camera_setback=SETBACK))
    lit = Observation(night_picture(60.0, lamps=high, saturation=12.0), lamps=high, camera_setback=SETBACK)
    assert estimator.update(lit).visibility == pytest.approx(60.0, rel=0.05)


def test_references_of_a_file_are_used_as_they_are(tmp_path: Path) -> None:
    made = compute_references(CAMERA, Lamp.LOW_BEAM, SETBACK, visibilities=PUBLISHED_VISIBILITIES)
    path = tmp_path / "veil.npz"
    path.write_bytes(references_as_bytes(made))
    read, *_ = read_references(path)
    assert (read.camera, read.lamps, read.setback) == (CAMERA, Lamp.LOW_BEAM, SETBACK)
    np.testing.assert_array_equal(read.veil, made[0].veil)
    estimator = make("night_road", CAMERA, references=str(path))
    found = estimator.update(Observation(night_picture(70.0), lamps=Lamp.LOW_BEAM))
    assert found.visibility == pytest.approx(70.0, rel=0.2)  # between references that are far apart
    with pytest.raises(InputError, match=r"no references for high_beam; it has low_beam"):
        estimator.update(Observation(night_picture(70.0), lamps=Lamp.HIGH_BEAM))
    with pytest.raises(InputError, match=r"camera 1.7 m behind the front bumper, and this one is 2.1 m behind it"):
        estimator.update(Observation(night_picture(70.0), lamps=Lamp.LOW_BEAM, camera_setback=2.1))
    other = dataclasses.replace(CAMERA, pitch=0.02)
    with pytest.raises(InputError, match=r"of the told camera, .*pitch=0.02.* and .* has those of .*pitch=0.035"):
        make("night_road", other, references=str(path))


def test_a_file_that_has_no_references_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"fogsim calibrate veil.*No such file"):
        make("night_road", CAMERA, references=str(tmp_path / "none.npz"))
    wrong = tmp_path / "wrong.npz"
    wrong.write_bytes(b"PK nothing")
    with pytest.raises(InputError, match=r"file of `fogsim calibrate veil`, got .*wrong.npz"):
        make("night_road", CAMERA, references=str(wrong))
    np.savez(wrong, veil0=np.zeros(3))
    with pytest.raises(InputError, match=r"wrong.npz.*head0"):
        make("night_road", CAMERA, references=str(wrong))
