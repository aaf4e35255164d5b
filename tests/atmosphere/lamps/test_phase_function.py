"""Phase functions: the packaged table against another Mie code's values, and what every phase function must hold."""

import math

import numpy as np
import pytest

from fogsim.atmosphere.lamps.phase_function import Droplets, blurred, henyey_greenstein, phase_function
from tests.atmosphere.tables import read_table

MEAN_COSINE = {"heavy_advection": 0.872, "moderate_advection": 0.870, "heavy_radiation": 0.854}


def over_the_sphere(phase, weight=np.ones_like):
    angle = np.concatenate(([0.0], np.geomspace(1e-5, math.pi, 20001)))
    return 2 * math.pi * np.trapezoid(phase(angle) * weight(angle) * np.sin(angle), angle)


def test_values_are_those_of_another_mie_code():
    for droplets in Droplets:
        table = read_table("mie_fog.csv")
        ours = phase_function(droplets)(np.radians(table["angle"]))
        assert ours == pytest.approx(table[droplets], rel=0.07)


def test_all_light_goes_somewhere_and_mostly_ahead():
    for droplets in Droplets:
        assert over_the_sphere(phase_function(droplets)) == pytest.approx(1.0, abs=2e-3)
    for droplets, mean in MEAN_COSINE.items():
        assert over_the_sphere(phase_function(Droplets(droplets)), np.cos) == pytest.approx(mean, abs=2e-3)


def test_henyey_greenstein():
    values = henyey_greenstein(np.radians([0, 90, 180]), 0.85)
    assert values == pytest.approx([6.54304, 0.00976819, 0.00348769], rel=1e-5)
    assert over_the_sphere(lambda a: henyey_greenstein(a, 0.85), np.cos) == pytest.approx(0.85, abs=1e-3)


def test_blur_keeps_light_and_fills_what_was_low():
    sharp = phase_function(Droplets.HEAVY_RADIATION)
    wide = blurred(sharp, 0.17)
    assert wide(math.radians(100)) > 1.2 * sharp(math.radians(100))
    assert wide(0.0) < 0.2 * sharp(0.0)
    narrow = blurred(sharp, 1e-3)
    assert narrow(math.radians(60)) == pytest.approx(float(sharp(math.radians(60))), rel=0.01)
