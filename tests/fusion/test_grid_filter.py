import dataclasses
import math

import numpy as np
import pytest

from fogsim.errors import InputError, UnknownNameError
from fogsim.fusion import FUSIONS, LocatedFusion, make
from fogsim.units import OPTICAL_DEPTH_AT_VISIBILITY
from fogsim.values import DenserFog, Estimate, OpticalDepths
from fogsim.values.estimate import ExtinctionBounds


def k_of(visibility):
    return OPTICAL_DEPTH_AT_VISIBILITY / visibility


def measured(visibility, relative=0.1):
    return Estimate("test", k_of(visibility), relative * k_of(visibility))


def feed(fusion, estimates, start=0.0, period=0.1):
    for index, estimate in enumerate(estimates):
        belief = fusion.update([estimate], start + index * period)
    return belief


def test_before_any_estimate_every_visibility_is_and_stays_equally_likely():
    fusion = make("grid_filter")
    belief = fusion.update([], 0.0)
    assert belief.probability == pytest.approx(np.full(240, 1 / 240))
    assert np.exp(belief.log_extinction[[0, -1]]) == pytest.approx([k_of(10_000), k_of(10)])
    assert fusion.update([], 50.0).probability == pytest.approx(np.full(240, 1 / 240), rel=1e-9)


def test_converges_to_a_steady_measurement():
    for visibility in [15.0, 60.0, 250.0, 900.0, 4000.0]:
        belief = feed(make("grid_filter"), [measured(visibility)] * 50)
        assert belief.visibility == pytest.approx(visibility, rel=0.03)
        assert belief.log_standard_deviation < 0.1


def test_one_good_estimate_is_the_posterior_of_bayes():
    belief = make("grid_filter", outlier_share=1e-9).update([measured(100.0, 0.2)], 0.0)
    k = np.exp(belief.log_extinction)
    expected = np.exp(-0.5 * ((k - k_of(100)) / (math.hypot(0.2, 0.05) * k_of(100))) ** 2)
    assert belief.probability == pytest.approx(expected / expected.sum(), abs=1e-6)


def test_abstention_widens_and_does_not_move():
    fusion = make("grid_filter")
    before = feed(fusion, [measured(100.0)] * 30)
    spreads = [before.log_standard_deviation]
    for index in range(30):
        belief = fusion.update([Estimate.invalid("test", "nothing seen")], 3.0 + 0.1 * index)
        spreads.append(belief.log_standard_deviation)
    assert np.all(np.diff(spreads) > 0)
    assert belief.visibility == pytest.approx(before.visibility, rel=0.05)


def test_diffusion_does_not_depend_on_how_time_is_cut():
    spreads = []
    for period in (0.02, 0.1, 0.5):
        fusion = make("grid_filter", leap_rate=0.0)
        fusion.update([measured(100.0)], 0.0)
        belief = feed(fusion, [Estimate.invalid("test", "-")] * round(5.0 / period), period, period)
        spreads.append(belief.log_standard_deviation)
    assert spreads == pytest.approx([spreads[0]] * 3, rel=0.02)


@pytest.mark.parametrize(("before", "after"), [(400.0, 100.0), (100.0, 400.0), (2000.0, 40.0)])
def test_step_change_is_followed_within_two_seconds(before, after):
    fusion = make("grid_filter")
    feed(fusion, [measured(before)] * 100)
    belief = feed(fusion, [measured(after)] * 20, start=10.0)
    assert belief.visibility == pytest.approx(after, rel=0.1)


def test_single_outlier_hardly_moves_the_belief():
    fusion = make("grid_filter")
    before = feed(fusion, [measured(200.0)] * 50)
    after = fusion.update([measured(20.0)], 5.0)
    assert after.visibility == pytest.approx(before.visibility, rel=0.02)


def test_no_fog_seen_excludes_dense_fog_only():
    belief = feed(make("grid_filter"), [Estimate("test", 0.0, 0.005)] * 50)
    assert belief.visibility_quantile(0.05) > 150.0
    assert belief.visibility_quantile(0.95) > 5000.0


def test_what_all_images_have_wrong_in_common_stays_in_the_belief():
    alike = [dataclasses.replace(measured(100.0, 0.25), common_deviation=0.2)] * 200
    fusion = make("grid_filter")
    assert 0.0 < alike[0].own_deviation < 0.5 * alike[0].standard_deviation
    assert feed(fusion, alike).log_standard_deviation == pytest.approx(0.2, abs=0.05)
    # What the images do not have in common is little, so that a change is followed at once.
    thinner = [dataclasses.replace(one, extinction=0.3 * one.extinction) for one in alike[:20]]
    assert feed(fusion, thinner, start=20.0).visibility > 250.0
    # A method without such errors, once it speaks, counts as it did.
    assert feed(fusion, [measured(100.0)] * 50, start=30.0).log_standard_deviation < 0.15
    assert feed(fusion, [Estimate.invalid("test", "nothing seen")], start=35.0).log_standard_deviation < 0.2


@pytest.mark.parametrize("wrong", [0.5, 2.0])
def test_errors_in_common_do_not_make_surer_of_a_wrong_value(wrong):
    fusion = make("grid_filter")
    feed(fusion, [measured(80.0)] * 50)
    worse = dataclasses.replace(measured(wrong * 80.0, 0.8), common_deviation=0.6)
    for number in range(150):
        belief = fusion.update([worse], 5.0 + 0.2 * number)
        assert belief.visibility_quantile(0.05) < 80.0 < belief.visibility_quantile(0.95)


def test_agreeing_methods_narrow_the_belief():
    one = make("grid_filter").update([measured(100.0)], 0.0)
    two = make("grid_filter").update([measured(100.0), measured(100.0)], 0.0)
    assert two.log_standard_deviation < one.log_standard_deviation


def test_frames_within_a_correlation_time_count_as_one():
    dense, sparse = make("grid_filter", leap_rate=0.0, drift=1e-6), make("grid_filter", leap_rate=0.0, drift=1e-6)
    often = feed(dense, [measured(100.0)] * 101, period=0.01)
    seldom = feed(sparse, [measured(100.0)] * 3, period=0.5)
    assert often.log_standard_deviation == pytest.approx(seldom.log_standard_deviation, rel=1e-3)


def test_extreme_estimates_leave_a_distribution():
    for deviation in [0.0, 1e-300, 1e-3, 1e300, 1.7e308, math.inf, math.nan]:
        for extinction in [0.0, 1e-300, 1e-9, 0.3, 5.0, 1e300, math.inf, math.nan, -1.0]:
            fusion = make("grid_filter")
            feed(fusion, [measured(9000.0)] * 20)
            belief = feed(fusion, [Estimate("test", extinction, deviation)] * 20, start=5.0)
            assert np.all(np.isfinite(belief.probability))
            assert np.all(belief.probability >= 0)
            assert belief.probability.sum() == pytest.approx(1.0, abs=1e-12)


def test_any_gap_in_time_leaves_a_distribution():
    for gap in [5e-324, 1e-12, 1e6, 1e300]:
        fusion = make("grid_filter")
        fusion.update([measured(100.0)], 0.0)
        belief = fusion.update([measured(100.0)], gap)
        assert belief.probability.sum() == pytest.approx(1.0, abs=1e-12)


def test_noisy_drive_through_a_bank_keeps_its_ninety_percent_interval():
    rng = np.random.default_rng(5)
    truth = np.r_[np.full(300, 400.0), np.full(300, 100.0), np.full(300, 400.0)]
    fusion, inside, error, bias = make("grid_filter"), [], [], 0.0
    for index, visibility in enumerate(truth):
        # The bias of a road's texture lasts about a second; one estimate in fourteen is anything.
        bias = 0.905 * bias + 0.426 * rng.normal(0.0, 0.1)
        outlier = rng.random() < 0.07
        seen = np.exp(rng.uniform(np.log(20), np.log(2000))) if outlier else visibility * np.exp(bias)
        belief = fusion.update([measured(seen)], 0.1 * index)
        inside.append(belief.visibility_quantile(0.05) < visibility < belief.visibility_quantile(0.95))
        error.append(abs(belief.visibility / visibility - 1))
    assert 0.8 < np.mean(inside) < 0.99
    assert np.median(error) < 0.08


def test_reset_forgets():
    fusion = make("grid_filter")
    first = fusion.update([measured(100.0)], 3.0)
    feed(fusion, [measured(500.0)] * 10, start=4.0)
    fusion.reset()
    assert np.array_equal(fusion.update([measured(100.0)], 3.0).probability, first.probability)


def test_beliefs_are_not_shared():
    fusion = make("grid_filter")
    first = fusion.update([measured(100.0)], 0.0)
    kept = first.probability.copy()
    fusion.update([measured(500.0)], 1.0)
    assert np.array_equal(first.probability, kept)


def test_time_must_be_finite_and_not_go_back():
    fusion = make("grid_filter")
    fusion.update([], 2.0)
    for instant in (math.nan, math.inf, 1.0):
        with pytest.raises(InputError, match="time"):
            fusion.update([], instant)


def test_names_and_parameters_are_checked():
    assert list(FUSIONS) == ["field_filter", "grid_filter", "mixture_filter", "none"]
    with pytest.raises(UnknownNameError, match="grid_filter"):
        make("grid_filtre")
    for name, value in {"drift": 0.0, "leap_rate": -1.0, "outlier_share": 1.0}.items():
        with pytest.raises(InputError, match=name):
            make("grid_filter", **{name: value})


def test_no_fusion_believes_everything_equally_likely_whatever_is_estimated():
    told = make("none").update([Estimate("test", 0.03, 0.001)], 1.0)
    assert told.probability == pytest.approx(1.0 / len(told.probability))
    np.testing.assert_array_equal(told.log_extinction, make("grid_filter").update([], 0.0).log_extinction)


def test_bounds_of_an_estimate_that_is_not_valid_move_the_belief_to_their_side():
    def share_below(visibility, bounds):
        estimate = dataclasses.replace(Estimate.invalid("test", "only a bound"), bounds=bounds)
        belief = make("grid_filter").update([estimate], 0.0)
        return belief.probability[np.exp(belief.log_extinction) > k_of(visibility)].sum()

    assert share_below(200.0, ExtinctionBounds(most=k_of(250.0))) < 0.15
    assert share_below(80.0, ExtinctionBounds(least=k_of(60.0))) > 0.6


def test_a_wrong_bound_does_not_outweigh_good_estimates():
    fusion = make("grid_filter")
    feed(fusion, [measured(300.0)] * 20)
    wrong = dataclasses.replace(
        Estimate.invalid("test", "a sign is missing"), bounds=ExtinctionBounds(least=k_of(30.0))
    )
    assert feed(fusion, [wrong] * 5, start=2.0).visibility == pytest.approx(300.0, rel=0.15)


def test_the_belief_hardly_widens_while_the_vehicle_stands() -> None:
    seen = Estimate("m", 0.03, 0.001, True)

    def spread_after_silence(speed: float) -> float:
        fusion = make("grid_filter")
        assert isinstance(fusion, LocatedFusion)
        for number in range(20):
            fusion.update_at([seen], 0.2 * number, 0.2 * number * 20.0)
        for number in range(20, 70):
            belief = fusion.update_at([], 0.2 * number, 80.0 + 0.2 * (number - 20) * speed)
        low, high = belief.visibility_quantiles((0.05, 0.95))
        return high / low

    standing, slow, driving, faster = (spread_after_silence(speed) for speed in (0.0, 6.0, 15.0, 30.0))
    assert standing < 2.0 < slow < driving
    assert driving == pytest.approx(faster)


def test_a_vague_method_does_not_make_surer_of_what_another_has_wrong_in_common():
    common = dataclasses.replace(measured(100.0, 0.35), common_deviation=0.3)
    belief = feed(make("grid_filter"), [common] * 10)
    fusion = make("grid_filter")
    for number in range(100):
        both = fusion.update([common, measured(100.0, 0.7)], 0.1 * number)
    assert both.log_standard_deviation > 0.7 * belief.log_standard_deviation


CURVE = OpticalDepths((10.0, 100.0), (0.02, 0.2), (0.01, 0.02))


def told(distance):
    denser = None if distance is None else DenserFog(distance, 10.0, 0.05)
    return Estimate("joint_road", 0.002, 1e-4, optical_depths=CURVE, denser=denser)


def announced(distances):
    """Denser fog that the belief has, by distances that images report, ten a second."""
    fusion = make("grid_filter")
    return [fusion.update([told(distance)], 0.1 * i).denser for i, distance in enumerate(distances)]


def test_a_bank_that_comes_nearer_is_announced_within_a_second():
    found = announced([None] * 10 + [200.0 - 3.0 * i for i in range(20)])
    assert found[:12] == [None] * 12
    first = next(i for i, one in enumerate(found) if one is not None)
    assert 14 <= first <= 20
    assert found[-1].distance == pytest.approx(200.0 - 3.0 * 19)


def test_single_pictures_and_distances_that_do_not_fit_together_announce_nothing():
    assert not any(announced([None, None, 150.0, None, None, None, None, 140.0, None, None, None] * 3))
    assert not any(announced([300.0 if i % 2 else 60.0 for i in range(30)]))


def test_an_announcement_ends_when_pictures_no_longer_tell_of_it():
    found = announced([200.0] * 20 + [None] * 20)
    assert found[15] is not None
    assert found[-1] is None


def test_silent_methods_and_such_as_know_no_distances_do_not_count():
    fusion = make("grid_filter")
    for i in range(20):
        plain = Estimate("negru2013", 0.002, 1e-4)
        belief = fusion.update([plain, told(150.0), Estimate.invalid("joint_road", "dark")], 0.1 * i)
    assert belief.denser is not None
    fusion.reset()
    assert fusion.update([told(150.0)], 0.0).denser is None


def test_an_estimate_that_saw_little_of_the_way_says_less():
    near = Estimate("joint_road", 0.01, 1e-4, reach=30.0)
    far = Estimate("joint_road", 0.01, 1e-4, reach=math.inf)
    spread = []
    for one in (near, far):
        low, high = make("grid_filter").update([one], 0.0).visibility_quantiles((0.25, 0.75))
        spread.append(math.log(high / low))
    assert spread[0] > 1.3 * spread[1]
