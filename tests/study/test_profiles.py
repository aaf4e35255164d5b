"""Profiles of a run: figures by hand."""

import dataclasses
import json

import numpy as np
import pytest

from fogsim.metrics import RunMetrics, TrafficRunMetrics, road_speeds
from fogsim.study.profiles import PooledProfiles, RunProfiles
from fogsim.units import extinction_from_visibility
from fogsim.values import Collision, Step, TrafficState, TrafficStep
from tests.metrics.roads import lanes as traffic
from tests.recorders.synthetic import make_step


def step(index: int, road: TrafficState, **about: float) -> Step:
    """One second a step; the ego is the first vehicle, which started where its route does."""
    place = float(np.hypot(*road.position[0, :2]))
    made = make_step(index, time=float(index), route_position=place, **about)
    return dataclasses.replace(made, traffic=dataclasses.replace(road, time=made.time), ego=0)


def drive() -> list[Step]:
    """Eleven steps of an ego at 20 m/s, one at 30 m/s beside it, one that comes towards it, one far off the road."""
    steps = []
    for i in range(11):
        road = traffic(("a", 20 * i, 20), ("b", 30 * i, 30), ("c", 300 - 20 * i, 20), ("d", 20 * i, 5), heading=1.0)
        heading, position = road.heading.copy(), road.position.copy()
        heading[2] += np.pi
        position[3] += 40 * np.array([-np.sin(1.0), np.cos(1.0), 0.0])
        road = dataclasses.replace(road, heading=heading, position=position)
        steps.append(step(i, road, visibility=100.0))
    return steps


def profiles_of(steps: list[Step]) -> dict[str, object]:
    watched = RunProfiles()
    metrics = RunMetrics(names=[], watchers=[watched])
    for one in steps:
        watched.update(one)
        metrics.update(one)
    metrics.summary()
    return json.loads(json.dumps(watched.to_json(), allow_nan=False))


@pytest.mark.parametrize("most_pending", [1, 200_000])
def test_speeds_along_the_road_are_of_those_who_drive_on_it(most_pending: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(road_speeds, "_MOST_PENDING", most_pending)
    found = profiles_of(drive())
    road = found["road"]
    # The ego is at 20, 40 | 60, 80 | 100 … 140 | 160, 180 | 200 m; the other at 30 | 60, 90 | 120 | 150, 180 | 210.
    assert road["place_m"] == [25.0, 75.0, 125.0, 175.0, 225.0]
    assert road["ego_time_s"] == [2, 2, 3, 2, 1]
    assert road["ego_way_m"] == [40, 40, 60, 40, 20]
    extinction = extinction_from_visibility(100.0)
    assert road["ego_extinction_time_s_per_m"] == pytest.approx([extinction * t for t in (2, 2, 3, 2, 1)], rel=1e-5)
    assert road["vehicle_time_s"] == [3, 4, 4, 4, 2]
    assert road["vehicle_way_m"] == [70, 100, 90, 100, 50]
    assert found["path"]["place_m"] == [0, 100, 200]
    assert found["path"]["x_m"] == pytest.approx([0, 100 * np.cos(1.0), 200 * np.cos(1.0)], rel=1e-5)


def test_speeds_along_a_named_road_need_no_ego() -> None:
    """The road is the way of `drive`'s ego; those who drive beside it or against it are not on it."""
    along = 10.0 * np.arange(21)[:, None] * np.array([np.cos(1.0), np.sin(1.0), 0.0])
    watched = RunProfiles()
    metrics = TrafficRunMetrics(names=[], watchers=[watched])
    for one in drive():
        known = dataclasses.replace(one.truth, vehicle_extinctions=np.array([0.01, 0.03, 9.0, 9.0]), route=along)
        kept = {f.name: getattr(one, f.name) for f in dataclasses.fields(TrafficStep)}
        alone = TrafficStep(**{**kept, "truth": known})
        watched.update(alone)
        metrics.update(alone)
    metrics.summary()
    found = watched.to_json()
    road = found["road"]
    assert road["place_m"] == [25.0, 75.0, 125.0, 175.0, 225.0]
    assert road["vehicle_time_s"] == [3, 4, 4, 4, 2]
    assert road["vehicle_way_m"] == [70, 100, 90, 100, 50]
    # Of the ego's time above, and that of the other: 1, 2, 1, 2 and 1 s.
    expected = [0.01 * slow + 0.03 * fast for slow, fast in ((2, 1), (2, 2), (3, 1), (2, 2), (1, 1))]
    assert road["vehicle_extinction_time_s_per_m"] == pytest.approx(expected, rel=1e-5)
    assert road["ego_time_s"] == [0.0] * 5
    assert found["path"]["place_m"] == [0, 50, 100, 150, 200]
    pooled = PooledProfiles()
    pooled.add(0, found)
    assert pooled.speeds()[:, 1] == pytest.approx([70 / 3, 25, 22.5, 25, 25])
    assert pooled.extinctions()[:, 1] == pytest.approx([k / t for k, t in zip(expected, (3, 4, 4, 4, 2), strict=True)])


def test_time_of_all_by_time_to_collision_apart_from_queues() -> None:
    # 2 s and 0.6 s from moving leaders, 2.2 s from a standing one, and one that comes no nearer.
    road = traffic(
        *(("a", 0, 30), ("a", 25, 20), ("b", 0, 30), ("b", 11, 20), ("c", 0, 20), ("c", 49, 0)),
        *(("d", 0, 20), ("d", 20, 20)),
    )
    found = profiles_of([step(0, road), step(1, road), step(3, road)])
    classes = found["time_to_collision"]
    assert found["vehicle_time_s"] == 3 * 8
    assert {i: t for i, t in enumerate(classes["moving_s"]) if t} == {8: 3.0, 2: 3.0}
    assert {i: t for i, t in enumerate(classes["queue_s"]) if t} == {8: 3.0}


def test_collisions_are_where_a_vehicle_was_last_seen() -> None:
    road = traffic(("a", 10, 20), ("a", 25, 0))
    hits = Collision(0.5, "v0", "gone", 4.0), Collision(0.5, "nobody", "no one", 1.0)
    crash = dataclasses.replace(step(1, traffic(("a", 30, 20))), collisions=(*hits, Collision(0.9, "v1", "v9", 2.0)))
    found = profiles_of([step(0, road), crash, crash])["collisions"]
    assert found["x_m"] == [30, None, 25]
    assert found["time_s"] == [0.5, 0.5, 0.9]
    assert found["impact_speed_mps"] == [4.0, 1.0, 2.0]
    assert found["collider"] == ["v0", "nobody", "v1"]


def test_a_run_that_never_moved_has_a_profile_too() -> None:
    assert profiles_of([])["road"]["place_m"] == []
    assert profiles_of([step(0, traffic(("a", 0, 0)))])["road"]["vehicle_time_s"] == [0]
