"""Boxes along lines."""

import numpy as np

from fogsim.scene.structures import structure_batches, structure_shapes
from fogsim.values import Structure, StructureKind

LINE = np.array([[0.0, 100.0, 1.0], [0.0, 150.0, 3.0], [-50.0, 200.0, 3.0]])


def test_a_wall_reaches_along_its_line_between_its_heights() -> None:
    wall = (Structure("w", StructureKind.WALL, LINE, 0.5, 0.25, 3.0),)
    shapes, batches = structure_shapes(wall), structure_batches(wall)
    points = np.concatenate([shapes[one.shape].positions + one.transforms[0, :3, 3] for one in batches])
    assert set(shapes) == {one.shape for one in batches}
    # From the lowest place of its foot to the highest of its top, half its width beside each end of its line.
    np.testing.assert_allclose(points[:, 2].min(), 1.25, atol=1e-3)
    np.testing.assert_allclose(points[:, 2].max(), 6.0, atol=1e-3)
    np.testing.assert_allclose(points[:, 1].min(), 100.0, atol=1e-3)
    np.testing.assert_allclose(points[:, 0].max(), 0.25, atol=1e-3)
    np.testing.assert_allclose(points[:, :2].min(axis=0)[0], -50.0 - 0.25 / np.sqrt(2.0), atol=1e-3)
    lengths = [np.ptp(shape.positions[:, :2], axis=0).max() for shape in shapes.values()]
    assert max(lengths) < 90.0  # short enough to be left out in pieces
