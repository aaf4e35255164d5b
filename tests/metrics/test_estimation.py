"""Errors of estimators and belief: figures by hand."""

import dataclasses
import math

import numpy as np
import pytest

from fogsim.metrics import JsonValue
from fogsim.units import extinction_from_visibility
from fogsim.values import Estimate, FogProfile, Step
from tests.metrics.summaries import summarise
from tests.recorders.synthetic import belief, estimate, make_step


def method_errors(summary: dict[str, JsonValue], method: str) -> dict[str, JsonValue]:
    return summary["estimators"][method]


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


def test_bias_is_of_the_ratio_and_coverage_of_the_interval_of_k() -> None:
    """Deviations are 10 %: 1.645 of them reach from 110 m to 110 / 1.1645 … 110 / 0.8355 m, and hold 100 m."""
    said = (110.0, 110.0, 130.0, 90.0, 130.0)
    errors = method_errors(
        summarise(make_step(i, time=float(i), estimates=(estimate("m", v),)) for i, v in enumerate(said)), "m"
    )
    assert errors["bias_percent"] == pytest.approx(10.0)
    assert errors["coverage_share"] == pytest.approx(3 / 5)
    assert errors["latency_s"] is None


@pytest.mark.parametrize("lag", [0.0, 1.5, 6.0])
def test_latency_is_the_lag_of_what_follows_the_fog(lag: float) -> None:
    """Into a bank at 40 s and out of it at 70 s, at 2 Hz; the belief some seconds late, and 10 % off throughout."""

    def visibility(time: float) -> float:
        return 500.0 - 400.0 * (1 / (1 + math.exp(40.0 - time)) - 1 / (1 + math.exp(70.0 - time)))

    times = [0.5 * i for i in range(240)]
    steps = (
        make_step(i, time=t, visibility=visibility(t), believed=belief(1.1 * visibility(t - lag), 0.02))
        for i, t in enumerate(times)
    )
    summary = summarise(steps)
    assert summary["belief_latency_s"] == lag
    if not lag:
        assert summary["belief_bias_percent"] == pytest.approx(10.0, abs=1.0)


def knowing_places(index: int, believed: float, true: float, until: float = 400.0) -> Step:
    """A step that believes in one visibility everywhere, and in which another is true."""
    places = np.array([-100.0, until])
    logs = np.log([extinction_from_visibility(visibility) for visibility in (believed, true)])
    step = make_step(index, time=float(index))
    profiles = [
        FogProfile(places, np.full(2, log), np.full(2, deviation))
        for log, deviation in zip(logs, (0.1, 0.0), strict=True)
    ]
    return dataclasses.replace(
        step,
        belief=dataclasses.replace(step.belief, profile=profiles[0]),
        truth=dataclasses.replace(step.truth, profile=profiles[1]),
    )


def test_the_belief_about_places_ahead_is_judged_where_there_is_fog() -> None:
    steps = [knowing_places(0, 110.0, 100.0), knowing_places(1, 150.0, 100.0), knowing_places(2, 150.0, 5000.0)]
    summary = summarise(steps)
    for distance in (100, 200):
        assert summary[f"belief_{distance}_m_ahead_median_error_percent"] == pytest.approx(10.0)
        assert summary[f"belief_{distance}_m_ahead_coverage_share"] == pytest.approx(0.5)
    near = summarise([knowing_places(0, 110.0, 100.0, until=150.0)])
    assert near["belief_100_m_ahead_coverage_share"] == 1.0
    assert near["belief_200_m_ahead_coverage_share"] is None
    assert summarise([make_step()])["belief_100_m_ahead_median_error_percent"] is None
