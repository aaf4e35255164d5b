import numpy as np
import pytest

from fogsim.estimators.lead_contrast import fit_decay

RANGES = np.arange(25.0, 91.0, 5.0)


def fitted(k, noise=1e-4, relative=0.01, seed=0, size=0.8, offset=0.0):
    rng = np.random.default_rng(seed)
    contrast = size * np.exp(-k * RANGES) + offset
    contrast = contrast * (1 + relative * rng.normal(size=RANGES.size)) + noise * rng.normal(size=RANGES.size)
    return fit_decay(RANGES, contrast, np.full(RANGES.size, noise), relative, 0.002)


@pytest.mark.parametrize("k", [0.1, 0.03, 0.003, 0.0])
def test_recovers_a_clean_decay(k):
    fit = fitted(k, relative=1e-4)
    assert fit.extinction == pytest.approx(k, abs=3e-4)
    assert fit.contrast == pytest.approx(0.8, rel=0.02)


def test_constant_errors_of_range_and_bright_targets_change_nothing_and_too_few_ranges_give_nothing():
    contrast = np.exp(-0.03 * RANGES)
    noise = np.full(RANGES.size, 1e-4)
    fits = [fit_decay(RANGES + off, contrast, noise, 0.01, 0.002) for off in (0.0, 3.0)]
    assert fits[0].extinction == pytest.approx(fits[1].extinction, rel=1e-6)
    assert fitted(0.03, size=-0.5).extinction == pytest.approx(0.03, rel=0.1)
    assert fit_decay(RANGES[:2], np.ones(2), np.ones(2), 0.01, 0.002) is None
    assert fit_decay(RANGES, np.zeros(RANGES.size), np.ones(RANGES.size), 0.01, 0.002) is None


def test_interval_covers():
    fits = [fitted(0.02, relative=0.012, seed=s) for s in range(120)]
    inside = [abs(f.extinction - 0.02) < 1.645 * f.deviation for f in fits]
    assert 0.82 < np.mean(inside) <= 1.0
