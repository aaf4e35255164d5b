"""The vectorised exponential against the C library's."""

import math

import numpy as np

from fogsim.core.exponential import exponential


def test_it_is_the_exponential_to_two_units_in_the_last_place() -> None:
    for x in np.random.default_rng(0).uniform(-700.0, 700.0, 2000).tolist():
        assert abs(exponential(x) - math.exp(x)) <= 4.5e-16 * math.exp(x)
    assert exponential(0.0) == 1.0
    assert exponential(-1e9) == exponential(-math.inf) == 0.0
    assert math.isnan(exponential(math.nan))
