"""Who follows whom."""

import dataclasses
import itertools

import numpy as np
import pytest
from numpy.typing import NDArray

from fogsim.metrics.following import find_following
from tests.metrics.roads import lanes


@pytest.mark.parametrize("heading", [0.0, 1.0, 3.5])
def test_each_follows_the_nearest_ahead_in_its_lane(heading: float) -> None:
    road = lanes(("a", 0, 20), ("b", 10, 20), ("a", 80, 20), ("a", 40, 20), ("b", 5, 20), ("c", 0, 1), heading=heading)
    found = find_following(road)
    pairs = dict(zip(found.follower.tolist(), zip(found.leader.tolist(), found.gap.tolist(), strict=True), strict=True))
    assert pairs == {0: (3, pytest.approx(35.0)), 3: (2, pytest.approx(35.0)), 4: (1, pytest.approx(0.0))}
    assert not len(find_following(lanes(("a", 0, 20), ("b", 10, 20))).follower)
    assert not len(find_following(lanes()).follower)


@pytest.mark.parametrize("angle", [np.linspace(0.0, 1.2, 5), np.linspace(3.1, 0.05, 8)], ids=["curve", "half a circle"])
def test_a_lane_in_a_curve_is_followed_from_end_to_end(angle: NDArray[np.float64]) -> None:
    road = lanes(*(("a", 0.0, 10.0) for _ in angle))
    place = 100.0 * np.stack((np.sin(angle), 1.0 - np.cos(angle), 0.0 * angle), axis=-1)
    found = find_following(dataclasses.replace(road, position=place, heading=angle))
    ahead = np.argsort(angle).tolist()
    pairs = zip(found.follower.tolist(), found.leader.tolist(), strict=True)
    assert dict(pairs) == dict(itertools.pairwise(ahead))
    assert found.gap == pytest.approx(2 * 100.0 * np.sin(0.5 * np.ptp(angle) / (len(angle) - 1)) - 5.0)
    assert found.speed.tolist() == found.leader_speed.tolist() == [10.0] * (len(angle) - 1)


def test_gaps_leave_out_the_glide_of_a_lane_change() -> None:
    road = lanes(("a", 0, 30), ("a", 7, 25), heading=1.0)
    place = road.position + np.array([[0.0], [3.5]]) * (np.sin(1.0), -np.cos(1.0), 0.0)
    assert find_following(dataclasses.replace(road, position=place)).gap == pytest.approx([2.0])
