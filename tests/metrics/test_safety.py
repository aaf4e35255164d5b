"""Conflicts, sight and collisions: figures by hand."""

import math

import pytest

from fogsim.values import Collision, Leader
from tests.metrics.summaries import summarise
from tests.recorders.synthetic import make_step


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


def test_a_standing_leader_counts_and_closing_up_slowly_does_not() -> None:
    """20 m/s towards a leader at 4 m/s, then behind one at 10 m/s, then creeping up to a standing one."""
    seen = [(20.0, 32.0, 4.0), (20.0, 40.0, 10.0), (3.0, 2.5, 0.0)]
    steps = [
        make_step(i, time=0.5 * i, speed=speed, leader=Leader("other", gap, ahead))
        for i, (speed, gap, ahead) in enumerate([seen[0], *seen])
    ]
    summary = summarise(steps)
    for name in ("minimum_time_to_collision_s", "minimum_queue_time_to_collision_s"):
        assert summary[name] == pytest.approx(2.0)
    for name in ("time_exposed_time_to_collision_s", "time_exposed_to_queue_s"):
        assert summary[name] == pytest.approx(0.5)
    for name in ("max_drac_mps2", "max_queue_drac_mps2"):
        assert summary[name] == pytest.approx(16.0**2 / 64.0)
    assert summary["minimum_gap_m"] == summary["minimum_queue_gap_m"] == 32.0
    assert summary["minimum_moving_time_to_collision_s"] == pytest.approx(4.0)
    assert summary["time_exposed_to_moving_s"] == 0.0
    assert summary["minimum_moving_gap_m"] == 40.0
    assert summary["max_moving_drac_mps2"] == pytest.approx(10.0**2 / 80.0)
    # DSS by hand: 32 + (4² − 20²) / 12.86 − 20 = −17.9, 40 + (10² − 20²) / 12.86 − 20 = −3.3.
    assert summary["minimum_dss_m"] == pytest.approx(12.0 - 384.0 / 12.86)
    assert summary["time_integrated_dss_m_s"] == pytest.approx(0.5 * (684.0 / 12.86 - 32.0))
    assert summary["crash_potential_index"] == 0.0


def test_crash_potential_is_one_where_no_braking_is_enough() -> None:
    """For 1 s of 2: 20 m/s towards a standing leader at 10 m need 20 m/s², more than any car has."""
    steps = [
        make_step(i, time=float(i), speed=20.0, leader=Leader("other", 10.0 if i == 1 else 90.0, 0.0)) for i in range(3)
    ]
    assert summarise(steps)["crash_potential_index"] == pytest.approx(0.5)


def test_share_of_time_in_which_the_ego_could_not_stop_in_sight() -> None:
    steps = [
        make_step(i, time=float(i), speed=20.0, visibility=v) for i, v in enumerate((300.0, 300.0, 50.0, math.inf))
    ]
    summary = summarise(steps)
    assert summary["negative_margin_time_share"] == pytest.approx(1 / 3)
    assert summary["overdriven_m_per_km_in_fog"] == pytest.approx(500.0)
    assert summary["sight_margin_by_distance_m"] == pytest.approx(175.0 - (50.0 + 400 / 6.8))
    assert summary["distance_in_fog_m"] == pytest.approx(40.0)
    assert summary["minimum_visibility_m"] == pytest.approx(50.0)
    assert summary["minimum_visibility_margin_m"] == pytest.approx(50.0 - (50.0 + 400 / 6.8))


def test_collisions_of_the_ego_and_of_others() -> None:
    hits = (Collision(0.0, "a", "b", 12.0), Collision(0.0, "ego", "other", 5.0))
    summary = summarise([make_step(0, collisions=hits[:1]), make_step(1, time=1.0, collisions=hits[1:])])
    assert (summary["collisions"], summary["ego_collisions"]) == (2, 1)
    assert (summary["max_impact_speed_mps"], summary["ego_max_impact_speed_mps"]) == (12.0, 5.0)
