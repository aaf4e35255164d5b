import dataclasses
import json

import pytest

from fogsim.errors import SimulationError, UnknownNameError
from fogsim.metrics import METRICS, RunMetrics, RunSummary
from fogsim.values import Collision, Ending
from tests.metrics.summaries import summarise
from tests.recorders.synthetic import drive, make_step


def test_every_key_has_a_meaning_and_every_value_is_json() -> None:
    metrics = RunMetrics()
    for step in drive(60):
        metrics.update(step)
    summary = metrics.summary()
    assert set(summary.values) == set(summary.meanings)
    assert json.loads(json.dumps(summary.to_json(), allow_nan=False)) == summary.to_json()


def test_numbers_are_written_to_nine_digits() -> None:
    """Also in the mappings of methods; integers and what is no number stay as they are."""
    for value, written in [
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
    ]:
        told = RunSummary({"outer": value, "methods": {"one": {"inner": value}}}, {}).to_json()
        assert told == {"outer": written, "methods": {"one": {"inner": written}}}
        assert type(told["outer"]) is type(value)


def test_what_is_nothing_has_no_sign() -> None:
    for value in [-0.0, -1e-17, 4e-10]:
        assert str(RunSummary({"key": value}, {}).to_json()["key"]) == "0.0"


def test_a_run_without_steps_has_only_undefined_values_and_counts() -> None:
    for key, value in RunMetrics().summary().values.items():
        assert value in (None, 0, {}), key


def test_the_summary_names_what_sight_was_judged_by() -> None:
    """And judges by it: 20 m/s need 60 m at 1 s and 5 m/s², of 50 m that are seen."""
    summary = summarise([make_step(0, speed=20.0, visibility_ahead=50.0)], reaction_time=1.0, deceleration=5.0)
    assert (summary["stopping_reaction_time_s"], summary["stopping_deceleration_mps2"]) == (1.0, 5.0)
    assert summary["minimum_visibility_margin_m"] == pytest.approx(-10.0)


def test_a_step_that_comes_once_more_adds_only_its_ending() -> None:
    step = make_step(0, time=1.0, collisions=(Collision(1.0, "a", "b", 3.0),))
    # As `ClosedLoop.advance` makes it.
    summary = summarise([step, dataclasses.replace(step, index=1, time=1.5, ending=Ending.LEFT_NETWORK)])
    assert (summary["collisions"], summary["duration_s"], summary["traffic_vehicle_time_s"]) == (1, 0.0, 0.0)
    assert summary["steps"] == 1
    assert summary["ending"] == "left the network"


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
