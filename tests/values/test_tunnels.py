"""Tunnels are the spaces under roofs."""

import numpy as np
import pytest

from fogsim.values import Structure, StructureKind
from fogsim.values.obstruction import Obstructions, Tunnel, tunnels_of

LINE = np.array([[0.0, 0.0, 2.0], [100.0, 0.0, 4.0], [180.0, 60.0, 4.0]])


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
