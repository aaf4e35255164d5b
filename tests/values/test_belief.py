"""What a belief says: quantiles between the middles of its cells."""

import math

import numpy as np
import pytest

from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import Belief
from fogsim.values.belief import certain_belief

SHARES = (0.0, 0.05, 0.3, 0.5, 0.95, 1.0)


def test_quantiles_lie_on_straight_lines_between_the_middles_of_cells() -> None:
    rng = np.random.default_rng(4)
    for share_of_nothing in (0.0, 0.5):
        cells, weights = np.linspace(-7.0, -1.0, 60), rng.random(60) * (rng.random(60) >= share_of_nothing)
        belief = Belief(cells, weights / weights.sum())
        middles = np.cumsum(belief.probability) - 0.5 * belief.probability
        expected = OPTICAL_DEPTH_AT_VISIBILITY / np.exp(np.interp(1.0 - np.array(SHARES), middles, cells))
        np.testing.assert_array_equal(belief.visibility_quantiles(SHARES), expected)


def test_who_knows_the_fog_believes_one_visibility() -> None:
    assert certain_belief(0.03).visibility_quantiles(SHARES) == pytest.approx([OPTICAL_DEPTH_AT_VISIBILITY / 0.03] * 6)
    assert certain_belief(0.03).log_standard_deviation == 0.0


def test_the_deviation_is_that_of_the_cells() -> None:
    belief = Belief(np.array([-4.0, -3.0, -2.0], np.float32), np.array([0.25, 0.5, 0.25], np.float32))
    assert belief.log_standard_deviation == pytest.approx(math.sqrt(0.5))
    assert belief.visibility == pytest.approx(OPTICAL_DEPTH_AT_VISIBILITY * math.exp(3.0))
