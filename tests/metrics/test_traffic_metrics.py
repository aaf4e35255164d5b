"""Metrics of everybody near the ego: figures by hand."""

import dataclasses
import math

import numpy as np
import pytest

from fogsim.metrics.crossing import TrafficEncroachment
from fogsim.metrics.metric import Histogram
from fogsim.metrics.surrogate import crash_potential
from fogsim.metrics.traffic_comfort import TrafficComfort, TrafficCompliance, TrafficSight
from fogsim.metrics.traffic_conflicts import TrafficCollisions, TrafficConflicts, TrafficHeadways
from fogsim.metrics.traffic_flow import TrafficEmissions, TrafficFlow
from fogsim.metrics.traffic_span import TrafficCohort
from fogsim.metrics.traffic_throughput import TrafficThroughput
from fogsim.units import extinction_from_visibility
from fogsim.values import Cohort, Collision
from tests.metrics.roads import lanes, watched

ROAD = lanes(("a_0", 0, 30), ("a_0", 25, 20), ("b_0", 0, 20), ("b_0", 44, 0), ("c_0", 0, 20), ("c_0", 20, 20))
"""v0 is 2 s from a moving leader, v2 from a standing one; v4 follows at 0.75 s and comes no nearer."""


def test_conflicts_include_standing_leaders_and_are_split_by_leader() -> None:
    found = watched(TrafficConflicts(threshold=3.0), [(0.0, ROAD), (0.5, ROAD), (1.5, ROAD)])
    hours, kilometres = 12.0 / 3600.0, 0.220
    # TTC of v0 is 20 / 10 = 2 s, of v2 39 / 20 = 1.95 s, each for 2 s of 12 s of all vehicles.
    missing = 2.0 * (3.0 - 2.0) + 2.0 * (3.0 - 1.95)
    assert found["traffic_exposed_time_share"] == pytest.approx(2 / 6)
    assert found["traffic_exposed_time_s_per_vehicle_km"] == pytest.approx(4.0 / kilometres)
    assert found["traffic_integrated_time_to_collision_s2_per_h"] == pytest.approx(missing / hours)
    assert found["traffic_integrated_time_to_collision_s2_per_vehicle_km"] == pytest.approx(missing / kilometres)
    assert found["traffic_minimum_time_to_collision_s"] == pytest.approx(1.95)
    # DRAC of v0 is 10² / 2 · 20, MDRAC 10 / 2 (2 − 1); of v2 20² / 2 · 39 = 5.1.
    assert found["traffic_max_drac_mps2"] == pytest.approx(400.0 / 78.0)
    assert found["traffic_serious_conflict_time_share"] == pytest.approx(1 / 6)
    assert found["traffic_serious_mdrac_time_share"] == pytest.approx(2 / 6)
    assert found["traffic_mean_approach_mps"] == pytest.approx((10 + 20 + 0) / 3)
    assert found["traffic_conflicts_per_vehicle_h"] == pytest.approx(2 / hours)
    assert found["traffic_conflicts_per_vehicle_km"] == pytest.approx(2 / kilometres)
    assert found["traffic_crash_potential_index"] == pytest.approx(float(crash_potential(400.0 / 78.0)) / 6)
    for name, ttc, drac in (("moving", 2.0, 2.5), ("queue", 1.95, 400.0 / 78.0)):
        assert found[f"traffic_{name}_conflicts_per_vehicle_km"] == pytest.approx(1 / kilometres)
        assert found[f"traffic_{name}_exposed_time_share"] == pytest.approx(1 / 6)
        assert found[f"traffic_{name}_serious_conflict_time_share"] == pytest.approx((drac > 3.4) / 6)
        assert found[f"traffic_minimum_{name}_time_to_collision_s"] == pytest.approx(ttc)
        assert found[f"traffic_max_{name}_drac_mps2"] == pytest.approx(drac)
    # DSS by hand: 20 + (20² − 30²) / 12.86 − 30, 39 − 20² / 12.86 − 20, 15 − 20.
    lacking = (10.0 + 500.0 / 12.86, 400.0 / 12.86 - 19.0, 5.0)
    assert found["traffic_negative_dss_time_share"] == pytest.approx(3 / 6)
    assert found["traffic_time_integrated_dss_m_s_per_vehicle_km"] == pytest.approx(2.0 * sum(lacking) / kilometres)
    # v0 would hit at 10 + 6.43 after 1 s, when 20 m less 13.2 are left, and after 0.4 s more; v2 with 19 m left, and
    # v4 at 6.43 since its gap of 15 m is used up while both brake.
    impacts = (16.43, math.sqrt(20.0**2 - 2 * 6.43 * 19.0), 6.43)
    assert found["traffic_mean_potential_collision_speed_mps"] == pytest.approx(np.mean(impacts))
    assert found["traffic_potential_collision_time_share"] == 1.0


def test_who_closes_up_slowly_to_a_queue_is_in_no_conflict() -> None:
    found = watched(TrafficConflicts(threshold=3.0), [(1.0, lanes(("a", 0, 4), ("a", 8, 0)))])
    assert found["traffic_exposed_time_share"] == 0.0
    assert found["traffic_minimum_time_to_collision_s"] is None


def test_a_conflict_that_ends_and_comes_again_is_two() -> None:
    near, far = lanes(("a", 0, 30), ("a", 25, 20)), lanes(("a", 0, 30), ("a", 90, 20))
    found = watched(TrafficConflicts(threshold=3.0), [(0.0, near), (1.0, near), (1.0, far), (1.0, near)])
    assert found["traffic_conflicts_per_vehicle_km"] == pytest.approx(2 / 0.150)


def test_headways_of_those_who_move() -> None:
    road = lanes(("a", 0, 20), ("a", 20, 20), ("a", 55, 20), ("a", 110, 20), ("b", 0, 4), ("b", 6, 4))
    found = watched(TrafficHeadways(), [(1.0, road)])
    # Gaps of 15, 30 and 50 m at 20 m/s: 0.75, 1.5, 2.5 s.
    assert [found[f"traffic_headway_below_{s}_s_share"] for s in (1, 2, 3)] == pytest.approx([1 / 3, 2 / 3, 1.0])
    assert found["traffic_median_headway_s"] == pytest.approx(1.5, abs=0.05)


def test_speeds_within_and_between_vehicles_and_lanes() -> None:
    roads = [lanes(("a_0", 0, 10), ("a_1", 0, 30)), lanes(("a_0", 0, 20), ("a_1", 0, 32))]
    found = watched(TrafficFlow(), [(1.0, road) for road in roads])
    total, between = np.var([10, 20, 30, 32]), np.var([15, 31])
    assert found["traffic_vehicle_time_s"] == 4.0
    assert found["traffic_vehicle_distance_m"] == 92.0
    assert found["traffic_mean_vehicles"] == 2.0
    assert found["traffic_vehicle_km_per_h"] == pytest.approx(0.092 * 1800)
    assert found["traffic_mean_speed_mps"] == 23.0
    assert found["traffic_speed_standard_deviation_mps"] == pytest.approx(np.sqrt(total))
    assert found["traffic_speed_standard_deviation_between_vehicles_mps"] == pytest.approx(np.sqrt(between))
    within = np.sqrt((5.0**2 + 1.0**2) / 2)
    assert found["traffic_speed_standard_deviation_within_vehicles_mps"] == pytest.approx(within)
    assert found["traffic_speed_standard_deviation_between_lanes_mps"] == pytest.approx(np.sqrt(between))
    assert found["traffic_delay_s_per_vehicle_km"] is None


def test_lanes_of_different_roads_are_not_compared() -> None:
    found = watched(TrafficFlow(), [(1.0, lanes(("a_0", 0, 10), ("b_0", 0, 30), ("b_1", 0, 34)))])
    assert found["traffic_speed_standard_deviation_between_lanes_mps"] == pytest.approx(np.sqrt((2**2 + 2**2) / 3))


def test_delay_against_free_travel() -> None:
    road = dataclasses.replace(lanes(("a", 0, 20), ("a", 50, 30)), free_speed=np.array([40.0, 30.0]))
    found = watched(TrafficFlow(), [(2.0, road)])
    assert found["traffic_delay_share"] == pytest.approx(0.25)
    assert found["traffic_delay_s_per_vehicle_km"] == pytest.approx(1.0 / 0.100)


def test_many_vehicles_of_a_run_are_kept_apart() -> None:
    speeds = np.linspace(10.0, 30.0, 150)
    found = watched(TrafficFlow(), [(1.0, lanes(*(("a", 10.0 * i, v) for i, v in enumerate(speeds))))])
    assert found["traffic_speed_standard_deviation_between_vehicles_mps"] == pytest.approx(np.std(speeds))


def test_overdriving_the_visibility_and_the_margin() -> None:
    """20 m/s need 20 · 2.5 + 400 / 6.8 = 108.8 m; of 100 m, one hits what stands there at √(400 − 12.86 · 80)."""
    extinctions = np.array([extinction_from_visibility(v) for v in (100.0, 200.0, 2000.0, math.inf, 15.0)])
    road = lanes(*((str(i), 0, 20) for i in range(5)))
    found = watched(TrafficSight(2.5, 3.4), [(2.0, road)], extinctions)
    assert found["traffic_fog_time_share"] == pytest.approx(3 / 5)
    assert found["traffic_overdriving_time_share"] == pytest.approx(2 / 5)
    stopping = 50.0 + 400.0 / 6.8
    assert found["traffic_mean_sight_margin_m"] == pytest.approx(105.0 - stopping)
    assert found["traffic_overdriven_m_per_vehicle_km_in_fog"] == pytest.approx(2000 / 3)
    assert found["traffic_sight_margin_by_distance_m"] == pytest.approx(105.0 - stopping)
    assert found["traffic_vehicle_distance_in_fog_m"] == pytest.approx(120.0)
    assert found["traffic_sight_margin_p05_m"] == pytest.approx(15.0 - stopping, abs=0.5)
    # From 100 m and 200 m it stops, after 20 m of reaction and 31.1 m of braking; 15 m are over before it reacts.
    assert found["traffic_mean_obstacle_impact_speed_mps"] == pytest.approx(20.0 / 3)


def test_jerk_and_hard_braking_of_those_who_stay() -> None:
    def braking(ids: tuple[str, ...], *acceleration: float):  # type: ignore[no-untyped-def]
        road = lanes(*(("a", 20.0 * i, 20.0) for i in range(len(ids))))
        return dataclasses.replace(road, ids=ids, acceleration=np.array(acceleration))

    roads = [braking(("a", "b"), 0.0, 1.0), braking(("a", "b"), -4.0, 1.0), braking(("c", "b"), 0.0, -1.0)]
    found = watched(TrafficComfort(), [(0.5, road) for road in roads])
    # The first step follows nothing; then a and b, then b alone.
    assert found["traffic_rms_jerk_mps3"] == pytest.approx(math.sqrt((8.0**2 + 0.0 + 4.0**2) / 3))
    assert found["traffic_hard_braking_time_share"] == pytest.approx(1 / 6)


def test_compliance_of_those_who_have_heard_advice() -> None:
    road = lanes(("a", 0, 20), ("a", 50, 20.9), ("a", 90, 21.1), ("a", 130, 30))
    advised = dataclasses.replace(road, advised_speed=np.array([25.0, 20.0, 20.0, np.inf]))
    found = watched(TrafficCompliance(tolerance=1.0), [(0.0, road), (2.0, road), (2.0, advised), (1.0, advised)])
    assert found["traffic_advised_time_share"] == pytest.approx(9.0 / 20.0)
    assert found["traffic_advice_compliance_share"] == pytest.approx(2.0 / 3.0)
    unadvised = watched(TrafficCompliance(tolerance=1.0), [(0.0, road), (2.0, road)])
    assert unadvised == {"traffic_advised_time_share": 0.0, "traffic_advice_compliance_share": None}


def test_emissions_of_a_car_that_keeps_its_speed_coasts_and_stands() -> None:
    """SUMO's HBEFA 4 petrol Euro 4 car at 20 m/s: 1521 + 15.59 · 20 + 0.1199 · 20³ mg of CO2 a second."""
    road = lanes(("a", 0, 20), ("b", 0, 20), ("c", 0, 0))
    found = watched(TrafficEmissions(), [(1.0, dataclasses.replace(road, acceleration=np.array([0.0, -0.5, 0.0])))])
    assert found["traffic_co2_g_per_vehicle_km"] == pytest.approx((2.792 + 0.0 + 1.521) / 0.040)
    assert found["traffic_nox_mg_per_vehicle_km"] == pytest.approx((0.6117 + 5.485e-05 * 8000 + 0.6117) / 0.040)
    assert found["traffic_fuel_g_per_vehicle_km"] == pytest.approx((0.4931 + 0.10108 + 0.31096 + 0.4931) / 0.040)


def test_obstacles_and_persons_emit_nothing() -> None:
    road = lanes(("a", 0, 20), ("b", 0, 0), ("c", 0, 0))
    found = watched(TrafficEmissions(), [(1.0, dataclasses.replace(road, types=("car", "box", "pedestrian")))])
    assert found["traffic_co2_g_per_vehicle_km"] == pytest.approx(2.792 / 0.020, rel=1e-3)


def test_collisions_by_what_was_driven() -> None:
    road = lanes(("a", 0, 20), ("a", 50, 30))
    hits = (Collision(0.0, "v0", "v1", 12.0), Collision(0.0, "far", "away", 30.0), Collision(0.0, "x", "v1", 4.0))
    gone = dataclasses.replace(lanes(("a", 0, 20)), ids=("v9",))
    found = watched(TrafficCollisions(), [(1.0, road), (1.0, gone)], collisions=hits)
    assert found["traffic_collisions"] == 2
    assert found["traffic_collisions_per_million_vehicle_km"] == pytest.approx(2e6 / 0.070)
    assert found["traffic_mean_impact_speed_mps"] == 8.0
    assert found["traffic_max_impact_speed_mps"] == 12.0


def test_without_anybody_nothing_is_said() -> None:
    for metric in [
        *(TrafficConflicts(3.0), TrafficHeadways(), TrafficFlow(), TrafficSight(2.5, 3.4), TrafficComfort()),
        *(TrafficCollisions(), TrafficEmissions(), TrafficCompliance(1.0), TrafficEncroachment()),
        *(TrafficThroughput(), TrafficCohort()),
    ]:
        assert {*metric.result().values()} <= {None, 0}
        assert {*watched(metric, [(1.0, lanes()), (1.0, lanes())], np.zeros(0)).values()} <= {None, 0}


def test_events_and_times_of_the_cohort() -> None:
    """Of v0 and v2, in three steps of 1 s while a third one waits; v1 and v3 came before the cohort."""
    roads = [
        dataclasses.replace(
            lanes(("a", 0, 30), ("a", 25, 20), ("b", 0, 20), ("b", 44, 0)),
            acceleration=np.array([0.0, 0.0, braking, braking]),
            free_speed=np.array([40.0, 40.0, 40.0, 40.0]),
        )
        for braking in (-5.0, -5.0, 0.0, -4.0)
    ]
    cohort = Cohort(frozenset({"v0", "v2", "later"}), waiting=1, unfinished=3)
    steps = [(float(number > 0), road) for number, road in enumerate(roads)]
    hits = (Collision(0.0, "v3", "v2", 12.0), Collision(0.0, "v3", "v1", 4.0))
    conflicts = watched(TrafficConflicts(3.0), steps, cohort=cohort)
    assert conflicts["traffic_conflicts_per_cohort_vehicle"] == pytest.approx(2 / 3)
    assert watched(TrafficComfort(), steps, cohort=cohort)[
        "traffic_hard_braking_events_per_cohort_vehicle"
    ] == pytest.approx(2 / 3)
    found = watched(TrafficCollisions(), steps, collisions=hits, cohort=cohort)
    assert (found["traffic_collisions"], found["traffic_collisions_per_cohort_vehicle"]) == (2, pytest.approx(1 / 3))
    times = watched(TrafficCohort(), steps, cohort=cohort)
    assert (times["traffic_cohort_vehicles"], times["traffic_cohort_unfinished"]) == (3, 3)
    assert times["traffic_travel_time_s_per_cohort_vehicle"] == pytest.approx(3.0 * 3 / 3)
    assert times["traffic_delay_s_per_cohort_vehicle"] == pytest.approx(3.0 * (0.25 + 0.5 + 1.0) / 3)


def test_a_parked_vehicle_of_the_cohort_takes_time_but_loses_none() -> None:
    road = dataclasses.replace(
        lanes(("a", 0, 20), ("a", 40, 0)), free_speed=np.array([20.0, 20.0]), off_lanes=np.array([False, True])
    )
    times = watched(TrafficCohort(), [(0.0, road), (2.0, road)], cohort=Cohort(frozenset({"v0", "v1"}), 0, 2))
    assert times["traffic_travel_time_s_per_cohort_vehicle"] == pytest.approx(2.0)
    assert times["traffic_delay_s_per_cohort_vehicle"] == pytest.approx(0.0)


def test_histogram_of_what_lies_within_and_beyond() -> None:
    found = Histogram(0.0, 10.0, 0.5)
    assert found.quantile(0.5) is None
    assert found.share_below(1.0) is None
    found.add(np.linspace(-5.0, 15.0, 20_001), np.full(20_001, 0.1))
    assert [found.quantile(p) for p in (0.1, 0.3, 0.5, 0.7, 0.9)] == [
        None,
        *(pytest.approx(x, abs=2e-3) for x in (1.0, 5.0, 9.0)),
        None,
    ]
    assert found.share_below(5.0) == pytest.approx(0.5, abs=1e-4)
    edge = Histogram(0.0, 10.0, 0.05)
    edge.add(np.array([3.0, math.inf]), np.ones(2))
    assert edge.share_below(3) == 0.0
