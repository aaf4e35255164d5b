from dataclasses import replace

import numpy as np
import pytest

from fogsim.values import Response
from fogsim.vision.light.luminance import linear_table
from fogsim.vision.strips.joint_checks import MAX_SCATTER, is_ramp, is_scattered, no_road
from fogsim.vision.strips.joint_fit import fit_own
from tests.vision.strips.koschmieder_strips import CAMERA, GEOMETRY, PRIOR, curves


@pytest.mark.parametrize("k", [0.005, 0.03, 0.2])
def test_a_road_in_fog_is_one(k):
    seen = curves(k)
    assert no_road(fit_own(seen, GEOMETRY, (PRIOR,)), seen, GEOMETRY, CAMERA) == ""


def test_scatter_is_measured_against_the_contrast_of_road_and_airlight():
    seen = curves(0.03)
    fit = fit_own(seen, GEOMETRY, (PRIOR,))
    for factor, scattered in ((0.95, False), (1.05, True)):
        patchy = seen._replace(scatter=np.full_like(seen.scatter, factor * MAX_SCATTER * (fit.airlight - fit.road)))
        assert is_scattered(fit, patchy, GEOMETRY) is scattered
        assert ("patchy" in no_road(fit, patchy, GEOMETRY, CAMERA)) is scattered


@pytest.mark.parametrize("response", list(Response))
def test_a_background_drawn_evenly_in_pixel_values_is_a_ramp_whatever_the_response(response):
    camera, table = replace(CAMERA, response=response), linear_table(response)
    values = 230.0 - 0.5 * GEOMETRY.below
    drawn = curves(0.03)._replace(luminance=np.tile(np.interp(values, np.arange(256), table), (3, 1)))
    assert is_ramp(drawn, GEOMETRY, camera)
    level = drawn._replace(luminance=np.full_like(drawn.luminance, 120.0))
    assert not is_ramp(level, GEOMETRY, camera)
    few = drawn._replace(variance=np.where(np.arange(GEOMETRY.below.size) < 2, 1.0, 0.0) * np.ones((3, 1)))
    assert not is_ramp(few, GEOMETRY, camera)
