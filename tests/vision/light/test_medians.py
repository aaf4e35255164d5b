"""Medians are those of numpy."""

import numpy as np
import pytest

from fogsim.vision.light.medians import median, quantile, row_medians


@pytest.mark.parametrize("count", [1, 2, 3, 4, 100, 1001])
def test_medians_are_those_of_numpy(count: int) -> None:
    """Of odd and even numbers of values, in one dimension and row by row; what is given is left as it is."""
    values = np.random.default_rng(count).normal(size=(5, count)).astype(np.float32 if count % 2 else np.float64)
    before = values.copy()
    assert row_medians(values) == pytest.approx(np.median(values, axis=1), rel=1e-6)
    assert median(values) == pytest.approx(float(np.median(values)), rel=1e-6)
    for share in (0.0, 0.3, 0.9, 1.0):
        assert quantile(values, share) == pytest.approx(float(np.quantile(values, share)), rel=1e-5)
    assert (values == before).all()
