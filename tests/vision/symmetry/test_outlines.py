"""Edges bear out an outline, and where they leave its place open they are no evidence for it."""

import numpy as np
import pytest

from fogsim.vision.symmetry.detection import OUTLINES, Floats, fitted, support
from fogsim.vision.symmetry.edge_kernels import NX, NY, X, Y

MIDDLE, RADIUS = 20.0, 6.0


def edges_of(outline: Floats, shift: float = 0.0) -> tuple[Floats, np.ndarray]:
    """Points of edges on an outline, and their numbers in a picture of 40 × 40 px."""
    points = np.zeros((len(outline), 5), np.float32)
    points[:, X], points[:, Y] = (MIDDLE + RADIUS * outline[:, :2]).T
    points[:, X] += shift
    points[:, NX], points[:, NY] = outline[:, 2], outline[:, 3]
    number = np.full((40, 40), -1, np.int32)
    for i, point in enumerate(points):
        number[round(float(point[Y])), round(float(point[X]))] = i
    return points, number


@pytest.mark.parametrize("outline", OUTLINES)
def test_an_outline_of_edges_is_borne_out_and_found_beside_its_supposed_place(outline: Floats) -> None:
    points, number = edges_of(outline, shift=0.4)
    share, right, _, larger = support(points, number, outline, MIDDLE, MIDDLE, RADIUS, 2)
    assert share > 0.7
    assert right == pytest.approx(0.4, abs=0.2)
    assert abs(larger) < 0.4


@pytest.mark.parametrize("triangle", OUTLINES[3:])
def test_a_level_side_alone_is_no_outline(triangle: Floats) -> None:
    points, number = edges_of(triangle)
    level = np.flatnonzero(triangle[:, 2] == 0.0)
    number[~np.isin(number, level)] = -1
    assert (number >= 0).sum() >= 6
    assert support(points, number, triangle, MIDDLE, MIDDLE, RADIUS, 1)[0] == 0.0
    candidate, radii = np.full(2, MIDDLE, np.float32), np.full(1, RADIUS, np.float32)
    assert fitted(points, number, triangle[None], candidate, radii).tolist() == [0.0] * 5
