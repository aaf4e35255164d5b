"""Check values: SUMO's SSM device documentation (gap 20 m, Δv 5 m/s), hand calculations and limits."""

import numpy as np
import pytest
from scipy import stats

from fogsim.metrics import (
    crash_potential,
    deceleration_rate_to_avoid_crash,
    modified_deceleration_rate_to_avoid_crash,
    potential_collision_speed,
    stopping_distance_difference,
    time_exposed_time_to_collision,
    time_headway,
    time_integrated_time_to_collision,
    time_to_collision,
)


def test_conflict_measures_of_a_gap_of_20_m_closing_at_5_mps() -> None:
    assert float(time_to_collision(20.0, 25.0, 20.0)) == pytest.approx(4.0)
    assert float(deceleration_rate_to_avoid_crash(20.0, 25.0, 20.0)) == pytest.approx(0.625)
    assert float(modified_deceleration_rate_to_avoid_crash(20.0, 25.0, 20.0)) == pytest.approx(0.83333, abs=1e-5)


def test_nothing_threatens_who_does_not_approach() -> None:
    for leader_speed in (20.0, 30.0):
        assert float(time_to_collision(10.0, 20.0, leader_speed)) == np.inf
        assert float(deceleration_rate_to_avoid_crash(10.0, 20.0, leader_speed)) == 0.0
        assert float(modified_deceleration_rate_to_avoid_crash(10.0, 20.0, leader_speed)) == 0.0


@pytest.mark.parametrize("gap", [0.0, -1.5])
def test_a_used_up_gap_is_a_collision(gap: float) -> None:
    assert float(time_to_collision(gap, 20.0, 10.0)) == 0.0
    assert float(deceleration_rate_to_avoid_crash(gap, 20.0, 10.0)) == np.inf
    assert float(deceleration_rate_to_avoid_crash(gap, 10.0, 20.0)) == 0.0
    assert float(modified_deceleration_rate_to_avoid_crash(gap, 20.0, 10.0)) == np.inf
    # No time is left after the reaction.
    assert float(modified_deceleration_rate_to_avoid_crash(10.0, 30.0, 20.0, 1.0)) == np.inf


def test_time_headway() -> None:
    assert float(time_headway(50.0, 25.0)) == pytest.approx(2.0)
    assert float(time_headway(-1.0, 25.0)) == 0.0
    assert float(time_headway(50.0, 0.0)) == np.inf


def test_exposed_and_integrated_time_by_hand() -> None:
    times = [4.0, 2.5, 1.0, 3.0, np.inf]
    assert time_exposed_time_to_collision(times, 0.5, 3.0) == pytest.approx(1.5)
    assert time_integrated_time_to_collision(times, 0.5, 3.0) == pytest.approx(0.5 * (0.5 + 2.0))
    assert time_exposed_time_to_collision(times, [1.0, 0.1, 0.2, 0.0, 1.0], 3.0) == pytest.approx(0.3)


def simulated_collision_speed(gap: float, speed: float, leader_speed: float) -> float:
    """Full braking of both at 6 m/s², the follower's after 1.5 s, by small steps."""
    step = 1e-4
    for number in range(200_000):
        if gap <= 0.0 or speed <= 0.0:
            break
        leader_speed = max(leader_speed - 6.0 * step, 0.0)
        speed -= 6.0 * step if number * step >= 1.5 else 0.0
        gap -= (speed - leader_speed) * step
    return speed - leader_speed if gap <= 0.0 else 0.0


def test_potential_collision_speed_is_that_of_a_simulation() -> None:
    """Hits while the leader brakes, while both do, while neither or one does, on a standing leader, and none."""
    for gap, speed, leader_speed in [
        *((3.0, 20.0, 20.0), (5.0, 20.0, 20.0), (20.0, 20.0, 18.0), (34.0, 20.0, 18.0), (45.0, 20.0, 18.0)),
        *((5.0, 20.0, 3.0), (20.0, 20.0, 3.0), (45.0, 20.0, 3.0), (80.0, 20.0, 3.0), (10.0, 5.0, 20.0)),
        *((25.0, 20.0, 0.0), (45.0, 20.0, 0.0), (70.0, 20.0, 0.0)),
    ]:
        expected = simulated_collision_speed(gap, speed, leader_speed)
        assert potential_collision_speed(gap, speed, leader_speed, 1.5, 6.0) == pytest.approx(expected, abs=0.02)


def test_an_obstacle_within_the_reaction_distance_is_hit_at_full_speed_and_one_without_end_never() -> None:
    # Bodies that overlap have no gap left.
    assert potential_collision_speed(-0.3, 12.0, 10.0) == potential_collision_speed(0.0, 12.0, 10.0) == 2.0
    found = potential_collision_speed(np.array([19.0, np.inf]), np.array([20.0, 20.0]), np.zeros(2))
    assert found.tolist() == [20.0, 0.0]


def test_crash_potential_is_the_truncated_normal_distribution_of_available_deceleration() -> None:
    """Half at the mean of 8.45 m/s², in the middle of 4.23 … 12.68; elsewhere scipy's distribution."""
    assert float(crash_potential(0.5 * (4.23 + 12.68))) == pytest.approx(0.5, abs=2e-3)
    ends = (4.23 - 8.45) / 1.40, (12.68 - 8.45) / 1.40
    wanted = np.linspace(3.0, 14.0, 45)
    np.testing.assert_allclose(crash_potential(wanted), stats.truncnorm.cdf(wanted, *ends, 8.45, 1.40), atol=1e-12)
    assert crash_potential(np.array([0.0, 4.23, 12.68, np.inf])).tolist() == [0.0, 0.0, 1.0, 1.0]


def test_stopping_distance_difference_by_hand_and_where_it_is_zero() -> None:
    """25 m behind 15 m/s at 20 m/s, 1 s and 5 m/s²: 25 + 22.5 − (20 + 40); 0 where both stop at the same place."""
    assert float(stopping_distance_difference(25.0, 20.0, 15.0, 1.0, 5.0)) == pytest.approx(-12.5)
    gap = 20.0 * 1.0 + (400.0 - 225.0) / 12.86
    assert float(stopping_distance_difference(gap, 20.0, 15.0)) == pytest.approx(0.0, abs=1e-12)
    assert float(potential_collision_speed(gap + 0.01, 20.0, 15.0)) == 0.0
    assert float(potential_collision_speed(gap - 0.01, 20.0, 15.0)) > 0.0
