"""Outlines of signs, of radius 1 about the middle of their faces, with their outward normals; rows downward."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.vision.symmetry.outline_kernels import SAMPLES


def polygon_outline(corners: Sequence[tuple[float, float]]) -> NDArray[np.float32]:
    """Places at even distances along a convex polygon, none on a corner.

    Returns place and outward normal. Takes `corners` (x, y).
    """
    ends = list(zip(corners, [*corners[1:], corners[0]], strict=True))
    lengths = [math.dist(a, b) for a, b in ends]
    step = sum(lengths) / SAMPLES
    rows = []
    for k in range(SAMPLES):
        way = (k + 0.5) * step
        side = 0
        while way > lengths[side]:
            way -= lengths[side]
            side += 1
        (ax, ay), (bx, by) = ends[side]
        share, length = way / lengths[side], lengths[side]
        rows.append((ax + share * (bx - ax), ay + share * (by - ay), (by - ay) / length, (ax - bx) / length))
    return np.array(rows, np.float32)


def _circle() -> NDArray[np.float32]:
    angle = 2.0 * math.pi * np.arange(SAMPLES) / SAMPLES
    return np.column_stack((np.cos(angle), np.sin(angle), np.cos(angle), np.sin(angle))).astype(np.float32)


def _regular(sides: int, turn: float, radius: float) -> NDArray[np.float32]:
    angles = [turn + 2.0 * math.pi * k / sides for k in range(sides)]
    return polygon_outline([(radius * math.cos(angle), radius * math.sin(angle)) for angle in angles])


_TIP_UP = ((0.0, -math.sqrt(0.75)), (1.0, math.sqrt(0.75)), (-1.0, math.sqrt(0.75)))
_TIP_DOWN = ((-1.0, -math.sqrt(0.75)), (1.0, -math.sqrt(0.75)), (0.0, math.sqrt(0.75)))

OUTLINES = np.stack(
    (
        _circle(),
        _regular(4, math.pi / 4, math.sqrt(2.0)),
        _regular(4, 0.0, 1.0),
        polygon_outline(_TIP_UP),
        polygon_outline(_TIP_DOWN),
    )
)
"""(5, SAMPLES, 4) float32: disc, square, square on its corner, triangles with their tip up and down. An octagon differs
from the disc by less than the edges of either do from a line."""
