"""Lines of sight: by hand, the same from either end, and without any obstruction never blocked; tunnels."""

import math

import numpy as np
import pytest

from fogsim.values import Structure, StructureKind
from fogsim.values.obstruction import CLEAR_SIGHT, Obstructions, Tunnel, obstructions_of, tunnels_of


def structure(
    line: list[list[float]], width: float = 2.0, bottom: float = 0.0, top: float = 3.0, kind: str = "wall"
) -> Structure:
    return Structure("one", StructureKind(kind), np.array(line, np.float64), width, bottom, top)


WALL = obstructions_of([structure([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]])])
"""From x = 0 to 10, y = −1 to 1, 3 m high."""

LINE = np.array([[0.0, 0.0, 2.0], [100.0, 0.0, 4.0], [180.0, 60.0, 4.0]])


def test_ways_through_a_wall_by_hand() -> None:
    for eyes, target, way in [
        ((5.0, -10.0, 1.0), (5.0, 10.0, 1.0), 2.0),  # straight through
        ((-10.0, 0.5, 1.0), (20.0, 0.5, 1.0), 10.0),  # along it
        ((0.0, -2.0, 1.0), (4.0, 2.0, 1.0), 2.0 * math.sqrt(2.0)),  # at 45°
        ((5.0, -10.0, 1.0), (5.0, -2.0, 1.0), 0.0),  # ends before it
        ((10.5, -10.0, 1.0), (10.5, 10.0, 1.0), 0.0),  # passes it
        ((-10.0, 1.0, 1.0), (20.0, 1.0, 1.0), 0.0),  # touches its face
        ((5.0, -4.0, 3.5), (5.0, 4.0, 3.5), 0.0),  # over it
        ((5.0, -3.0, 1.0), (5.0, 3.0, 7.0), 0.0),  # touches its nearer upper edge
        ((5.0, -3.0, 1.5), (5.0, 5.0, 3.5), 2.0 * math.hypot(1.0, 0.25)),  # rises by 1 in 4
        ((5.0, 0.0, 1.0), (5.0, 10.0, 1.0), 1.0),  # begins within
        ((5.0, 0.0, -4.0), (5.0, 0.0, 6.0), 3.0),  # straight up
    ]:
        assert WALL.way_through([eyes], [target])[0] == pytest.approx(way, abs=1e-12)
        assert WALL.hide([eyes], [[target]])[0] == (way > 0.0)


def test_sight_is_the_same_from_either_end_to_the_bit() -> None:
    rng = np.random.default_rng(3)
    bend = np.array([[x, 0.02 * x * x, 0.1 * x] for x in range(0, 60, 5)])
    wall = [[7.0, 3.0, 0.2], [20.0, 9.0, -0.4]]
    obstructions = obstructions_of([structure(bend.tolist(), 1.3), structure(wall, 0.3)])
    one, other = rng.uniform((-10, -10, -2), (60, 60, 8), (2, 4000, 3))
    there = obstructions.hide(one, other[:, None])
    assert np.array_equal(there, obstructions.hide(other, one[:, None]))
    assert np.array_equal(obstructions.way_through(one, other), obstructions.way_through(other, one))
    assert 0.02 < there.mean() < 0.98
    assert np.array_equal(there, obstructions.way_through(one, other) > 0.0)
    near = obstructions.are_near(one, other, np.full(len(one), 5.0))
    assert near[obstructions.hide(one, other[:, None] + (3.0, -4.0, 0.0))].all()
    assert 0.5 < near.mean() < 0.98


def test_it_rises_with_its_line_and_nobody_looks_between_its_pieces() -> None:
    rising = obstructions_of([structure([[0.0, 0.0, 0.0], [50.0, 0.0, 5.0], [60.0, 30.0, 5.0]], 0.3, top=2.0)])
    eyes = [(25.0, -5.0, height) for height in (2.4, 2.6, 4.4, 4.6)]
    targets = [[(25.0, 5.0, height)] for _, _, height in eyes]
    assert rising.hide(eyes, targets).tolist() == [False, True, True, False]
    # Past the corner, where the two boxes part on the outer side, the middle line has no hole.
    assert rising.hide([(45.0, 5.0, 6.0)], [[(55.0, -5.0, 6.0)]])[0]


def test_a_target_is_hidden_when_all_its_points_are() -> None:
    eyes, hidden, free = (5.0, -10.0, 1.0), (5.0, 10.0, 1.0), (5.0, 10.0, 9.0)
    assert WALL.hide([eyes] * 3, [[hidden, hidden], [hidden, free], [free, hidden]]).tolist() == [True, False, False]


def test_without_obstructions_nothing_is_hidden() -> None:
    assert obstructions_of([]) is CLEAR_SIGHT
    assert not CLEAR_SIGHT
    assert not CLEAR_SIGHT.hide([(0.0, 0.0, 0.0)], [[(1.0, 0.0, 0.0)]]).any()
    assert not CLEAR_SIGHT.way_through([(0.0, 0.0, 0.0)], [(1.0, 0.0, 0.0)]).any()
    assert WALL.hide(np.zeros((0, 3)), np.zeros((0, 4, 3))).shape == (0,)
    assert not obstructions_of([structure([[1.0, 1.0, 0.0], [1.0, 1.0, 4.0]])])


def test_a_line_has_no_more_boxes_than_it_has_bends() -> None:
    straight = structure([[float(x), 0.0, 0.1 * x] for x in range(100)])
    assert len(obstructions_of([straight])) == 1
    there_and_back = structure([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 5.0, 0.0], [0.0, 0.0, 0.0]])
    assert len(obstructions_of([there_and_back])) == 3
    angle = np.linspace(0.0, 1.0, 400)
    arc = obstructions_of([structure(np.stack([200 * np.cos(angle), 200 * np.sin(angle), 0 * angle], 1).tolist())])
    # Chords of 2 √(2 · 200 m · 1 cm) = 4 m.
    assert 40 < len(arc) < 110


def test_a_tunnel_is_what_is_under_a_roof() -> None:
    kinds = (("tunnel", 5.0), ("tunnel", 0.0), ("wall", 5.0))
    roofs = [Structure("r", StructureKind(kind), LINE, 12.0, bottom, bottom + 0.8) for kind, bottom in kinds]
    (tunnel,) = tunnels_of(roofs)
    assert (tunnel.half_width, tunnel.height) == (6.0, 5.0)
    assert tunnel.length == pytest.approx(200.0)


def test_its_space_ends_within_its_walls_and_portals() -> None:
    space = Obstructions(Tunnel(LINE, 6.0, 5.0).boxes())

    def is_in(x: float, y: float, z: float) -> bool:
        return bool(space.way_through([(x, y, z)], [(x, y, z + 1e-3)])[0] > 0.0)

    assert is_in(50.0, 0.0, 3.0)
    assert is_in(50.0, 0.0, 8.0)  # its ceiling
    assert not is_in(50.0, 0.0, 8.2)
    assert is_in(50.0, 5.8, 4.0)
    assert not is_in(50.0, 6.0, 4.0)  # the outer face of its wall
    assert not is_in(0.01, 0.0, 3.0)
    assert is_in(0.03, 0.0, 3.0)  # no strip of wall at the portal is lit as if outside
    assert is_in(140.0, 30.0, 5.0)
    assert not is_in(179.99, 60.0, 5.0)
