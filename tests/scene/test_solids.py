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


def test_a_box_has_its_volume_and_area_whichever_corners_are_given() -> None:
    for low, high in (((1, 2, 3), (3, 5, 7)), ((3, 2, 7), (1, 5, 3))):
        part = solids.box(low, high, GLASS)
        assert len(part.faces) == 12
        assert volume(part) == pytest.approx(2 * 3 * 4)
        assert area(part) == pytest.approx(2 * (2 * 3 + 3 * 4 + 4 * 2))
        outward = corners(part).mean(axis=1) - (2, 3.5, 5)
        assert np.all(np.einsum("ij,ij->i", outward, part.normals[part.faces[:, 0]]) > 0)
        assert np.linalg.norm(part.normals, axis=1) == pytest.approx(1.0)


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


def test_a_concave_outline_is_filled_without_overlap() -> None:
    outline = np.array([(0, 0), (4, 0), (4, 3), (2, 1), (0, 3)], float)
    part = solids.mesh(
        np.column_stack((outline, np.zeros(5))), solids.concave_faces(outline), np.tile((0, 0, 1), (5, 1)), GLASS
    )
    assert len(part.faces) == 3
    # Shoelace formula.
    x, y = outline.T
    assert area(part) == pytest.approx(0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)))
    centres = corners(part).mean(axis=1)
    assert not np.any((abs(centres[:, 0] - 2) < 0.5) & (centres[:, 1] > 2))


def test_normals_of_a_grid_are_those_of_the_surface() -> None:
    x, y = np.meshgrid(np.linspace(-1, 1, 5), np.linspace(-2, 2, 7), indexing="ij")
    plane = np.stack((x, y, 0.5 * x - 0.25 * y), axis=-1)
    expected = np.array([-0.5, 0.25, 1.0]) / math.sqrt(0.25 + 0.0625 + 1.0)
    assert np.abs(solids.grid(plane, GLASS, (0, 0, 1)).normals - expected).max() < 1e-6
    assert np.abs(solids.grid(plane, GLASS, (0, 0, -1)).normals + expected).max() < 1e-6
    assert np.array_equal(solids.grid_normals(np.zeros((2, 2, 3)), (0, 1, 0)), np.tile((0.0, 1.0, 0.0), (2, 2, 1)))


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
