"""Metrics that rank policies have denominators that a policy cannot move: slower in fog is never reported as worse."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from fogsim.metrics import METRICS, TrafficRunMetrics, metric_definitions
from fogsim.metrics.safety import DEFAULT_STANDARD
from fogsim.study.main_metrics import DELAY_METRICS, MAIN_METRICS, SAFETY_METRICS, metric_words
from fogsim.units import extinction_from_visibility
from fogsim.values import Cohort
from tests.metrics.roads import lanes
from tests.recorders.synthetic import make_traffic_step

BANK = 100.0, 300.0
"""Where the fog bank lies on the road of 400 m [m]."""
LENGTH = 400.0


def drive(free: NDArray[np.float64], in_fog: NDArray[np.float64], visibility: float) -> dict[str, float | None]:
    """Metrics of vehicles in lanes of their own that drive the whole road at one speed in clear air and one in fog."""
    metrics, step = TrafficRunMetrics(), 0.05
    ids = tuple(f"v{i}" for i in range(len(free)))
    place, number = np.zeros(len(free)), 0
    while (place < LENGTH).any() or not number:
        foggy = (place >= BANK[0]) & (place < BANK[1])
        speed, on_road = np.where(foggy, in_fog, free), place < LENGTH
        state = lanes(*((str(i), place[i], speed[i]) for i in np.flatnonzero(on_road)))
        names = tuple(name for name, here in zip(ids, on_road, strict=True) if here)
        state = dataclasses.replace(state, ids=names, free_speed=free[on_road])
        base = make_traffic_step(number)
        fog = np.where(foggy, extinction_from_visibility(visibility), 0.0)[on_road]
        truth = dataclasses.replace(base.truth, vehicle_extinctions=fog)
        cohort = Cohort(frozenset(ids), 0, int(on_road.sum()))
        metrics.update(
            dataclasses.replace(base, time=step * number, traffic=state, truth=truth, cohort=cohort, ending=None)
        )
        place, number = place + step * speed, number + 1
    return {key: value for key, value in metrics.summary().to_json().items() if isinstance(value, int | float)}


def test_every_key_is_defined_in_sentences_and_no_ranking_metric_has_a_denominator_that_a_policy_moves() -> None:
    found = metric_definitions()
    made = {key for make in METRICS.values() for key in make(DEFAULT_STANDARD).result()}
    assert set(found) == {"ending", *made}
    for key, one in found.items():
        assert one.meaning.endswith("."), key
        assert one.better is None or not one.denominator_moves, key
        assert one.numerator or one.denominator == "one run", key
        if "time_share" in key or key.endswith("_s_per_vehicle_km"):
            assert one.better is None, key
    denominators = {one.denominator: one.denominator_moves for one in found.values()}
    assert all(denominators[one.denominator] == one.denominator_moves for one in found.values())


def test_reports_show_defined_metrics_and_judge_by_ranking_ones() -> None:
    assert {*MAIN_METRICS, *DELAY_METRICS} <= set(metric_definitions())
    assert [metric_words(key).better for key in RANKING_SIGHT] == ["lower", "higher"]
    assert all(metric_words(name).better for group in SAFETY_METRICS for name in group)
    shares = [name for name in MAIN_METRICS if "time_share" in name]
    assert not shares


RANKING_SIGHT = ("traffic_overdriven_m_per_vehicle_km_in_fog", "traffic_sight_margin_by_distance_m")


@settings(max_examples=8, deadline=None)
@given(
    free=st.lists(st.sampled_from((20.0, 25.0, 32.0, 40.0)), min_size=1, max_size=4),
    shares=st.lists(st.sampled_from((0.5, 0.8, 1.0)), min_size=4, max_size=4),
    slower=st.sampled_from((0.5, 0.8)),
    visibility=st.sampled_from((40.0, 80.0, 150.0)),
)
def test_driving_slower_in_fog_never_makes_a_ranking_safety_metric_worse(
    free: list[float], shares: list[float], slower: float, visibility: float
) -> None:
    """Up to the step of at most 2 m at either end of 200 m of fog, by which sampling moves the distance in fog."""
    speeds = np.array(free)
    in_fog = speeds * shares[: len(speeds)]
    fast, slow = drive(speeds, in_fog, visibility), drive(speeds, slower * in_fog, visibility)
    sampling = 1000.0 * 2.0 * 2.0 / (BANK[1] - BANK[0])
    cost = {"traffic_travel_time_s_per_cohort_vehicle", "traffic_delay_s_per_cohort_vehicle"}
    for key, one in metric_definitions().items():
        if one.better is not None and key in fast and key not in cost:
            worse = (slow[key] - fast[key]) * (1.0 if one.better == "lower" else -1.0)
            assert worse <= (sampling if key in RANKING_SIGHT else 0.0), key
    assert set(RANKING_SIGHT) <= set(fast)
    assert slow["traffic_cohort_vehicles"] == fast["traffic_cohort_vehicles"] == len(speeds)
    assert slow["traffic_vehicle_distance_in_fog_m"] == pytest.approx(
        fast["traffic_vehicle_distance_in_fog_m"], rel=0.02
    )
