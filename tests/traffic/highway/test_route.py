"""The ego's way in highway-env's environments: where it leads, and that a place on it never jumps."""

import itertools
import math
from typing import Any

import gymnasium
import numpy as np
import pytest
from highway_env.road.lane import CircularLane, StraightLane

from fogsim.traffic.highway import HighwayTraffic, RouteProgress
from fogsim.traffic.highway.network import FASTEST_GAIN
from fogsim.values import Command, SpeedAdvice
from tests.traffic.common import driven, seen
from tests.traffic.highway.test_traffic import network_of

# Each with a seed, and a configuration that makes it quick.
ENVIRONMENTS: dict[str, tuple[int, dict[str, Any]]] = {
    "merge-v1": (1, {}),
    "roundabout-v1": (2, {}),
    "intersection-v1": (3, {"initial_vehicle_count": 6}),
    "racetrack-v0": (2, {}),
    "exit-v0": (1, {"vehicles_count": 4}),
    "two-way-v0": (1, {}),
    "u-turn-v0": (1, {}),
    "lane-keeping-v0": (1, {}),
}
LINE = np.array([[0.0, 0.0, 0.0], [30.0, 40.0, 0.0], [30.0, 140.0, 0.0]])


def first_look(*here: float) -> float:
    return RouteProgress(LINE).update(np.array(here))


def test_stations_along_a_polyline_are_a_round_trip() -> None:
    assert RouteProgress(LINE).length == pytest.approx(150.0)
    assert first_look(30.0, 90.0, 0.0) == pytest.approx(100.0)
    # A point beside the line counts at its nearest place, one beyond an end at that end.
    aside = 0.3 * LINE[1] + 2.0 * np.array([-0.8, 0.6, 0.0])
    assert first_look(*aside) == pytest.approx(15.0)
    assert first_look(-5.0, -5.0, 0.0) == 0.0
    assert first_look(30.0, 999.0, 0.0) == pytest.approx(150.0)


def test_a_way_that_crosses_itself_is_followed() -> None:
    """Where the way crosses itself, at 50 m and at 250 m, a vehicle is at the place that it can have come to."""
    line = np.array([[0, 0, 0], [100, 0, 0], [100, 50, 0], [50, 50, 0], [50, -50, 0]], dtype=float)
    progress = RouteProgress(line)
    stations = [progress.update(np.array([x, 0.0, 0.0])) for x in range(0, 101, 10)]
    stations += [progress.update(np.array([100.0, y, 0.0])) for y in range(10, 51, 10)]
    stations += [progress.update(np.array([x, 50.0, 0.0])) for x in range(90, 49, -10)]
    stations += [progress.update(np.array([50.0, y, 0.0])) for y in range(40, -51, -10)]
    assert stations == pytest.approx(list(range(0, 301, 10)))


def test_a_place_gains_and_loses_no_more_than_was_driven() -> None:
    progress = RouteProgress(LINE)
    progress.update(np.array([0.0, 0.0, 0.0]))
    # From (0, 0) to (30, 6), which is nearest to 22.8 m, are 30.6 m.
    assert progress.update(np.array([30.0, 6.0, 0.0])) == pytest.approx(22.8)
    here = 30.6 * np.array([0.6, 0.8, 0.0])
    first, second = RouteProgress(LINE), RouteProgress(LINE)
    assert [p.update(here) for p in (first, second)] == pytest.approx([30.6, 30.6])
    back = 20.0 * np.array([0.6, 0.8, 0.0])
    assert first.update(back) == pytest.approx(30.6)
    assert second.update(back, backwards=True) == pytest.approx(20.0)


def test_a_way_goes_on_where_the_next_lane_is_reached() -> None:
    first, second = StraightLane((0.0, 0.0), (100.0, 0.0)), StraightLane((60.0, 4.0), (200.0, 4.0))
    assert network_of(("a", "b", first), ("b", "c", second)).route == pytest.approx(
        np.array([(0.0, 0.0, 0.0), (100.0, 0.0, 0.0), (100.0, -4.0, 0.0), (200.0, -4.0, 0.0)])
    )


def test_a_way_does_not_turn_back() -> None:
    out, back = StraightLane((0.0, 0.0), (100.0, 0.0)), StraightLane((100.0, -4.0), (0.0, -4.0))
    assert network_of(("a", "b", out), ("b", "c", back)).route[-1] == pytest.approx((100.0, 0.0, 0.0))
    # But it follows a lane that does.
    bend = CircularLane((100.0, -10.0), 10.0, math.pi / 2, -math.pi / 2, clockwise=False)
    back = StraightLane((100.0, -20.0), (0.0, -20.0))
    assert network_of(("a", "b", out), ("b", "c", bend), ("c", "d", back)).route[-1] == pytest.approx((0.0, 20.0, 0.0))


@pytest.mark.filterwarnings("ignore:.*is out of date. You should consider upgrading:DeprecationWarning")
def test_the_egos_place_moves_as_it_drives() -> None:
    """Never back, and no farther than was driven but for cut bends; the ego never rolls back either."""
    for name, (seed, config) in ENVIRONMENTS.items():
        made = gymnasium.make(f"highway_env:{name}", config={**config, "neighbour_vehicles_connected_lanes": True})
        traffic = HighwayTraffic(made.unwrapped, None)
        traffic.start(seed)
        begun = seen(traffic)
        snapshots = driven(traffic, round(10.0 / traffic.step_length), Command(SpeedAdvice(80.0 / 3.6)))
        for before, after in itertools.pairwise((begun, *snapshots)):
            fastest = max(float(s.state.speed[s.ego]) for s in (before, after))
            moved = after.route_position - before.route_position
            assert -1e-9 <= moved <= FASTEST_GAIN * fastest * traffic.step_length + 0.05
            assert after.state.speed[after.ego] >= -1e-9
        route = traffic.network()[0].route
        steps = np.diff(route, axis=0)
        turns = np.diff(np.unwrap(np.arctan2(steps[:, 1], steps[:, 0])))
        # Some lanes go on beside where they ended, but none behind.
        assert (np.abs(turns) < math.radians(100.0)).all()
