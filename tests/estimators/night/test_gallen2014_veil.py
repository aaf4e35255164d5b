"""The veil by correlation, as published and by steps of ln V."""

import numpy as np
import pytest

from fogsim.estimators import make, supply
from fogsim.estimators.night.gallen2014_veil import Gallen2014Veil
from fogsim.estimators.night.veil_correlation import (
    VeilScores,
    correlation,
    otsu_threshold,
    visibility_by_parabola,
)
from fogsim.values import Estimate, Lamp, Observation
from tests.estimators.night.pictures import CAMERA, SETBACK, night_picture

PUBLISHED = np.array([15.0, 50.0, 100.0, 200.0, 500.0])


def test_correlation_is_blind_to_gain_and_offset() -> None:
    one = np.array([1.0, 4.0, 2.0, 8.0])
    assert correlation(one, 3.0 * one + 7.0) == pytest.approx(1.0)
    assert correlation(one, -one) == pytest.approx(-1.0)
    assert np.isnan(correlation(one, np.ones(4)))
    assert np.isnan(correlation(np.zeros(0), np.zeros(0)))


def test_otsu_parts_two_classes() -> None:
    image = np.array([[10.0, 12.0, 11.0], [200.0, 205.0, 11.0]])
    assert 12.0 < otsu_threshold(image) < 200.0
    assert otsu_threshold(np.full((3, 3), 40.0)) == 255.0


def test_the_published_curve_gives_back_its_top_and_nothing_without_one() -> None:
    score = np.exp(-((PUBLISHED - 130.0) ** 2) / 4e5 - 0.1)
    assert visibility_by_parabola(VeilScores(PUBLISHED, score, 0.1)) == pytest.approx(130.0)
    assert visibility_by_parabola(VeilScores(PUBLISHED, 1.0 / score, 0.1)) is None
    assert visibility_by_parabola(VeilScores(PUBLISHED, np.array([0.5, np.nan, -0.1, 0.3, -0.2]), 0.1)) is None


def read(picture: np.ndarray, frames: int = 1, **options: bool) -> Estimate:
    estimator = Gallen2014Veil(CAMERA, **options)
    supply(estimator)
    for _ in range(frames):
        found = estimator.update(Observation(picture, lamps=Lamp.LOW_BEAM, camera_setback=SETBACK))
    return found


def test_by_default_it_is_the_model_of_night_road() -> None:
    found = read(night_picture(80.0))
    same = make("night_road", CAMERA).update(
        Observation(night_picture(80.0), lamps=Lamp.LOW_BEAM, camera_setback=SETBACK)
    )
    assert (found.method, found.extinction) == ("gallen2014_veil", same.extinction)
    assert found.visibility == pytest.approx(80.0, rel=0.25)


def test_as_published_the_top_lies_far_off_and_a_clear_night_is_no_fog() -> None:
    assert read(night_picture(100.0), as_published=True).visibility > 150.0
    clear = read(night_picture(np.inf), as_published=True)
    assert (clear.valid, clear.extinction, clear.diagnostics["detected"]) == (True, 0.0, False)


def test_the_median_leaves_out_what_passes() -> None:
    passing = night_picture(60.0)
    passing[40:70] = 255
    scores = []
    for middle in (passing, night_picture(60.0)):
        estimator = Gallen2014Veil(CAMERA, frames=5, median=True, as_published=True)
        supply(estimator)
        for picture in (night_picture(60.0), middle, night_picture(60.0)):
            found = estimator.update(Observation(picture, lamps=Lamp.LOW_BEAM, camera_setback=SETBACK))
        scores.append(found.diagnostics["score"])
    assert scores[0] == pytest.approx(scores[1], rel=0.01)


def test_what_it_cannot_tell() -> None:
    night, day = night_picture(60.0), night_picture(60.0, daylight=300.0, saturation=400.0)
    for picture, why in ((day, "for the night"), (np.full_like(night, 255), "saturated"), (night // 50, "too dark")):
        found = read(picture, as_published=True)
        assert not found.valid
        assert why in str(found.diagnostics["reason"])
    alone = Gallen2014Veil(CAMERA, as_published=True)
    assert "no head lamp" in str(alone.update(Observation(night, lamps=Lamp.POSITION)).diagnostics["reason"])
    assert "no calibration" in str(alone.update(Observation(night)).diagnostics["reason"])
