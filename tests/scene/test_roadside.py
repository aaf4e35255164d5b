"""What stands beside the road keeps its distances: stations, spacing, trees, houses, lamps."""

import math
from itertools import pairwise

import numpy as np
import pytest

from fogsim.scene import build_scene, street_lamp_heads
from fogsim.scene.lane_index import LaneIndex
from fogsim.scene.roadside import TREE_CLEARANCE, Spacing, placed, stations
from fogsim.scene.street_lamps import HEIGHT
from fogsim.values import Lane, LaneMarking, RoadNetwork, SignMap


def test_stations_on_a_circle_lie_on_a_parallel_at_even_angles() -> None:
    angle = np.linspace(0.0, math.pi, 2001)
    circle = np.column_stack((100 * np.cos(angle), 100 * np.sin(angle), np.full(len(angle), 3.0)))
    places, heading = stations(circle, 10.0, -5.0)
    assert np.hypot(places[:, 0], places[:, 1]) == pytest.approx(105.0, abs=1e-3)
    assert places[:, 2] == pytest.approx(3.0)
    assert len(places) == round(100 * math.pi / 10)
    assert np.diff(np.arctan2(places[:, 1], places[:, 0])) == pytest.approx(0.1, abs=1e-4)
    around = np.arctan2(places[:, 1], places[:, 0]) + 0.5 * math.pi
    assert np.cos(heading - around) == pytest.approx(1.0, abs=1e-5)


def test_places_that_are_taken_keep_their_distance_and_fill_the_room() -> None:
    rng, spacing = np.random.default_rng(4), Spacing(5.0)
    places = rng.uniform(-40.0, 40.0, (3000, 2))
    taken = np.array([place for place in places if spacing.takes(place)])
    between = np.linalg.norm(taken[:, None] - taken, axis=2) + 100.0 * np.eye(len(taken))
    assert between.min() > 5.0
    # Nothing that was refused had room.
    assert np.linalg.norm(places[:, None] - taken, axis=2).min(axis=1).max() <= 5.0


def test_a_copy_is_scaled_then_turned_then_placed() -> None:
    batch = placed("post", np.array([[1.0, 2.0, 3.0]]), np.array([0.5 * math.pi]), np.array([[2.0, 3.0, 4.0]]))
    corner = batch.transforms[0] @ np.array([1.0, 1.0, 1.0, 1.0], np.float32)
    assert corner == pytest.approx([1.0 - 3.0, 2.0 + 2.0, 3.0 + 4.0, 1.0], abs=1e-6)


@pytest.fixture(scope="module")
def street() -> RoadNetwork:
    line = np.column_stack((np.linspace(0.0, 400.0, 9), np.zeros(9), np.zeros(9)))
    lane = Lane("s_0", "s", line, 3.5, 13.9, left=LaneMarking.SOLID, right=LaneMarking.SOLID, outermost=True)
    return RoadNetwork((lane,), line)


def test_trees_houses_and_lamps_stand_clear_of_the_lanes(street: RoadNetwork) -> None:
    scene = build_scene(street, SignMap(()), np.random.default_rng(1), street_lamps=True)
    index = LaneIndex(street.lanes)
    found = {batch.shape: index.clearance(batch.transforms[:, :3, 3].astype(float)) for batch in scene.scenery}
    houses = [clear.min() for name, clear in found.items() if name.startswith("house")]
    trees = [clear.min() for name, clear in found.items() if name.startswith(("conifer", "broad_leaved", "woodland"))]
    assert houses
    assert trees
    assert min(houses) > 9.0
    assert min(trees) > TREE_CLEARANCE
    assert found["street_lamp"].min() > 2.0


def test_street_lamps_shine_from_8_m_over_the_edge_of_the_road_every_35_m(street: RoadNetwork) -> None:
    scene = build_scene(street, SignMap(()), np.random.default_rng(1), street_lamps=True)
    heads = street_lamp_heads(scene)
    heads = heads[np.argsort(heads[:, 0])]
    assert heads[:, 2] == pytest.approx(HEIGHT - 0.025, abs=1e-5)
    assert len(heads) == math.floor(400 / 35 + 0.5)
    assert all(b - a == pytest.approx(35.0, abs=1e-3) for a, b in pairwise(heads[:, 0]))
    assert len(np.unique(np.round(heads[:, 1], 3))) == 1
    assert len(street_lamp_heads(build_scene(street, SignMap(()), np.random.default_rng(1)))) == 0
