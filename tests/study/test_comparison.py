import dataclasses

import numpy as np
import pytest

from fogsim.study.comparison import (
    adjust_p_values,
    compare_to_baseline,
    incomplete_metrics,
    moved_denominators,
    numeric_metrics,
    uninformative,
)
from fogsim.study.plan import Study

STUDY = Study("s", {"policy": ("none", "slow"), "fog": ("thin", "thick")}, {"policy": "none"}, 0.95, ())


def table(effect: float, seeds: int = 20) -> list[dict[str, str | float | int | None]]:
    """Runs whose seeds differ much and whose policies differ by the effect, with a little noise."""
    rng = np.random.default_rng(3)
    of_seed, noise = rng.normal(30.0, 5.0, seeds), rng.normal(0.0, 0.5, (2, 2, seeds))
    return [
        {
            "run": 0,
            "policy": policy,
            "fog": fog,
            "seed": seed,
            "status": "complete",
            "message": None,
            "speed_mps": of_seed[seed] + effect * p + noise[p, f, seed],
            "crashes": 0,
            "ending": "time",
        }
        for p, policy in enumerate(STUDY.factors["policy"])
        for f, fog in enumerate(STUDY.factors["fog"])
        for seed in range(seeds)
    ]


def test_a_difference_is_found_seed_by_seed() -> None:
    rows = table(-2.0)
    found = compare_to_baseline(STUDY, rows, ["speed_mps"])
    assert [one.levels for one in found] == [{"policy": "slow", "fog": f} for f in ("thin", "thick")]
    for one in found:
        assert one.pairs == 20
        assert one.difference == pytest.approx(one.mean - one.baseline_mean)
        assert one.low < -2.0 < one.high
        # Between seeds the spread is 5 m/s; paired, the interval is that of the noise, 0.5 √2 / √20 to either side.
        assert one.high - one.low == pytest.approx(2 * 1.96 * 0.5 * np.sqrt(2 / 20), rel=0.4)
        assert one.p_value == pytest.approx(2 / 10_000, abs=1e-4)
        assert one.seeds_for_half_width == 2


def test_intervals_cover_the_truth_as_often_as_they_say() -> None:
    rng = np.random.default_rng(0)
    inside = 0
    for _ in range(100):
        rows = [
            {"policy": policy, "fog": "thin", "seed": seed, "v": rng.normal(1.0 if policy == "slow" else 0.0, 1.0)}
            for policy in ("none", "slow")
            for seed in range(15)
        ]
        (one,) = compare_to_baseline(STUDY, rows, ["v"])
        inside += one.low <= 1.0 <= one.high
    assert 86 <= inside <= 99


def test_where_nothing_differs_nothing_is_claimed() -> None:
    (one, _) = compare_to_baseline(STUDY, table(0.0), ["crashes"])
    assert (one.difference, one.low, one.high, one.p_value) == (0.0, None, None, None)
    assert one.seeds_for_half_width is None


def test_few_seeds_show_nothing_and_one_pair_has_no_test() -> None:
    # Three differences of one sign: the bootstrap excludes 0, the test cannot.
    (three, _) = compare_to_baseline(STUDY, table(-2.0, seeds=3), ["speed_mps"])
    assert three.high < 0.0
    assert three.p_value == pytest.approx(0.25)
    assert not three.is_shown(0.95)
    (many, _) = compare_to_baseline(STUDY, table(-2.0), ["speed_mps"])
    assert many.is_shown(0.95)
    (one, _) = compare_to_baseline(STUDY, table(-2.0, seeds=1), ["speed_mps"])
    assert (one.pairs, one.low, one.p_value, one.seeds_for_half_width) == (1, None, None, None)
    assert not one.is_shown(0.95)
    # The same difference in every run has no interval; the test tells six seeds of it from none, and five not.
    rows = [{**row, "steps": 10 if row["policy"] == "slow" else 7} for row in table(0.0, seeds=6)]
    (same, _) = compare_to_baseline(STUDY, rows, ["steps"])
    assert (same.difference, same.low, same.is_shown(0.95)) == (3.0, None, True)
    (same, _) = compare_to_baseline(STUDY, [row for row in rows if row["seed"] != 5], ["steps"])
    assert not same.is_shown(0.95)


def test_p_values_are_adjusted_to_the_number_of_comparisons() -> None:
    (one, _) = compare_to_baseline(STUDY, table(-2.0), ["speed_mps"])
    family = [dataclasses.replace(one, p_value=p) for p in (0.01, None, 0.04, 0.03)]
    # Benjamini & Hochberg 1995: p · m / rank, made monotonous from the largest on.
    assert [each.adjusted_p_value for each in adjust_p_values(family)] == [
        pytest.approx(0.03),
        None,
        *(pytest.approx(0.04), pytest.approx(0.04)),
    ]


def test_only_seeds_of_which_both_runs_have_a_value_count() -> None:
    rows = [row for row in table(-2.0) if not (row["policy"] == "slow" and int(str(row["seed"])) < 5)]
    rows[0] = {**rows[0], "speed_mps": None}
    assert {one.pairs for one in compare_to_baseline(STUDY, rows, ["speed_mps"])} == {15}
    assert not compare_to_baseline(STUDY, [row for row in rows if row["policy"] == "slow"], ["speed_mps"])


def test_a_ranking_metric_that_loses_pairs_is_not_tested() -> None:
    """A policy without any approach in half of the runs has its best outcomes there, and must not be called worse."""
    of_half = {("none", 0): 4.0, ("none", 1): 1.0, ("slow", 0): 3.5, ("slow", 1): None}
    rows = [
        {**row, "minimum_time_to_collision_s": of_half[str(row["policy"]), int(str(row["seed"])) % 2]}
        for row in table(-2.0)
    ]
    (one, _) = compare_to_baseline(STUDY, rows, ["minimum_time_to_collision_s"])
    assert (one.difference, one.low, one.p_value, one.seeds_for_half_width) == (-0.5, None, None, None)
    assert one.untested == "10 of 20 pairs lack a value"
    assert not one.is_shown(0.95)
    assert incomplete_metrics(STUDY, rows, ["minimum_time_to_collision_s"]) == {"minimum_time_to_collision_s"}
    # Without an approach in both runs, a pair is a tie.
    both = [row for row in rows if row["minimum_time_to_collision_s"] != 1.0]
    assert compare_to_baseline(STUDY, both, ["minimum_time_to_collision_s"])[0].p_value is not None
    assert not incomplete_metrics(STUDY, both, ["minimum_time_to_collision_s"])


def test_metrics_that_say_nothing_are_called_so() -> None:
    rows = table(-2.0)
    for number, row in enumerate(rows):
        row["gap_m"] = 2.5 if number % 20 else 3.0
    assert numeric_metrics(rows, STUDY.factors) == ["speed_mps", "crashes", "gap_m"]
    said = uninformative(rows, ["speed_mps", "crashes", "gap_m"])
    assert said == {"crashes": "does not vary", "gap_m": "saturated: 95% of the runs have the least value, 2.5"}


def test_a_denominator_that_a_policy_moves_and_an_unfinished_cohort_are_named() -> None:
    """Vehicle-km fall by 4 % (not named), vehicle-km in fog by 20 %; 10 % of the cohort have not left."""
    keys = "traffic_vehicle_distance_m", "traffic_vehicle_distance_in_fog_m", "traffic_cohort_unfinished"
    slow = {("slow", "thick"): (96_000.0, 8000.0, 5)}
    rows = [
        {**row, **dict(zip(keys, slow.get((row["policy"], row["fog"]), (100_000.0, 10_000.0, 0)), strict=True))}
        | {"traffic_cohort_vehicles": 50}
        for row in table(0.0)
    ]
    fog, cohort = moved_denominators(STUDY, rows)
    assert fog.startswith("Vehicle-km in fog: 8 veh·km with slow · thick, 10 veh·km under the baseline (−20 %).")
    assert cohort.startswith("Cohort: 10 % of its vehicles have not left when the run ends with slow · thick")
    assert moved_denominators(STUDY, table(0.0)) == []
