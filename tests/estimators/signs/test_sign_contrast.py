"""sign_contrast on painted signs: the fog behind the light of a face, and what wrong signs and maps do."""

import math
from dataclasses import replace

import numpy as np
import pytest
from sign_picture import AIRLIGHT, CAMERA, LATERAL, SETBACK, observed, picture

from fogsim.estimators import make
from fogsim.estimators.signs.face_light import LAYOUTS, UNKNOWN_SIGN, face_light, face_maps, layout_of
from fogsim.estimators.signs.sign_contrast import GRID, ApproachFit, extinction_of
from fogsim.units import extinction_from_visibility
from fogsim.values.estimate import NORMAL_90_PERCENT

WAY = np.arange(75.0, 13.0, -4.0).tolist()


def drive(visibility: float, *, along: float = 0.0, **how):
    """The estimate after the approach to one sign, of which the map errs along the road."""
    estimator = make("sign_contrast", CAMERA)
    for i, d in enumerate(WAY):
        seen = observed(d, visibility, time=0.2 * i, **how)
        told = tuple(replace(sign, distance=sign.distance + along) for sign in seen.signs)
        found = estimator.update(replace(seen, signs=told))
    return found


@pytest.mark.parametrize("visibility", [80.0, 150.0, 300.0])
def test_one_sign_tells_the_fog(visibility):
    found = drive(visibility)
    assert found.valid
    assert found.visibility == pytest.approx(visibility, rel=0.08)
    k = extinction_from_visibility(visibility)
    assert abs(found.extinction - k) < 1.5 * NORMAL_90_PERCENT * found.standard_deviation


def test_an_error_of_the_map_along_the_road_changes_little():
    assert drive(150.0, along=0.7).visibility == pytest.approx(150.0, rel=0.1)


def test_a_sign_that_is_not_there_tells_nothing():
    found = drive(150.0, standing=False)
    assert not found.valid
    assert found.bounds is None


def test_too_short_a_way_gives_a_reason():
    estimator = make("sign_contrast", CAMERA)
    found = [estimator.update(observed(d, 150.0, time=0.1 * i)) for i, d in enumerate((40.0, 38.0))]
    assert found[-1].diagnostics["reason"] == "no sign has come near enough yet"


def test_an_estimate_is_not_held_for_long():
    estimator = make("sign_contrast", CAMERA)
    for i, d in enumerate(WAY):
        found = estimator.update(observed(d, 150.0, time=0.2 * i))
    assert found.valid
    later = estimator.update(observed(50.0, 150.0, time=0.2 * len(WAY) + 3.0, signs=()))
    assert later.diagnostics["reason"] == "no sign is being looked at"


def test_light_of_a_face_is_that_of_the_law():
    distance, visibility = 30.0, 150.0
    scale = CAMERA.focal_length / (distance + SETBACK)
    place = CAMERA.principal_point[0] - LATERAL * scale, CAMERA.principal_point[1] - 0.9 * scale
    light = picture(distance, visibility).astype(np.float32)
    found = face_light(light, place, 0.45 * scale, layout_of("speed_limit"), 1.0, 0.0)
    fall = math.exp(-extinction_from_visibility(visibility) * (distance + SETBACK))
    assert found.black == pytest.approx(AIRLIGHT * (1.0 - fall), rel=0.03)
    assert found.slope == pytest.approx(0.55 * AIRLIGHT * fall, rel=0.1)


def test_the_noise_of_few_pixels_is_not_understated() -> None:
    rng, scale = np.random.default_rng(0), CAMERA.focal_length / 90.0
    place = CAMERA.principal_point[0] - LATERAL * scale, CAMERA.principal_point[1] - 0.9 * scale
    clean, read = picture(90.0 - SETBACK, 150.0).astype(np.float32), []
    for _ in range(60):
        light = clean + rng.normal(0.0, 2.0, clean.shape).astype(np.float32)
        found = face_light(light, place, 0.45 * scale, layout_of("yield"), 1.0, 2.0)
        variance, of_slope, shared = found.variance
        # A face so small is one point of the line, whose variance is that of its mean reflectance.
        assert found.is_mean
        read.append((found.black, math.sqrt(variance - shared**2 / of_slope)))
    seen, claimed = np.array(read).T
    assert np.std(seen) < 1.3 * np.median(claimed)


def test_one_of_three_signs_may_be_wrong() -> None:
    def fit(visibility: float) -> ApproachFit:
        return ApproachFit(-0.5 * ((np.log(GRID) - math.log(extinction_from_visibility(visibility))) / 0.05) ** 2, 1.0)

    mean, deviation = extinction_of([fit(200.0), fit(60.0), fit(205.0)], 0.1)
    assert 190.0 < math.log(20.0) / mean < 215.0
    assert deviation < 0.1 * mean


def test_every_layout_is_drawn_within_its_face() -> None:
    rows, cols = np.mgrid[-30:31, -30:31].astype(float)
    for layout in (*LAYOUTS.values(), UNKNOWN_SIGN):
        covered, light, _ = face_maps(layout, cols.ravel(), rows.ravel(), 20.0, 0.5, 1.0)
        assert 0.3 * math.pi * 400 < covered.sum() < 4.1 * 400
        assert np.all(light <= 0.97)
        assert light[covered < 0.01] == pytest.approx(0.0, abs=0.02)
    assert layout_of("7-unheard") is UNKNOWN_SIGN
