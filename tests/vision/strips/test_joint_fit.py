"""The fit gets back what strips were drawn with, within the deviation that it states."""

from dataclasses import replace

import numpy as np
import pytest

from fogsim.vision.strips.joint_fit import JointFit, agree, fit_jointly, fit_own
from fogsim.vision.strips.joint_kernels import mean_transmittance
from tests.vision.strips.koschmieder_strips import AIRLIGHT, GEOMETRY, PRIOR, curves, fit_lanes


@pytest.mark.parametrize("visibility", [20.0, 60.0, 200.0, 600.0])
def test_extinction_and_airlight_come_back_within_the_stated_deviation(visibility):
    k = 3.0 / visibility
    fits = [fit_jointly(curves(k, seed), GEOMETRY, (PRIOR,)) for seed in range(24)]
    off = np.array([(fit.extinction - k) / fit.extinction_deviation for fit in fits])
    # An honest deviation: standardised errors are of deviation 1, none far out.
    assert 0.4 < np.sqrt((off**2).mean()) < 1.5
    assert np.abs(off).max() < 4.0
    assert max(fit.extinction_deviation for fit in fits) < 0.06 * k + 2e-4
    assert np.mean([fit.airlight for fit in fits]) == pytest.approx(AIRLIGHT, abs=1.5)
    assert np.mean([fit.road for fit in fits]) == pytest.approx(60.0, rel=0.03)
    assert np.mean([fit.misfit for fit in fits]) == pytest.approx(1.0, abs=0.4)
    assert not any(fit.hidden.any() for fit in fits)


@pytest.mark.parametrize("shift", [-1.5, 1.0])
def test_a_horizon_that_is_off_is_found_in_dense_fog(shift):
    fit = fit_jointly(curves(0.05, 3, shift=shift), GEOMETRY, (PRIOR._replace(shift_deviation=2.0),))
    assert fit.shift == pytest.approx(shift, abs=0.5)
    assert fit.extinction == pytest.approx(0.05, rel=0.03)


def test_clear_air_has_no_extinction():
    fit = fit_jointly(curves(0.0, 1), GEOMETRY, (PRIOR,))
    assert abs(fit.extinction) < 3.0 * fit.extinction_deviation
    assert fit.extinction + 2.0 * fit.extinction_deviation < 3.0 / 3000.0


def test_less_noise_and_more_strips_are_surer():
    seen = curves(0.03, 5)
    own, all_strips = fit_own(seen, GEOMETRY, (PRIOR,)), fit_jointly(seen, GEOMETRY, (PRIOR,))
    assert all_strips.extinction_deviation < own.extinction_deviation
    louder = seen._replace(variance=25.0 * seen.variance)
    assert fit_jointly(louder, GEOMETRY, (PRIOR,)).extinction_deviation > all_strips.extinction_deviation


def test_too_few_bins_give_no_answer():
    seen = curves(0.03)
    few = np.where(np.arange(seen.variance.shape[1]) < 7, 1.0, 0.0) * np.ones((3, 1))
    assert fit_jointly(seen._replace(variance=few), GEOMETRY, (PRIOR,)) is None
    assert fit_own(seen._replace(variance=np.zeros(seen.variance.shape)), GEOMETRY, (PRIOR,)) is None


def test_what_stands_on_the_lane_is_found_and_hides_what_is_behind():
    seen = curves(0.03, 2)
    foot = int(np.argmax(GEOMETRY.distance > 30.0))
    seen.luminance[0, foot:] = 20.0
    fit = fit_own(seen, GEOMETRY, (PRIOR,))
    assert np.flatnonzero(fit.hidden)[0] == pytest.approx(foot, abs=2)
    assert not fit.used[0][foot + 2 :].any()
    assert fit.extinction == pytest.approx(0.03, rel=0.35)


def test_neighbours_that_agree_are_taken_and_others_left_out():
    seen = curves(0.03, 4)
    own, best = fit_own(seen, GEOMETRY, (PRIOR,)), fit_lanes(seen, GEOMETRY, (PRIOR,))
    assert agree(own, best)
    assert best.used.shape[0] == 3
    assert best.extinction_deviation < own.extinction_deviation
    # A neighbour as in another fog is left out, be it as a strip or by its bins.
    for seed in range(4, 8):
        seen = curves(0.03, seed)
        seen.luminance[1] = curves(0.04, seed).luminance[1]
        kept = fit_lanes(seen, GEOMETRY, (PRIOR,))
        assert kept.extinction == pytest.approx(0.03, rel=0.04)
        assert len(kept.used) < 3 or kept.used[1].mean() < 0.7
    # Agreement is a matter of the deviations that are stated: the sharper the answers, the less may they differ.
    other = replace(own, extinction=1.2 * own.extinction)
    assert not agree(own, replace(other, extinction_deviation=0.5 * own.extinction_deviation))
    assert agree(replace(own, extinction_deviation=0.2 * own.extinction), other)


def test_a_neighbour_of_patchy_albedo_does_not_make_an_answer_less_sure():
    off = []
    for seed in range(8):
        seen, verge = curves(0.03, seed), curves(0.03, 100 + seed, road=35.0, patches=0.3)
        seen.luminance[2] = verge.luminance[2]
        kept = fit_lanes(seen, GEOMETRY, (PRIOR,))
        assert kept.extinction_deviation <= fit_own(seen, GEOMETRY, (PRIOR,)).extinction_deviation
        off.append(abs(kept.extinction / 0.03 - 1.0))
    assert np.median(off) < 0.02
    assert max(off) < 0.06


@pytest.mark.parametrize(
    ("below", "k"), [(0.8, 0.002), (3.0, 0.03), (20.0, 0.3), (120.0, 0.002), (0.8, 0.3), (120.0, 0.03)]
)
def test_mean_transmittance_is_the_mean_over_the_rows(k, below):
    half, path = 0.5, 800.0
    rows = below + half * ((np.arange(4000) + 0.5) / 2000.0 - 1.0)
    value, by_k, by_shift = mean_transmittance(below, half, path, k)
    assert value == pytest.approx(np.exp(-k * path / rows).mean(), abs=0.02 if below < 3.0 else 1e-4)
    step = 1e-6
    up, down = (mean_transmittance(below, half, path, k + sign * step)[0] for sign in (1.0, -1.0))
    assert by_k == pytest.approx((up - down) / (2.0 * step), rel=1e-4, abs=1e-6)
    lower, higher = (mean_transmittance(below - sign * step, half, path, k)[0] for sign in (1.0, -1.0))
    assert by_shift == pytest.approx((lower - higher) / (2.0 * step), rel=1e-4, abs=1e-6)


def test_transmittance_has_its_limits():
    assert mean_transmittance(10.0, 0.5, 800.0, 0.0)[0] == 1.0
    assert mean_transmittance(10.0, 0.5, 800.0, 10.0)[0] == pytest.approx(0.0, abs=1e-9)
    assert mean_transmittance(-5.0, 0.5, 800.0, 0.03) == (0.0, 0.0, 0.0)


def test_a_fit_that_tries_less_than_no_fog_keeps_numbers_at_the_horizon():
    found = np.array(mean_transmittance(0.5 + 1e-9, 0.5, 800.0, -1e-3))
    assert np.isfinite(found**2).all()


def test_only_a_road_brighter_than_asphalt_is_unsure_by_its_own_brightening():
    fit = JointFit(0.03, 0.001, 200.0, 0.0, 60.0, 1.0, np.ones((1, 8), bool), np.zeros(8, bool))
    assert fit.bright_deviation == 0.0
    pale, concrete = (replace(fit, road=road).bright_deviation for road in (70.0, 120.0))
    assert 0.0 < pale < 0.1 * fit.extinction < concrete
