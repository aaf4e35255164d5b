"""The filter is the Cholesky factor of the covariance that its model says, which is built here in full."""

import numpy as np
import pytest

from fogsim.vision.strips.albedo_filter import (
    CLOUD_ANGLE,
    CONSTANT_DEVIATION,
    GRAZING,
    HIDDEN,
    HIDDEN_COST,
    LEFT_OUT_COST,
    USED,
    Albedo,
    Residuals,
    Whitened,
    albedo_transitions,
    hide_behind_obstacles,
    whiten,
)

ALBEDO = Albedo(0.04, 3.0, 0.1, 30.0, sheen=0.05, sheen_deviation=0.15, cloud_deviation=0.03)
AIRLIGHT = 200.0
DISTANCE = np.geomspace(5.0, 120.0, 24)
EXTENT = 0.1 * DISTANCE
GRAZING_ANGLE = np.arctan2(1.3, DISTANCE)
STRIPS = 2


def drawn(columns=3, seed=0):
    """Residuals of a few grey levels."""
    rng = np.random.default_rng(seed)
    scale = 60.0 * np.exp(-0.02 * DISTANCE) * np.array([[1.0], [0.8]])
    noise = rng.uniform(0.5, 2.0, scale.shape)
    veil = AIRLIGHT * (1.0 - np.exp(-0.02 * DISTANCE)) * np.ones((STRIPS, 1))
    return Residuals(rng.normal(0.0, 1.0, (*scale.shape, columns)), scale, veil, noise)


def room(residuals):
    strips, count, width = residuals.columns.shape
    used = np.full((strips, count), USED, np.uint8)
    return Whitened(np.empty((strips, count, width)), np.empty((strips, width)), used)


def share(length):
    """Deviation of the mean of an Ornstein–Uhlenbeck process over each bin, by integrating its covariance."""
    middle = (np.arange(400) + 0.5) / 400
    apart = np.abs(middle[:, None] - middle)
    return np.array([np.sqrt(np.exp(-extent / length * apart).mean()) for extent in EXTENT])


def mean_sheen(residuals):
    """Light of the mean sheen, by strip and bin."""
    return ALBEDO.sheen * (AIRLIGHT - residuals.veil) / (1.0 + GRAZING_ANGLE / GRAZING)


def dense_covariance(residuals, kept):
    """Covariance of all kept bins, near to far and strip by strip within a bin."""
    drift_share, patch_share = share(ALBEDO.drift_length), share(ALBEDO.patch_length)
    index = [(i, s) for i in range(DISTANCE.size) for s in range(STRIPS) if kept[s, i]]
    matrix = np.zeros((len(index), len(index)))
    for a, (i, s) in enumerate(index):
        for b, (j, t) in enumerate(index):
            apart = abs(DISTANCE[i] - DISTANCE[j])
            x = np.sqrt(3.0) * apart / ALBEDO.drift_length
            drift = ALBEDO.drift_deviation**2 * (1.0 + x) * np.exp(-x) * drift_share[i] * drift_share[j]
            patch = ALBEDO.patch_deviation**2 * np.exp(-apart / ALBEDO.patch_length) * patch_share[i] * patch_share[j]
            own = CONSTANT_DEVIATION**2 + patch if s == t else 0.0
            sheen = ALBEDO.sheen_deviation**2 / (1 + GRAZING_ANGLE[i] / GRAZING) / (1 + GRAZING_ANGLE[j] / GRAZING)
            cloud = np.exp(-abs(GRAZING_ANGLE[i] - GRAZING_ANGLE[j]) / CLOUD_ANGLE) * ALBEDO.cloud_deviation**2
            matrix[a, b] = residuals.scale[s, i] * residuals.scale[t, j] * (drift + own)
            matrix[a, b] += residuals.veil[s, i] * residuals.veil[t, j] * cloud
            matrix[a, b] += (AIRLIGHT - residuals.veil[s, i]) * (AIRLIGHT - residuals.veil[t, j]) * sheen
        matrix[a, a] += residuals.noise[s, i]
    return matrix, index


@pytest.mark.parametrize("missing", [(), (3, 4, 5, 17)])
def test_innovations_and_determinant_are_those_of_the_dense_cholesky_factor(missing):
    residuals = drawn()
    residuals.noise[1, list(missing)] = 0.0
    out = room(residuals)
    changes = albedo_transitions(DISTANCE, EXTENT, GRAZING_ANGLE, ALBEDO)
    logarithm = whiten(residuals, changes, ALBEDO, AIRLIGHT, False, out)
    covariance, index = dense_covariance(residuals, residuals.noise > 0)
    factor = np.linalg.cholesky(covariance)
    columns = np.array([residuals.columns[s, i] for i, s in index])
    columns[:, 0] -= [mean_sheen(residuals)[s, i] for i, s in index]
    expected = np.linalg.solve(factor, columns)
    found = np.array([out.innovations[s, i] for i, s in index])
    # The shares of means over bins are integrated in steps here.
    assert found == pytest.approx(expected, abs=1e-3)
    assert logarithm == pytest.approx(2.0 * np.log(np.diag(factor)).sum(), abs=1e-2)
    assert not out.used[1, list(missing)].any()


def test_constants_are_the_posterior_mean_of_the_strips_albedo():
    residuals = drawn(columns=1)
    out = room(residuals)
    whiten(residuals, albedo_transitions(DISTANCE, EXTENT, GRAZING_ANGLE, ALBEDO), ALBEDO, AIRLIGHT, False, out)
    covariance, index = dense_covariance(residuals, residuals.noise > 0)
    values = np.array([residuals.columns[s, i, 0] - mean_sheen(residuals)[s, i] for i, s in index])
    for strip in range(STRIPS):
        cross = np.array([CONSTANT_DEVIATION**2 * residuals.scale[s, i] * (s == strip) for i, s in index])
        assert out.constants[strip, 0] == pytest.approx(cross @ np.linalg.solve(covariance, values), abs=1e-4)


def test_of_an_outlier_nothing_is_learnt_and_it_costs_what_is_said():
    residuals = drawn()
    residuals.columns[0, 10, 0] = 80.0
    changes = albedo_transitions(DISTANCE, EXTENT, GRAZING_ANGLE, ALBEDO)
    out, absent = room(residuals), room(residuals)
    logarithm = whiten(residuals, changes, ALBEDO, AIRLIGHT, True, out)
    assert [tuple(place) for place in np.argwhere(out.used != USED)] == [(0, 10)]
    residuals.noise[0, 10] = 0.0
    without = whiten(residuals, changes, ALBEDO, AIRLIGHT, False, absent)
    assert out.innovations[out.used == USED] == pytest.approx(absent.innovations[absent.used == USED])
    assert logarithm - without == pytest.approx(LEFT_OUT_COST + np.log(AIRLIGHT**2 / (2.0 * np.pi)))
    residuals.noise[0, 10] = 1.7
    out.used[0, 10] = HIDDEN
    hidden = whiten(residuals, changes, ALBEDO, AIRLIGHT, False, out)
    assert hidden - without == pytest.approx(HIDDEN_COST + np.log(1.7))


def test_transitions_are_those_of_the_processes():
    same = albedo_transitions(np.array([10.0, 10.0]), np.array([1e-6, 1e-6]), np.zeros(2), ALBEDO)
    assert same[1] == pytest.approx([1.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    far = albedo_transitions(np.array([10.0, 1e4]), np.array([1e4, 1e4]), np.zeros(2), ALBEDO)[1]
    assert far[:5] == pytest.approx(np.zeros(5), abs=1e-9)
    # Of a mean over an extent of many lengths the variance is twice the length over the extent.
    assert far[6] ** 2 == pytest.approx(2.0 * ALBEDO.patch_length / 1e4, rel=1e-3)
    # Two steps of the drift and its slope are one of twice the length.
    steps = (albedo_transitions(np.array([0.0, d]), np.ones(2), np.zeros(2), ALBEDO)[1] for d in (7.0, 14.0))
    one, two = (step[:4].reshape(2, 2) for step in steps)
    assert one @ one == pytest.approx(two)


def test_what_is_behind_an_obstacle_is_hidden_and_single_outliers_hide_nothing():
    noise, used = np.ones((2, 12)), np.full((2, 12), USED, np.uint8)
    used[0, [2, 7, 8, 10]] = 0
    used[1, 5] = 0
    assert hide_behind_obstacles(noise, used)
    # Four of the bins from the eighth on: three outliers among five seen.
    assert used[0].tolist() == [USED, USED, 0, *[USED] * 4, *[HIDDEN] * 5]
    assert used[1].tolist() == [*[USED] * 5, 0, *[USED] * 6]
    few = np.full((1, 12), USED, np.uint8)
    few[0, [3, 8]] = 0
    assert not hide_behind_obstacles(noise[:1], few)
    assert HIDDEN not in few
