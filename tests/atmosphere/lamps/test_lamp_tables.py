"""Tables of beams and phase functions, read back."""

import numpy as np
import pytest

from fogsim.atmosphere.lamps.lamp_tables import BLURS, FOLD, PHASE_SIZE, SIZE, lamp_table, phase_table
from fogsim.atmosphere.lamps.phase_function import Droplets, phase_function
from fogsim.lighting.beams import low_beam
from fogsim.values import Beam
from fogsim.values.luminous_intensity import luminous_intensity

EVEN = Beam(np.array([-1.6, 1.6]), np.array([-1.6, 1.6]), np.full((2, 2), 700.0))


def place(tangent: float) -> int:
    """Entry of a table that is nearest to a tangent."""
    return round((tangent / (FOLD + abs(tangent)) + 1.0) * 0.5 * (SIZE - 1))


def tangent(entry: int) -> float:
    """The tangent at an entry."""
    folded = 2.0 * entry / (SIZE - 1) - 1.0
    return FOLD * folded / (1.0 - abs(folded))


def test_the_sharp_table_holds_the_beam() -> None:
    for right, up in [(0.0, 0.0), (0.05, -0.02), (-0.3, -0.1), (0.8, 0.2)]:
        row, column = place(up), place(right)
        azimuth = np.arctan(tangent(column))
        elevation = np.arctan(tangent(row) * np.cos(azimuth))
        table = lamp_table(low_beam())
        assert table.shape == (SIZE, SIZE, BLURS)
        assert table[row, column, 0] == pytest.approx(luminous_intensity(low_beam(), azimuth, elevation), rel=1e-5)


def test_blurring_leaves_even_light_even_near_the_axis() -> None:
    middle = slice(place(-0.1), place(0.1))
    assert lamp_table(EVEN)[middle, middle, :6] == pytest.approx(700.0, rel=1e-4)
    assert np.all(np.diff(lamp_table(low_beam()).max(axis=(0, 1))) < 0)


def test_phase_functions_are_read_over_the_cosine_of_half_the_angle() -> None:
    phase = phase_function(Droplets.HEAVY_RADIATION)
    table = phase_table(phase)
    assert table[[0, -1]] == pytest.approx(phase([np.pi, 0.0]), rel=1e-6)
    assert table[PHASE_SIZE // 2] == pytest.approx(phase(2.0 * np.arccos(512 / 1023)), rel=1e-6)
