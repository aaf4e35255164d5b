"""Curves that cameras may have."""

from dataclasses import replace

import numpy as np
import pytest

from fogsim.values import Camera, Response
from fogsim.vision.day.row_data import MOST_SLOPE, STATED, curves_of

CAMERA = Camera(64, 48, 60.0, (31.5, 23.5), 1.3)


@pytest.mark.parametrize("response", list(Response))
@pytest.mark.parametrize("black_level", [0.0, 0.05])
def test_the_stated_curve_comes_first_and_all_rise_from_dark_to_full(response, black_level):
    curves = curves_of(replace(CAMERA, response=response, black_level=black_level))
    assert curves.chance[0] == STATED
    assert curves.chance.sum() == pytest.approx(1.0)
    assert np.all(np.diff(curves.light, axis=1) >= 0.0)
    assert curves.light[:, -1] == pytest.approx(1.0, abs=0.01)
    assert np.all((curves.slope >= 1.0 / MOST_SLOPE) & (curves.slope <= MOST_SLOPE))


def test_no_curve_is_there_twice():
    for response in Response:
        light = curves_of(replace(CAMERA, response=response)).light
        apart = np.abs(light[:, None] - light[None]).max(axis=2) + np.eye(len(light))
        assert apart.min() > (0.01 if response is not Response.GAMMA else 0.005)
