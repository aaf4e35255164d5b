"""Lines painted across lanes: where to stop, where to give way, where pedestrians cross."""

import math
from collections.abc import Sequence

import numpy as np

from fogsim.scene.polyline import Points, arc_length, at_distance, cleaned, left_normals
from fogsim.scene.road import ASPHALT, ROAD
from fogsim.scene.solids import grid, merge
from fogsim.values.road import Lane, LaneEnd, LaneKind
from fogsim.values.scene import Mesh

LINE_WIDTH = 0.2
"""Width of the line that road attributes stand for [m]."""

_LIFT = 0.002  # above the lane [m]
_STOP_WIDTH, _YIELD_WIDTH = 0.5, 0.35  # along the road [m]
_SETBACK = 0.4  # from the lane's end [m]


def cross_lines(lanes: Sequence[Lane]) -> list[Mesh]:
    """Stop lines, lines to give way at, and zebra crossings of all lanes."""
    parts = []
    for lane in lanes:
        line = cleaned(lane.centreline)
        if lane.kind is LaneKind.CROSSING:
            parts.append(_zebra(line, lane.width))
        elif lane.end is LaneEnd.STOP:
            parts.append(_bars(line, lane.width, _STOP_WIDTH, [(-0.5, 0.5)]))
        elif lane.end is LaneEnd.YIELD:
            count = max(round(lane.width / 0.75), 2)
            edges = [(i / count - 0.5 + 0.17 / count, i / count - 0.5 + 0.83 / count) for i in range(count)]
            parts.append(_bars(line, lane.width, _YIELD_WIDTH, edges))
    return parts


def _bars(line: Points, width: float, thick: float, pieces: Sequence[tuple[float, float]]) -> Mesh:
    """Bars across the end of a lane; pieces are stretches from its right (−1/2) to its left (1/2)."""
    length = float(arc_length(line)[-1])
    near, far = (at_distance(line, np.array([max(length - _SETBACK - d, 0.0)]))[0] for d in (thick, 0.0))
    left = np.append(left_normals(line)[-1], 0.0)
    parts = []
    for low, high in pieces:
        ends = [0.98 * width * low * left, 0.98 * width * high * left]
        parts.append(_painted(np.array([[near + end, far + end] for end in ends])))
    return merge(parts)


def _zebra(line: Points, width: float) -> Mesh:
    """Stripes along the carriageway, across the way of the pedestrians."""
    length = float(arc_length(line)[-1])
    left = np.append(left_normals(line)[0], 0.0)
    parts = []
    for start in np.arange(0.25, max(length - 0.5, 0.3), 1.0).tolist():
        a, b = at_distance(line, np.array([start, start + 0.5]))
        parts.append(_painted(np.array([[a + end, b + end] for end in (-width / 2 * left, width / 2 * left)])))
    return merge(parts)


def _painted(corners: Points) -> Mesh:
    """Patch of paint: corners (2, 2, 3), whose second index runs across the line that the road attributes stand for.

    Only part of the attributes' line is as wide as its patch, so that its edges are smoothed like those of any line.
    """
    along = math.dist(corners[0, 0], corners[1, 0])
    middle = corners.mean(axis=1, keepdims=True)
    widened = middle + 1.5 * (corners - middle)
    road = np.zeros((2, 2, 4))
    road[..., 0] = np.array([[0.0], [along]])
    road[..., 1] = 1.0 + 0.75 * LINE_WIDTH * np.array([-1.0, 1.0])
    road[..., 2], road[..., 3] = 1.0, 3.0
    lifted = widened + np.array([0.0, 0.0, _LIFT])
    return grid(lifted, ASPHALT, (0, 0, 1), road=road.reshape(-1, 4), instance=ROAD)
