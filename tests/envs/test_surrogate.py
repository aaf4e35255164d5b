"""Estimates that are drawn in place of frames: by their table, and the tables that come with FogSim."""

import math
from pathlib import Path

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim_envs.task.surrogate import MEASURED, MEASURED_2, EstimatorSurrogate, SurrogateTable


def test_a_table_has_finite_numbers() -> None:
    with pytest.raises(InputError, match="SurrogateTable: error must have finite numbers"):
        _table(math.nan, 1.0)


def _table(error: float, valid: float) -> SurrogateTable:
    shape, quantiles = (3, 2), np.linspace(error - 0.2, error + 0.2, 5)
    rows = np.broadcast_to(quantiles, (*shape, 5))
    share = np.full(shape, valid)
    edges = np.array([1.0, 100.0, 1e6])
    return SurrogateTable("negru2013", edges, share, share, np.zeros(shape), rows, rows - 2.0, rows, 0.3, 0.5)


def test_the_surrogate_draws_what_its_table_says() -> None:
    surrogate, found = EstimatorSurrogate(_table(0.1, 0.8)), []
    for episode in range(300):
        surrogate.reset(np.random.default_rng(episode))
        found += [surrogate.estimate(0.05, 5000.0) for _ in range(20)]
    errors = np.array([math.log(one.extinction / 0.05) for one in found if one.valid])
    assert len(errors) / len(found) == pytest.approx(0.8, abs=0.02)
    assert np.median(errors) == pytest.approx(0.1, abs=0.02)
    assert np.quantile(errors, [0.25, 0.75]) == pytest.approx([0.0, 0.2], abs=0.03)
    assert errors.min() >= -0.1
    assert errors.max() <= 0.3


@pytest.mark.parametrize(("measured", "method"), [(MEASURED, "negru2013"), (MEASURED_2, "first_valid")])
def test_the_measured_tables_are_read_and_written(tmp_path: Path, measured: Path, method: str) -> None:
    table = SurrogateTable.load(measured)
    assert table.method == method
    path = tmp_path / "table.json"
    path.write_text(table.as_json(), encoding="utf-8")
    np.testing.assert_array_equal(SurrogateTable.load(path).error, table.error)
    assert np.all(np.diff(table.error, axis=2) >= 0.0)
