"""Solids have the volumes, areas and normals of geometry's formulas."""

import math

import numpy as np
import pytest

from fogsim.scene import solids
from fogsim.scene.solids import GLASS
from fogsim.values import Mesh


def corners(part: Mesh) -> np.ndarray:
    return part.positions.astype(np.float64)[part.faces]


def area(part: Mesh) -> float:
    a, b, c = corners(part).transpose(1, 0, 2)
    return float(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def volume(part: Mesh) -> float:
    """By the divergence theorem: positive if all triangles are counterclockwise as seen from outside."""
    a, b, c = corners(part).transpose(1, 0, 2)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def test_discs_rings_quads_and_polygons_have_the_area_within_their_corners() -> None:
    right, up = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    whole = 0.5 * 24 * math.sin(2 * math.pi / 24) * 2.0**2
    assert area(solids.disc((0, 0, 5), 2.0, right, up, GLASS)) == pytest.approx(whole)
    ring = solids.disc((0, 0, 5), 2.0, right, up, GLASS, hole=1.0)
    assert area(ring) == pytest.approx(0.75 * whole)
    assert np.array_equal(np.unique(ring.normals, axis=0), [[0, 0, 1]])
    assert math.pi * 4 == pytest.approx(area(solids.disc((0, 0, 0), 2.0, right, up, GLASS, sides=2000)), rel=1e-5)
    assert area(solids.quad([(0, 0, 0), (4, 0, 0), (4, 0, 3), (0, 0, 3)], GLASS, (0, -1, 0))) == pytest.approx(12)
    hexagon = [(math.cos(a), math.sin(a), 0) for a in np.arange(6) * math.pi / 3]
    assert area(solids.polygon(hexagon, GLASS, (0, 0, 1))) == pytest.approx(1.5 * math.sqrt(3))


def test_rigid_transforms_keep_areas_and_turn_normals_and_merging_keeps_every_part() -> None:
    part = solids.box((0, 0, 0), (1, 2, 3), solids.Material((0.5, 0.5, 0.5)))
    turn = np.eye(4)
    turn[:3, :3], turn[:3, 3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]], (10, 20, 30)
    there = solids.moved(part, turn)
    assert volume(there) == pytest.approx(6, rel=1e-4)
    assert np.array_equal(there.normals, part.normals[:, [1, 0, 2]] * np.float32((-1, 1, 1)))
    back = solids.moved(there, np.linalg.inv(turn))
    assert back.positions == pytest.approx(part.positions, abs=1e-6)
    parts = [solids.box((0, 0, 0), (1, 1, 1), GLASS), solids.box((5, 5, 5), (6, 7, 8), GLASS)]
    both = solids.merge(parts)
    assert np.array_equal(corners(both), np.concatenate([corners(part) for part in parts]))
    assert len(solids.merge([]).faces) == len(solids.merge([]).positions) == 0
