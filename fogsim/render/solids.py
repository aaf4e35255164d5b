"""Which triangles of a mesh belong to closed solids, where only the outside can be seen from outside."""

import numpy as np
from numpy.typing import NDArray

from fogsim.values.scene import Mesh


def in_solids(mesh: Mesh) -> NDArray[np.bool_]:
    """Find the triangles that belong to closed solids.

    Returns for each triangle whether every edge of it and of all that hang together with it has one other triangle on
    its other side, and they enclose what lies behind them (m,) bool.
    """
    if not len(mesh.faces):
        return np.zeros(0, np.bool_)
    # Corners at the same place are one, whatever else is known of them.
    _, corner = np.unique(mesh.positions, axis=0, return_inverse=True)
    faces = corner.reshape(-1)[mesh.faces].astype(np.int64)
    count = int(faces.max()) + 1
    start, end = faces.T.ravel(), np.roll(faces, -1, axis=1).T.ravel()
    edges, number, times = np.unique(start * count + end, return_inverse=True, return_counts=True)
    twin = np.isin(end * count + start, edges) & (times[number] == 1) & (start != end)
    part = _least_connected(start, end, count)[faces[:, 0]]
    gaps = np.bincount(np.tile(part, 3), ~twin, count)
    a, b, c = mesh.positions[mesh.faces].astype(np.float64).transpose(1, 0, 2)
    volume = np.bincount(part, np.einsum("ij,ij->i", a, np.cross(b, c)), count)
    return np.asarray(((gaps == 0) & (volume > 0))[part], np.bool_)


def _least_connected(start: NDArray[np.int64], end: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """The least of all the corners that each of so many corners hangs together with, over edges."""
    least, before = np.arange(count), np.full(count, -1)
    while not np.array_equal(least, before):
        before = least.copy()
        low = np.minimum(before[start], before[end])
        np.minimum.at(least, start, low)
        np.minimum.at(least, end, low)
    return least
