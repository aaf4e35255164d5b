"""Belief over space from estimates, announcements and reports."""

import dataclasses
import math

import numpy as np
import pytest

from fogsim.errors import InputError
from fogsim.fusion import make
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import DenserFog, Estimate, FogReport, OpticalDepths
from fogsim.values.estimate import ExtinctionBounds

SPEED, PERIOD = 25.0, 0.2


def seen(visibility: float, relative: float = 0.05, **more: object) -> Estimate:
    k = OPTICAL_DEPTH_AT_VISIBILITY / visibility
    return Estimate("test", k, relative * k, **more)


def curve_of(depth, reach: float = 300.0) -> OpticalDepths:
    distance = np.geomspace(10.0, reach, 20)
    depths = depth(distance)
    return OpticalDepths(*(tuple(values.tolist()) for values in (distance, depths, 0.05 * depths)))


def driven(fusion, estimates, seconds: float = 10.0, start: float = 0.0, place: float = 0.0, reports=()):
    belief = None
    for i in range(round(seconds / PERIOD)):
        time = start + i * PERIOD
        belief = fusion.update_at(estimates, time, place + SPEED * i * PERIOD, reports if i == 0 else ())
    return belief


def report(place: float, visibility: float, time: float = 0.0, number: int = 1, relative: float = 0.1) -> FogReport:
    return FogReport("car", number, place, time, OPTICAL_DEPTH_AT_VISIBILITY / visibility, relative)


def test_even_fog_is_believed_here_and_unsure_ahead():
    belief = driven(make("field_filter"), [seen(150.0)])
    assert belief.visibility == pytest.approx(150.0, rel=0.06)
    low, high = belief.visibility_quantiles((0.05, 0.95))
    assert low < 150.0 < high
    assert high / low < 2.5
    deviations = [belief.profile.at(distance)[1] for distance in (10.0, 100.0, 300.0, 900.0)]
    assert deviations == sorted(deviations)
    assert deviations[-1] > 1.0
    assert belief.profile.at(-100.0)[1] < 0.4


def test_a_curve_of_optical_depths_tells_of_stretches():
    bank = curve_of(lambda d: 0.004 * d + 0.03 * np.maximum(d - 100.0, 0.0), 190.0)
    estimate = Estimate("test", 0.017, 0.001, reach=190.0, optical_depths=bank)
    profile = driven(make("field_filter"), [estimate], 1.0).profile
    assert profile.at(50.0)[0] == pytest.approx(math.log(0.004), abs=0.5)
    assert profile.at(150.0)[0] == pytest.approx(math.log(0.034), abs=0.5)


def test_an_estimate_of_one_number_speaks_of_all_that_it_has_seen():
    """It has taken the fog for even: denser here and thinner there would have the same mean."""
    profile = make("field_filter").update_at([seen(60.0, 0.12, reach=60.0)], 0.0, 0.0).profile
    for distance in (15.0, 45.0):
        assert profile.visibility_quantile(distance, 0.5) == pytest.approx(60.0, rel=0.1)
        assert profile.at(distance)[1] < 0.6


def test_announced_fog_is_believed_where_it_is_told():
    fusion = make("field_filter")
    thin = curve_of(lambda d: 0.002 * d, 150.0)
    for i in range(20):
        told = Estimate(
            "test", 0.002, 2e-4, reach=150.0, optical_depths=thin, denser=DenserFog(200.0 - 5.0 * i, 20.0, 0.05)
        )
        belief = fusion.update_at([told], 0.2 * i, SPEED * 0.2 * i)
    assert belief.denser is not None
    there, deviation = belief.profile.at(belief.denser.distance + 70.0)
    assert there == pytest.approx(math.log(0.05), abs=2.0 * deviation)
    assert there > math.log(0.015)


def test_a_bank_that_is_entered_is_believed_within_seconds():
    fusion = make("field_filter")
    driven(fusion, [seen(2000.0, 0.3)], 10.0)
    inside = curve_of(lambda d: d * OPTICAL_DEPTH_AT_VISIBILITY / 60.0, 75.0)
    belief = driven(fusion, [seen(60.0, reach=75.0, optical_depths=inside)], 3.0, start=10.0, place=250.0)
    assert belief.visibility == pytest.approx(60.0, rel=0.15)
    assert belief.profile.visibility_quantile(0.0, 0.5) == pytest.approx(60.0, rel=0.15)
    # And what lies behind is still believed clear.
    assert belief.profile.visibility_quantile(-200.0, 0.5) > 300.0


def test_a_report_from_ahead_is_believed_where_it_was_measured():
    fusion = make("field_filter")
    thin = [seen(800.0, 0.1, reach=200.0)]
    belief = driven(fusion, thin, 2.0, reports=[report(350.0 + 10.0 * i, 80.0, number=i) for i in range(4)])
    assert belief.profile.visibility_quantile(320.0, 0.5) == pytest.approx(80.0, rel=0.15)
    without = driven(make("field_filter"), thin, 2.0)
    assert without.profile.visibility_quantile(300.0, 0.5) > 400.0


def test_reports_that_cannot_be_change_nothing():
    for bad in [
        report(350.0, 80.0, time=50.0),
        report(350.0, 80.0, time=-1000.0),
        report(350.0, math.nan),
        report(math.inf, 80.0),
        report(350.0, 80.0, relative=0.0),
        report(350.0, -80.0),
        report(90_000.0, 80.0),
    ]:
        plain = driven(make("field_filter"), [seen(800.0, 0.1)], 1.0)
        told = driven(make("field_filter"), [seen(800.0, 0.1)], 1.0, reports=[bad])
        np.testing.assert_array_equal(told.profile.log_extinction, plain.profile.log_extinction)


def test_clocks_may_disagree_by_some_seconds():
    now = driven(make("field_filter"), [seen(800.0, 0.1)], 1.0, reports=[report(350.0, 80.0, time=1.0)])
    ahead = driven(make("field_filter"), [seen(800.0, 0.1)], 1.0, reports=[report(350.0, 80.0, time=4.0)])
    np.testing.assert_array_equal(ahead.profile.log_extinction, now.profile.log_extinction)


def test_a_bank_beyond_what_is_seen_is_no_contradiction_to_clear_air_here():
    """Of it others tell; the camera sees 190 m, in which the air is clear."""
    fusion, clear = make("field_filter"), dataclasses.replace(seen(2000.0, 0.2), reach=190.0)
    for number in range(40):
        reports = [FogReport(f"at {at}", number, at, 0.5 * number, 0.05, 0.1) for at in (260.0, 310.0)]
        told = fusion.update_at([clear], 0.5 * number, 0.0, reports)
    assert told.profile.visibility_quantile(300.0, 0.5) == pytest.approx(60.0, rel=0.2)
    assert told.profile.visibility_quantile(50.0, 0.5) > 1000.0


def test_two_reports_side_by_side_that_tell_of_the_same_bank_are_believed_where_one_is_doubted():
    clear = [FogReport(f"at {at}", 0, at, 0.0, 0.0015, 0.1) for at in (300.0, 325.0, 350.0, 375.0)]

    def told(*banks: FogReport) -> float:
        return make("field_filter").update_at([], 0.0, 0.0, [*clear, *banks]).profile.visibility_quantile(430.0, 0.5)

    first, second = (FogReport("ahead", number, 400.0 + 30.0 * number, 0.0, 0.05, 0.1) for number in (1, 2))
    assert told(first) > 300.0
    assert told(second) > 300.0
    assert told(first, second) < 200.0
    assert told(first, dataclasses.replace(second, extinction=0.6)) > 300.0


def test_a_report_that_comes_twice_counts_once():
    once = driven(make("field_filter"), [], 1.0, reports=[report(350.0, 80.0)])
    twice = driven(make("field_filter"), [], 1.0, reports=[report(350.0, 80.0)] * 3)
    np.testing.assert_array_equal(once.profile.log_extinction, twice.profile.log_extinction)


def test_an_old_report_says_less_than_a_fresh_one():
    fresh, old = (make("field_filter").update_at([], 200.0, 0.0, [report(300.0, 80.0, time)]) for time in (200.0, 0.0))
    assert fresh.profile.at(300.0)[1] < old.profile.at(300.0)[1]


def test_a_sensor_that_lies_one_time_in_five_does_not_double_the_error():
    rng = np.random.default_rng(3)

    def error(lying: float) -> float:
        off = []
        for _ in range(30):
            fusion, truth = make("field_filter"), math.exp(rng.uniform(math.log(50.0), math.log(500.0)))
            reports = []
            for number in range(12):
                lie = math.exp(rng.uniform(math.log(20.0), math.log(5000.0)))
                told = lie if rng.random() < lying else truth * math.exp(rng.normal(0.0, 0.1))
                reports.append(report(200.0 + rng.uniform(-30.0, 30.0), told, 0.0, number))
            belief = fusion.update_at([], 0.0, 0.0, reports)
            off.append(abs(math.log(belief.profile.visibility_quantile(200.0, 0.5) / truth)))
        return float(np.median(off))

    assert error(0.2) < 2.0 * error(0.0)


def test_silent_methods_tell_no_more_than_their_bounds():
    nothing = driven(make("field_filter"), [Estimate.invalid("test", "dark")], 1.0)
    bounded = Estimate("test", 0.0, math.inf, valid=False, bounds=ExtinctionBounds(most=0.012))
    told = driven(make("field_filter"), [bounded], 1.0)
    assert told.profile.visibility_quantile(50.0, 0.05) > 2.0 * nothing.profile.visibility_quantile(50.0, 0.05)


def test_no_fog_seen_leaves_the_road_ahead_open():
    belief = driven(make("field_filter"), [Estimate("test", 0.0, 0.001, reach=200.0)], 5.0)
    assert belief.profile.visibility_quantile(100.0, 0.05) > 400.0
    assert belief.profile.at(800.0)[1] > 1.0


def test_the_belief_is_a_distribution_and_stays_one_whatever_comes():
    rng, fusion = np.random.default_rng(5), make("field_filter")
    for i in range(300):
        k, reach = math.exp(rng.uniform(-9.0, -1.0)), rng.uniform(5.0, 2000.0)
        told = Estimate("test", k, k * math.exp(rng.uniform(-5.0, 3.0)), reach=reach)
        belief = fusion.update_at([told], 0.1 * i, 40.0 * i * rng.random(), [report(rng.normal(0, 1e3), 50.0, 0.0, i)])
        assert belief.probability.sum() == pytest.approx(1.0)
        assert (belief.probability >= 0.0).all()
        assert np.isfinite(belief.profile.log_extinction).all()
        assert (belief.profile.standard_deviation > 0.0).all()


def test_reset_forgets_and_places_must_be_numbers():
    fusion = make("field_filter")
    driven(fusion, [seen(60.0)], 5.0)
    fusion.reset()
    fresh = make("field_filter").update_at([], 0.0, 0.0)
    np.testing.assert_array_equal(fusion.update_at([], 0.0, 0.0).probability, fresh.probability)
    with pytest.raises(InputError, match="place"):
        fusion.update_at([], 1.0, math.nan)


def test_who_drives_on_blindly_knows_less_and_less_of_the_road_ahead():
    fusion = make("field_filter")
    driven(fusion, [seen(150.0, reach=150.0)], 10.0)
    known = [
        driven(fusion, [Estimate.invalid("test", "black")], 2.0, start=10.0 + 2.0 * i, place=250.0 + 50.0 * i)
        for i in range(6)
    ]
    deviations = [belief.profile.at(50.0)[1] for belief in known]
    assert deviations == sorted(deviations)
    assert deviations[-1] > 1.0
    assert known[-1].log_standard_deviation > 2.0 * known[0].log_standard_deviation


def test_bounds_are_learnt_on_both_sides_and_a_wrong_one_does_not_outweigh_good_estimates():
    dense, thin = (
        Estimate("test", 0.0, math.inf, valid=False, bounds=bounds)
        for bounds in (ExtinctionBounds(least=0.1), ExtinctionBounds(most=0.015))
    )
    fusion = make("field_filter")
    driven(fusion, [seen(300.0)], 5.0)
    assert driven(fusion, [dense], 10.0, start=5.0, place=125.0).visibility < 40.0
    low, high = driven(make("field_filter"), [seen(60.0, 0.1), thin]).visibility_quantiles((0.05, 0.95))
    assert 40.0 < low < 60.0 < high < 110.0


def test_who_stands_for_an_hour_and_sees_the_fog_knows_it_here():
    fusion = make("field_filter")
    for second in range(0, 3600, 2):
        belief = fusion.update_at([seen(250.0, 0.15)], float(second), 500.0)
    assert belief.profile.known_visibility(0.0, 0.5) == pytest.approx(250.0, rel=0.2)


def test_methods_that_disagree_leave_the_interval_wide_enough_for_either():
    rng, fusion, held = np.random.default_rng(3), make("field_filter"), []
    for i in range(150):
        right, wrong = (seen(v * math.exp(0.1 * rng.standard_normal()), 0.1) for v in (100.0, 300.0))
        belief = fusion.update_at([right, wrong], PERIOD * i, SPEED * PERIOD * i)
        held.append(belief.visibility_quantile(0.025) <= 100.0 <= belief.visibility_quantile(0.975))
    assert np.mean(held) > 0.7
