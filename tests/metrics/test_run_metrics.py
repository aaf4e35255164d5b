import dataclasses
import json
import math
from collections.abc import Iterable

import pytest

import fogsim
from fogsim.errors import SimulationError, UnknownNameError
from fogsim.metrics import METRICS, JsonValue, RunMetrics, RunSummary, SafetyStandard
from fogsim.scenario import build
from fogsim.units import extinction_from_visibility
from fogsim.values import Collision, Ending, Estimate, Leader, Step
from tests.recorders.synthetic import belief, drive, estimate, make_step


def summarise(steps: Iterable[Step], **standard: float) -> dict[str, JsonValue]:
    metrics = RunMetrics(SafetyStandard(**standard))
    for step in steps:
        metrics.update(step)
    return metrics.summary().to_json()


def method_errors(summary: dict[str, JsonValue], method: str) -> dict[str, JsonValue]:
    estimators = summary["estimators"]
    assert isinstance(estimators, dict)
    return dict(estimators[method])


def test_every_key_has_a_meaning_and_every_value_is_json() -> None:
    metrics = RunMetrics()
    for step in drive(60):
        metrics.update(step)
    summary = metrics.summary()
    assert set(summary.values) == set(summary.meanings)
    assert json.loads(json.dumps(summary.to_json(), allow_nan=False)) == summary.to_json()


@pytest.mark.parametrize(
    ("value", "written"),
    [
        (123456.78949, 123456.789),
        (0.30000000000000004, 0.3),
        (1.0 / 3.0, 0.333333333),
        (12345678949.0, 12345678900.0),
        (0.00012345678949, 0.000123457),
        (-2.5, -2.5),
        (7, 7),
        (1234567891234, 1234567891234),
        (True, True),
        (None, None),
        ("arrived", "arrived"),
    ],
)
def test_numbers_are_written_to_nine_digits(value: JsonValue, written: JsonValue) -> None:
    """Also in the mappings of methods; integers and what is no number stay as they are."""
    told = RunSummary({"outer": value, "methods": {"one": {"inner": value}}}, {}).to_json()
    assert told == {"outer": written, "methods": {"one": {"inner": written}}}
    assert type(told["outer"]) is type(value)


@pytest.mark.parametrize("value", [-0.0, -1e-17, 4e-10])
def test_what_is_nothing_has_no_sign(value: float) -> None:
    assert str(RunSummary({"key": value}, {}).to_json()["key"]) == "0.0"


def test_the_last_bits_of_a_number_are_not_written() -> None:
    """What processors disagree about: here both sides of a value in the last place."""
    value = 36.98765432181
    nearby = (value, math.nextafter(value, 0.0), math.nextafter(value, math.inf))
    assert {json.dumps(RunSummary({"key": one}, {}).to_json()) for one in nearby} == {'{"key": 36.9876543}'}


def test_a_run_without_steps_has_only_undefined_values_and_counts() -> None:
    for key, value in RunMetrics().summary().values.items():
        assert value in (None, 0, {}), key


def test_the_summary_names_what_sight_was_judged_by() -> None:
    """And judges by it: 20 m/s need 60 m at 1 s and 5 m/s², of 50 m that are seen."""
    summary = summarise([make_step(0, speed=20.0, visibility_ahead=50.0)], reaction_time=1.0, deceleration=5.0)
    assert (summary["stopping_reaction_time_s"], summary["stopping_deceleration_mps2"]) == (1.0, 5.0)
    assert summary["minimum_visibility_margin_m"] == pytest.approx(-10.0)


@pytest.mark.parametrize(
    ("advice", "reaction_time", "deceleration"),
    [
        ("{method: stopping_sight_distance, parameters: {reaction_time: 1.5, deceleration: 4.5}}", 1.5, 4.5),
        ("stopping_sight_distance", 2.5, 3.4),
        ("none", 2.5, 3.4),
    ],
)
def test_a_run_is_judged_by_what_its_advice_counts_with(advice: str, reaction_time: float, deceleration: float) -> None:
    standard = build.safety_standard(fogsim.load_scenario("motorway_fog_bank", [f"advice={advice}"]))
    assert (standard.reaction_time, standard.deceleration) == (reaction_time, deceleration)


def test_distance_and_speed_with_uneven_steps() -> None:
    steps = [
        make_step(0, time=1.0, speed=10.0, route_position=100.0),
        make_step(1, time=1.5, speed=20.0, route_position=110.0),
        make_step(2, time=3.0, speed=12.0, route_position=130.0, ending=Ending.ARRIVED),
    ]
    summary = summarise(steps)
    assert summary["duration_s"] == pytest.approx(2.0)
    assert summary["distance_m"] == pytest.approx(30.0)
    assert summary["mean_speed_mps"] == pytest.approx(15.0)
    assert summary["max_speed_mps"] == 20.0
    assert summary["ending"] == "arrived"
    assert summary["steps"] == 3


def test_times_add_up_without_noise() -> None:
    steps = [make_step(i, time=i / 10, speed=25.0, leader=Leader("other", 5.0, 20.0)) for i in range(39)]
    summary = summarise(steps, time_to_collision=4.0)
    assert summary["duration_s"] == 3.8
    assert summary["time_exposed_time_to_collision_s"] == 3.8


def test_conflicts_are_weighted_with_the_time_between_steps() -> None:
    approach = [(20.0, 4.0), (10.0, 2.0), (5.0, 1.0)]
    steps = [
        make_step(i, time=0.5 * i, speed=25.0, leader=Leader("other", gap, 20.0)) for i, (gap, _) in enumerate(approach)
    ]
    summary = summarise([*steps, make_step(3, time=1.5)])
    assert summary["minimum_time_to_collision_s"] == pytest.approx(1.0)
    assert summary["time_exposed_time_to_collision_s"] == pytest.approx(1.0)
    assert summary["time_integrated_time_to_collision_s2"] == pytest.approx(0.5 * (1.0 + 2.0))
    assert summary["max_drac_mps2"] == pytest.approx(0.5 * 25.0 / 5.0)
    assert summary["minimum_gap_m"] == 5.0
    assert summary["minimum_time_headway_s"] == pytest.approx(0.2)
    assert summarise(steps, time_to_collision=1.5)["time_exposed_time_to_collision_s"] == pytest.approx(0.5)


def test_share_of_time_in_which_the_ego_could_not_stop_in_sight() -> None:
    steps = [
        make_step(i, time=float(i), speed=20.0, visibility=v) for i, v in enumerate((300.0, 300.0, 50.0, math.inf))
    ]
    summary = summarise(steps)
    assert summary["negative_margin_time_share"] == pytest.approx(1 / 3)
    assert summary["minimum_visibility_m"] == pytest.approx(50.0)
    assert summary["minimum_visibility_margin_m"] == pytest.approx(50.0 - (50.0 + 400 / 6.8))


def test_collisions_of_the_ego_and_of_others() -> None:
    hits = (Collision(0.0, "a", "b", 12.0), Collision(0.0, "ego", "other", 5.0))
    summary = summarise([make_step(0, collisions=hits[:1]), make_step(1, time=1.0, collisions=hits[1:])])
    assert (summary["collisions"], summary["ego_collisions"]) == (2, 1)
    assert (summary["max_impact_speed_mps"], summary["ego_max_impact_speed_mps"]) == (12.0, 5.0)


def test_a_step_that_comes_once_more_adds_only_its_ending() -> None:
    step = make_step(0, time=1.0, collisions=(Collision(1.0, "a", "b", 3.0),))
    summary = summarise([step, dataclasses.replace(step, ending=Ending.LEFT_NETWORK)])
    assert summary["collisions"] == 1
    assert summary["steps"] == 1
    assert summary["ending"] == "left the network"


def test_braking_and_jerk() -> None:
    accelerations = (0.0, -2.0, -2.0, 0.5)
    summary = summarise(make_step(i, time=0.5 * i, acceleration=a) for i, a in enumerate(accelerations))
    assert summary["max_deceleration_mps2"] == 2.0
    assert summary["rms_jerk_mps3"] == pytest.approx(math.sqrt((4.0**2 + 0.0 + 5.0**2) / 3))


def test_speed_above_the_advice_counts_only_while_there_is_one() -> None:
    advised = (math.inf, math.inf, 20.0, 25.0, 24.9)
    summary = summarise(make_step(i, time=float(i), speed=25.0, advised=a) for i, a in enumerate(advised))
    assert summary["advised_time_share"] == pytest.approx(3 / 4)
    assert summary["mean_advised_speed_mps"] == pytest.approx((20.0 + 25.0 + 24.9) / 3)
    assert summary["above_advice_time_share"] == pytest.approx(1 / 4)
    strict = summarise((make_step(i, time=float(i), advised=a) for i, a in enumerate(advised)), advice_tolerance=0.0)
    assert strict["above_advice_time_share"] == pytest.approx(2 / 4)


def test_estimator_error_is_against_the_visibility_ahead_and_only_in_fog() -> None:
    steps = [
        make_step(0, time=0.0, visibility=500.0, visibility_ahead=100.0, estimates=(estimate("m", 110.0),)),
        make_step(1, time=1.0, visibility_ahead=200.0, estimates=(estimate("m", 150.0),)),
        make_step(2, time=2.0, visibility_ahead=200.0, estimates=(Estimate.invalid("m", "no road"),)),
        make_step(3, time=3.0, visibility=2000.0, estimates=(estimate("m", 100.0),)),
    ]
    errors = method_errors(summarise(steps), "m")
    assert errors["count"] == 3
    assert errors["valid_share"] == pytest.approx(2 / 3)
    assert errors["median_error_percent"] == pytest.approx(10.0)
    assert errors["p95_error_percent"] == pytest.approx(25.0)


def test_an_estimate_of_clear_air_in_fog_is_an_error_without_limit_and_shows() -> None:
    clear = Estimate("m", 0.0, 0.001)
    estimates = (estimate("m", 110.0), estimate("m", 90.0), clear)
    errors = method_errors(summarise(make_step(i, time=float(i), estimates=(e,)) for i, e in enumerate(estimates)), "m")
    assert errors["median_error_percent"] == pytest.approx(10.0)
    assert errors["p95_error_percent"] is None
    assert errors["clear_air_share"] == pytest.approx(1 / 3)


def test_belief_error_and_coverage() -> None:
    beliefs = [belief(100.0, 0.1), belief(105.0, 0.1), belief(150.0, 0.1), belief(150.0, 0.5)]
    summary = summarise(make_step(i, time=float(i), believed=b) for i, b in enumerate(beliefs))
    assert summary["belief_count"] == 4
    assert summary["belief_median_error_percent"] == pytest.approx(5.0, abs=0.5)
    assert summary["belief_p95_error_percent"] == pytest.approx(50.0, abs=0.5)
    assert summary["belief_coverage_share"] == pytest.approx(3 / 4)


def test_clear_air_is_no_fog_to_be_right_about() -> None:
    summary = summarise([make_step(visibility=math.inf, believed=belief(100.0), estimates=(estimate("m", 100.0),))])
    assert extinction_from_visibility(math.inf) == 0.0
    assert summary["belief_count"] == 0
    assert summary["belief_coverage_share"] is None
    assert method_errors(summary, "m")["median_error_percent"] is None


def test_steps_out_of_order_are_refused() -> None:
    metrics = RunMetrics()
    metrics.update(make_step(0, time=1.0))
    with pytest.raises(SimulationError, match="follow in time"):
        metrics.update(make_step(1, time=1.0))


def test_metrics_can_be_chosen_by_name() -> None:
    assert set(RunMetrics(names=["comfort"]).summary().values) == {"ending", "max_deceleration_mps2", "rms_jerk_mps3"}
    with pytest.raises(UnknownNameError, match="did you mean 'comfort'"):
        RunMetrics(names=["comfrot"])
    assert "estimators" in METRICS
