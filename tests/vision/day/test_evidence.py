"""The day model's filters against dense covariances of the same processes."""

import math

import numpy as np
import pytest

from fogsim.vision.day import evidence_kernels
from fogsim.vision.day.row_kernels import AIRLIGHT, COLUMNS, ROAD, SHEEN, VIGNETTING, fill_columns

FIRST = np.concatenate([np.arange(60.0, 100.0, 8.0), np.arange(100.0, 120.0), np.arange(120.0, 240.0, 10.0)])
LAST = np.append(FIRST[1:] - 1.0, 239.0)
LENS = np.array([300.0, 1.4, 120.0])
HORIZON = 101.3


@pytest.fixture
def rows():
    """Columns and places of bins, and light that some road has, with noise."""
    columns, place = np.zeros((FIRST.size, COLUMNS + 1)), np.empty((FIRST.size, 5))
    fill_columns(FIRST, LAST, HORIZON, LENS, 0.02, math.inf, columns, place)
    rng = np.random.default_rng(3)
    light = 0.5 * columns[:, AIRLIGHT] + 0.2 * columns[:, ROAD] + 0.02 * rng.standard_normal(FIRST.size)
    columns[:, COLUMNS] = light
    return columns, place, light, rng.uniform(0.005, 0.02, FIRST.size)


PRIOR_MEAN, PRIOR_DEVIATION = np.zeros(COLUMNS), np.zeros(COLUMNS)
for column, mean, deviation in ((AIRLIGHT, 0.5, 0.05), (ROAD, 0.2, 0.02), (SHEEN, 0.0, 0.03), (VIGNETTING, 0.0, 0.1)):
    PRIOR_MEAN[column], PRIOR_DEVIATION[column] = mean, deviation


def found_evidence(gram, half, least_airlight=0.0):
    law = evidence_kernels.Law(PRIOR_MEAN, PRIOR_DEVIATION, np.flatnonzero(PRIOR_DEVIATION > 0.0))
    return evidence_kernels.evidence(gram, half, law, least_airlight, 0, evidence_kernels.no_factor())


def dense(light, columns, covariance):
    """Logarithm of the density of light under the priors."""
    columns = columns[:, :COLUMNS]
    whole = covariance + (columns * PRIOR_DEVIATION**2) @ columns.T
    apart = light - columns @ PRIOR_MEAN
    return -0.5 * (apart @ np.linalg.solve(whole, apart) + np.linalg.slogdet(2.0 * np.pi * whole)[1])


def test_the_road_filter_is_the_dense_law_of_patches_grain_and_shared_noise(rows):
    columns, place, light, noise = rows
    road = LAST + 0.5 > HORIZON
    noise = np.where(road, noise, 0.0)
    shared, albedo = np.full(light.size, 0.004), np.array([0.03, 0.02, 0.0])
    cuts = np.array([light.size - 4, light.size])
    grams, halves = np.empty((2, COLUMNS + 1, COLUMNS + 1)), np.empty(2)
    steps = evidence_kernels.road_steps(place, noise, int(np.argmax(road)))
    evidence_kernels.road_pass(noise, shared, columns, place, steps, albedo, math.inf, cuts, grams, halves)
    for cut, gram, half in zip(cuts, grams, halves, strict=True):
        seen = np.flatnonzero(road[:cut])
        left, depth, extent, row = place[seen, :4].T
        apart = np.abs(depth[:, None] - depth)
        patches = left * albedo[0] * [evidence_kernels.footprint(e, evidence_kernels.PATCHES) for e in extent]
        grain = left * albedo[1] * [evidence_kernels.footprint(e, evidence_kernels.GRAIN) for e in extent]
        scaled = math.sqrt(3.0) / evidence_kernels.PATCHES * apart
        covariance = np.outer(patches, patches) * (1.0 + scaled) * np.exp(-scaled)
        covariance += np.outer(grain, grain) * np.exp(-apart / evidence_kernels.GRAIN)
        covariance += 0.004**2 * np.exp(-np.abs(row[:, None] - row) / evidence_kernels.SHARED_ROWS)
        covariance += np.diag(noise[seen] ** 2)
        assert found_evidence(gram, half) == pytest.approx(dense(light[seen], columns[seen], covariance), abs=0.01)


def test_the_sky_filter_is_the_dense_law_of_a_walk_upward_from_the_horizon(rows):
    columns, place, light, noise = rows
    size = int((LAST + 0.5 <= HORIZON).sum())
    slope, gram = np.full(light.size, 1.7), np.zeros((COLUMNS + 1, COLUMNS + 1))
    half = evidence_kernels.sky_pass(slope, noise, columns, place, size, np.array([0.0, 0.12]), gram)
    above = place[:size, 4]
    covariance = evidence_kernels.SKY_VARIANCE * 1.7**2 * np.minimum(above[:, None], above) + np.diag(noise[:size] ** 2)
    assert found_evidence(gram, half) == pytest.approx(dense(light[:size], columns[:size], covariance), abs=0.01)


def test_clipped_light_speaks_against_airlight_below_it(rows):
    columns, place, light, noise = rows
    gram = np.zeros((COLUMNS + 1, COLUMNS + 1))
    half = evidence_kernels.sky_pass(np.ones(light.size), noise, columns, place, 5, np.array([0.0, 0.12]), gram)
    free = found_evidence(gram, half)
    assert found_evidence(gram, half, 0.3) == pytest.approx(free, abs=0.01)
    assert found_evidence(gram, half, 0.7) < free - 5.0


def test_columns_are_shares_of_sky_air_and_road(rows):
    columns, place, _, _ = rows
    assert columns[:, AIRLIGHT] + columns[:, ROAD] == pytest.approx(1.0)
    assert columns[:5, ROAD].max() == 0.0
    # Koschmieder's law at the lowest bin, whose depth is height times focal length over rows.
    middle = 0.5 * (FIRST[-1] + LAST[-1]) - HORIZON
    slant = math.hypot(1.0, middle / LENS[0]) * LENS[0] * LENS[1] / middle
    assert place[-1, 0] == pytest.approx(math.exp(-0.02 * slant), rel=0.01)
