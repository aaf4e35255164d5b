from dataclasses import replace

import numpy as np
import pytest

from fogsim.estimators.huang2015_ratios import (
    Regressions,
    fitted_extinction,
    image_confidence,
    published_extinction,
    ratio_table,
)
from fogsim.values.estimate import NORMAL_90_PERCENT

LN20 = np.log(20.0)
AWAY = np.arange(25.0, 91.0, 5.0)


def test_table_4_2_gives_the_thesis_its_visibility():
    # The ratios that the thesis prints for 150 m, by difference of range.
    found = ratio_table_of(
        [92.0751, 77.1763, 92.1565, 84.9044], [71.0602, 71.1230, 78.2449], [65.4866, 60.3865], [55.6010]
    )
    extinction, deviation = published_extinction(found)
    assert LN20 / extinction == pytest.approx(150.0, abs=55.0)
    assert 0 < deviation < extinction


def ratio_table_of(*rows):
    table = ratio_table(np.array([25.0, 30.0, 35.0, 40.0, 45.0]), np.exp(-0.04 * np.arange(25.0, 46.0, 5.0)), 5.0)
    return replace(table, ratio=np.array([np.mean(row) / 100.0 for row in rows]))


def test_ratio_table_drops_what_is_far_from_its_rows_median():
    distances = np.arange(20.0, 61.0, 5.0)
    variances = np.exp(-2 * 0.01 * distances)
    table = ratio_table(distances, variances, 5.0)
    assert table.ratio == pytest.approx(np.exp(-0.02 * table.difference))
    assert list(table.count) == [8, 7, 6, 5, 4, 3, 2, 1]
    variances[4] *= 9.0
    spoilt = ratio_table(distances, variances, 5.0)
    assert spoilt.ratio[0] == pytest.approx(np.exp(-0.1))
    assert spoilt.count[0] == 6


def test_published_search_ends_at_33_m_of_visibility():
    distances = np.arange(20.0, 61.0, 5.0)
    extinction, _ = published_extinction(ratio_table(distances, np.exp(-2 * 0.15 * distances), 5.0))
    assert extinction == 0.09


def test_image_confidence_falls_to_one_part_in_400_at_the_visibility():
    assert image_confidence(LN20 / 150.0, 150.0) == pytest.approx(0.05**2)
    curve = image_confidence(0.02, np.array([25.0, 50.0, 75.0]), 25.0)
    assert curve == pytest.approx([1.0, np.exp(-1.0), np.exp(-2.0)])
    assert image_confidence(0.0, 1e6) == 1.0


def exact(extinction, airlight=1.0, distances=AWAY):
    t = np.exp(-extinction * (distances - distances[0]))
    near = np.full(t.size, 0.4)
    small = np.full(t.size, 1e-3)
    return Regressions(distances, t, small, airlight - (airlight - near) * t, small, near)


PULLED = pytest.mark.xfail(
    strict=True, reason="the sky's prior pulls by 5 and 3.4 %, since slopes of detail count less"
)


@pytest.mark.parametrize(
    ("extinction", "airlight"),
    [
        *((extinction, 1.0) for extinction in (0.003, 0.02, 0.06, 0.2)),
        pytest.param(0.003, 0.97, marks=PULLED),
        pytest.param(0.02, 0.97, marks=PULLED),
        (0.06, 0.97),
        (0.2, 0.97),
    ],
)
def test_fit_returns_what_was_put_in(extinction, airlight):
    fit = fitted_extinction(exact(extinction, airlight))
    # The prior of the sky pulls where thin fog leaves the airlight to it.
    assert fit.extinction == pytest.approx(extinction, rel=0.01 if airlight == 1.0 else 0.03)


@pytest.mark.parametrize(("extinction", "airlight"), [(0.003, 1.0), (0.02, 0.97), (0.06, 1.0), (0.2, 0.97)])
def test_interval_of_a_fit_holds_what_was_put_in(extinction, airlight):
    fit = fitted_extinction(exact(extinction, airlight))
    assert abs(fit.extinction - extinction) < NORMAL_90_PERCENT * fit.deviation
    assert 0 < fit.deviation < 0.2 * extinction


def test_fit_needs_ranges_that_differ():
    data = exact(0.02)
    assert fitted_extinction(replace(data, distance=np.full(AWAY.size, 30.0))) is None
    assert fitted_extinction(exact(0.02, distances=AWAY[:2])) is None


def test_scaling_all_ranges_scales_the_visibility():
    data = exact(0.02)
    doubled = fitted_extinction(replace(data, distance=2.0 * data.distance))
    assert doubled.extinction == pytest.approx(0.5 * fitted_extinction(data).extinction, rel=0.01)
