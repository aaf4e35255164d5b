"""Followers, and conflicts of everybody: figures by hand."""

import dataclasses

import numpy as np
import pytest

from fogsim.metrics.everybody import Everybody
from fogsim.metrics.following import find_following
from fogsim.metrics.metric import Sample
from fogsim.values import TrafficState
from tests.recorders.synthetic import make_step


def traffic(*vehicles: tuple[str, float, float], heading: float = 0.0) -> TrafficState:
    """Vehicles of 5 m by lane, place of the front bumper along the road [m], and speed [m/s]."""
    n = len(vehicles)
    along = np.array([v[1] for v in vehicles], dtype=np.float64)
    return TrafficState(
        time=0.0,
        ids=tuple(f"v{i}" for i in range(n)),
        types=("car",) * n,
        position=np.stack((along * np.cos(heading), along * np.sin(heading), np.zeros(n)), axis=-1),
        heading=np.full(n, heading),
        speed=np.array([v[2] for v in vehicles], dtype=np.float64),
        acceleration=np.zeros(n),
        length=np.full(n, 5.0),
        width=np.full(n, 1.8),
        height=np.full(n, 1.5),
        lane=tuple(v[0] for v in vehicles),
        lamps=np.zeros(n, np.int32),
        paint=np.full((n, 3), 0.5),
    )


@pytest.mark.parametrize("heading", [0.0, 1.0, 3.5])
def test_each_follows_the_nearest_ahead_in_its_lane(heading: float) -> None:
    road = traffic(
        ("a", 0, 20), ("b", 10, 20), ("a", 80, 20), ("a", 40, 20), ("b", 5, 20), ("c", 0, 1), heading=heading
    )
    found = find_following(road)
    pairs = dict(zip(found.follower.tolist(), zip(found.leader.tolist(), found.gap.tolist(), strict=True), strict=True))
    assert pairs == {0: (3, pytest.approx(35.0)), 3: (2, pytest.approx(35.0)), 4: (1, pytest.approx(0.0))}
    assert not len(find_following(traffic(("a", 0, 20), ("b", 10, 20))).follower)
    assert not len(find_following(traffic()).follower)


def test_a_lane_in_a_curve_is_followed() -> None:
    angle = np.linspace(0.0, 1.2, 5)
    road = traffic(*(("a", 0.0, 10.0) for _ in angle))
    place = 100.0 * np.stack((np.sin(angle), 1.0 - np.cos(angle), 0.0 * angle), axis=-1)
    found = find_following(dataclasses.replace(road, position=place, heading=angle))
    assert found.leader.tolist() == [1, 2, 3, 4]
    assert found.gap == pytest.approx(2 * 100.0 * np.sin(0.15) - 5.0)


def test_conflicts_of_everybody_over_the_time_of_all() -> None:
    metric = Everybody(threshold=3.0)
    # v0 comes to within 2 s of a moving leader, v2 of a standing one; v4 follows at 0.75 s and comes no nearer.
    road = traffic(("a", 0, 30), ("a", 25, 20), ("b", 0, 20), ("b", 44, 0), ("c", 0, 20), ("c", 20, 20))
    step = dataclasses.replace(make_step(1), traffic=road)
    for elapsed in (0.0, 0.5, 1.5):
        metric.update(Sample(step, elapsed, {}))
    found = metric.result()
    assert found["traffic_vehicle_time_s"] == pytest.approx(12.0)
    assert found["traffic_mean_speed_mps"] == pytest.approx(110 / 6)
    assert found["traffic_speed_standard_deviation_mps"] == pytest.approx(np.std(road.speed))
    assert found["traffic_exposed_time_share"] == pytest.approx(1 / 6)
    assert found["traffic_integrated_time_to_collision_s2_per_h"] == pytest.approx(3600 * (3.0 - 2.0) / 6)
    assert found["traffic_queue_exposed_time_share"] == pytest.approx(1 / 6)
    # DRAC of v0: 10² / 2 · 20 = 2.5 m/s², and v2's leader is a queue.
    assert found["traffic_serious_conflict_time_share"] == 0.0
    assert found["traffic_headway_below_1_s_share"] == pytest.approx(2 / 3)
    assert found["traffic_headway_below_2_s_share"] == pytest.approx(3 / 3)
    assert found["traffic_mean_approach_mps"] == pytest.approx((10 + 20 + 0) / 3)


def test_without_anybody_nothing_is_said() -> None:
    found = Everybody(threshold=3.0).result()
    assert found["traffic_vehicle_time_s"] == 0.0
    assert {value for key, value in found.items() if key != "traffic_vehicle_time_s"} == {None}
