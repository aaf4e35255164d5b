"""Lamps on poles next to streets."""

from collections.abc import Sequence

import numpy as np

from fogsim.core.linear_algebra import matrix_product
from fogsim.scene.edges import Edge
from fogsim.scene.lane_index import LaneIndex
from fogsim.scene.polyline import Points, arc_length
from fogsim.scene.roadside import Spacing, placed, stations, tube
from fogsim.scene.solids import Material, box, merge
from fogsim.values.scene import FAR, TINY, Batch, Mesh, Scene, Surface

_STREET_LAMP = "street_lamp"
"""Name of the shape of a lamp with its pole."""

HEIGHT = 8.0
"""Height of the luminous surface above the pole's foot [m]."""

SIZE = (0.5, 0.22, 0.05)
"""Length, width and height of the luminous surface, which bulges below the head [m]."""

_ARM = 1.4  # how far the head's middle lies over the road [m]
_SPACING = 35.0
_BESIDE = 0.5  # of poles beyond shoulder or footway [m]
_APART = 26.0  # lamps stand on one side of a street: none is nearer to another than this [m]
_POLE = Material((0.20, 0.205, 0.21))
_GLOW = Material((0.55, 0.55, 0.53), Surface.LAMP_STREET)


def street_lamp_shapes() -> dict[str, Mesh]:
    """Shape of a lamp whose arm reaches along y, with its levels of detail."""
    head = box((-0.16, _ARM - 0.38, HEIGHT), (0.16, _ARM + 0.38, HEIGHT + 0.1), _POLE)
    (length, width, depth), glow = SIZE, _GLOW
    lamp = box((-width / 2, _ARM - length / 2, HEIGHT - depth), (width / 2, _ARM + length / 2, HEIGHT), glow)
    arm = box((-0.04, 0.0, HEIGHT + 0.02), (0.04, _ARM - 0.3, HEIGHT + 0.1), _POLE)
    near = merge((tube(-0.3, 1.2, 0.09, 0.09, _POLE), tube(1.2, HEIGHT + 0.1, 0.06, 0.06, _POLE), arm, head, lamp))
    far = merge((tube(-0.3, HEIGHT, 0.06, 0.06, _POLE), head, lamp))
    return {_STREET_LAMP: near, _STREET_LAMP + FAR: far, _STREET_LAMP + TINY: far}


def lamp_posts(edges: Sequence[Edge], index: LaneIndex) -> list[Batch]:
    """Lamps about every 35 m along the outer sides of roads, on one side of roads of two directions, off all lanes."""
    side = _outer_side(edges)
    places, turns, spacing = [], [], Spacing(_APART)
    for edge in edges:
        if edge.side != side:
            continue
        along, heading = stations(edge.line, _SPACING, side * (edge.inner + edge.shoulder + _BESIDE))
        free = index.clearance(along, same_level=2.5, within=1.0) > 0.3
        # Their arms reach to the left of where they look.
        facing = heading if side < 0 else heading + np.pi
        for place, turn in zip(along[free], facing[free].tolist(), strict=True):
            if spacing.takes(place):
                places.append(place)
                turns.append(turn)
    return [placed(_STREET_LAMP, np.array(places), np.array(turns))] if places else []


def _outer_side(edges: Sequence[Edge]) -> int:
    """Side of roads, 1 left or −1 right, that most of the free sides are on: that to which vehicles keep."""
    lengths = {side: sum(float(arc_length(edge.line)[-1]) for edge in edges if edge.side == side) for side in (1, -1)}
    return 1 if lengths[1] > 1.001 * lengths[-1] else -1


def street_lamp_heads(scene: Scene) -> Points:
    """Middles of the luminous surfaces of all street lamps of a scene (n, 3) [m]."""
    batches = [batch.transforms for batch in scene.scenery if batch.shape == _STREET_LAMP]
    if not batches:
        return np.zeros((0, 3))
    head = np.array([0.0, _ARM, HEIGHT - SIZE[2] / 2, 1.0])
    return matrix_product(np.concatenate(batches).astype(np.float64)[:, :3], head)
