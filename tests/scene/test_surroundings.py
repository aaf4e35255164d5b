import dataclasses

import numpy as np
import pytest

from fogsim.scene import Corridor, build_scene, surroundings
from fogsim.scene.surroundings import REACH
from fogsim.values import Lane, RoadNetwork, Sign, SignMap

SIGN = Sign("s", "speed_limit", 20.0, (200.0, -6.0, 2.2), 0.0, 0.9)


def moved(network: RoadNetwork, by: np.ndarray) -> RoadNetwork:
    def lane(one: Lane) -> Lane:
        return dataclasses.replace(one, centreline=one.centreline + by)

    return RoadNetwork(tuple(map(lane, network.lanes)), network.route + by)


def test_a_network_near_the_origin_of_its_own_stays_as_it_is(motorway: RoadNetwork) -> None:
    around = surroundings(motorway, SignMap((SIGN,)), motorway.route)
    assert around.whole
    assert not around.origin.any()
    assert around.signs.signs == (SIGN,)
    for one, other in zip(around.network.lanes, motorway.lanes, strict=True):
        assert np.array_equal(one.centreline, other.centreline)


def test_a_network_far_from_its_origin_is_built_to_the_millimetre(motorway: RoadNetwork) -> None:
    by = np.array([1.0e6, 5.5e6, 0.0])
    far = surroundings(moved(motorway, by), SignMap(), motorway.route + by)
    here, there = (build_scene(network, SignMap(), np.random.default_rng(1)) for network in (motorway, far.network))
    assert far.origin == pytest.approx(by)
    # All but the terrain, whose corners lie beyond the horizon.
    assert there.ground.positions[4:] == pytest.approx(here.ground.positions[4:], abs=1e-3)


def test_what_is_far_from_the_route_is_left_out(motorway: RoadNetwork) -> None:
    away = moved(motorway, np.array([0.0, REACH + 1000.0, 0.0]))
    posts = (SIGN, dataclasses.replace(SIGN, sign_id="far", position=(200.0, REACH + 1000.0, 2.2)))
    both = RoadNetwork(motorway.lanes + away.lanes, motorway.route)
    around = surroundings(both, SignMap(posts), both.route)
    assert not around.whole
    assert len(around.network.lanes) == len(motorway.lanes)
    assert [sign.sign_id for sign in around.signs.signs] == ["s"]


def test_near_is_what_is_as_near_as_told_also_beside_long_pieces() -> None:
    near = Corridor(np.array([[0.0, 0, 0], [9000, 0, 0]]), 600.0)
    assert near.contains(np.array([[4500.0, 590.0], [4500, -590], [-590, 0], [9590, 0]])).all()
    assert not near.contains(np.array([[4500.0, 1400.0], [-1400, 0], [1e7, 0]])).any()
    lines = [np.array([[4500.0, -9000, 0], [4500, 9000, 0]]), np.array([[0.0, 5000, 0], [9000, 5000, 0]])]
    assert near.reaches(lines) == [True, False]
