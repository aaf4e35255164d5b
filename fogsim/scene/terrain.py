"""Terrain: level where the roads are, following them where they climb, and the plain beyond."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fogsim.scene.polyline import Points, cleaned, refined
from fogsim.scene.solids import Material, grid_faces, grid_normals, mesh
from fogsim.values.road import Lane
from fogsim.values.scene import Instance, Mesh, Surface

_LEVEL = 2.0  # roads whose heights differ by no more than this lie in a plain [m]
_CELL = 14.0  # side of a cell of the land [m]
_LARGEST = 4_000_000  # cells; larger maps get larger cells
_BELOW = 0.6  # the land lies this far below the roads next to them [m]
_SHELF = 6.0  # land this near to a road keeps its level [m]
_FALL, _RISE = 0.22, 0.5  # steepest slopes away from a road, down and up [-]
_GRASS = np.array([0.064, 0.088, 0.036])


class Terrain:
    """Height of the land.

    Near a road the land lies a little below it; farther away it falls to the plain that all of it stands in. Where a
    road passes over another, the lower one has its way.

    Parameters
    ----------
    lanes : sequence of Lane
        Lanes with at least two distinct points each.

    Attributes
    ----------
    plain : float
        Height of the plain [m].
    """

    def __init__(self, lanes: Sequence[Lane]) -> None:
        places = np.concatenate([lane.centreline for lane in lanes])
        if np.ptp(places[:, 2]) > 0.0:
            places = np.concatenate([refined(cleaned(lane.centreline), 0.5 * _CELL) for lane in lanes])
        self._heights: NDArray[np.float64] | None = None
        hilly = np.ptp(places[:, 2]) > _LEVEL
        self.plain = float(places[:, 2].min()) - (_BELOW if hilly else 0.1)
        if hilly:
            self._raise_land(places)

    def _raise_land(self, places: Points) -> None:
        reach = _SHELF + (places[:, 2].max() - self.plain) / _FALL + 2 * _CELL
        low, high = places[:, :2].min(axis=0) - reach, places[:, :2].max(axis=0) + reach
        self._cell = max(_CELL, float(np.sqrt(np.prod(high - low) / _LARGEST)))
        self._corner = low
        shape = np.ceil((high - low) / self._cell).astype(int) + 1
        fallen, risen = np.full(shape, self.plain), np.full(shape, np.inf)
        for x, y, z in _thinned(places, 0.5 * self._cell).tolist():
            _spread(fallen, risen, ((x - low[0]) / self._cell, (y - low[1]) / self._cell, z), self._cell, self.plain)
        self._heights = np.maximum(np.minimum(fallen, risen), self.plain)

    def height(self, places: NDArray[np.float64]) -> NDArray[np.float64]:
        """Height of the land at places (n,) [m] (`places` (n, 2 or 3) [m])."""
        if self._heights is None:
            return np.full(len(places), self.plain)
        at = (places[:, :2] - self._corner) / self._cell
        corner = np.clip(np.floor(at).astype(int), 0, np.array(self._heights.shape) - 2)
        (u, v), (i, j) = np.clip(at - corner, 0.0, 1.0).T, corner.T
        heights = self._heights
        # The same two triangles as in the mesh, so that nothing floats or sinks.
        lower = heights[i, j] + u * (heights[i + 1, j] - heights[i, j]) + v * (heights[i, j + 1] - heights[i, j])
        far = heights[i + 1, j + 1]
        upper = far + (1 - u) * (heights[i, j + 1] - far) + (1 - v) * (heights[i + 1, j] - far)
        return np.asarray(np.where(u + v < 1.0, lower, upper), np.float64)

    def mesh(self) -> Mesh | None:
        """Land that rises above the plain; None where there is none."""
        heights = self._heights
        if heights is None:
            return None
        rows, columns = heights.shape
        x, y = (self._corner[axis] + self._cell * np.arange(heights.shape[axis]) for axis in range(2))
        points = np.stack((*np.meshgrid(x, y, indexing="ij"), heights - 0.02), axis=-1)
        faces = grid_faces(rows, columns)
        raised = np.any(heights.ravel()[faces] > self.plain + 0.01, axis=1)
        used, renumbered = np.unique(faces[raised], return_inverse=True)
        tone = _tone(points.reshape(-1, 3)[used])
        return mesh(
            points.reshape(-1, 3)[used],
            renumbered.reshape(-1, 3),
            grid_normals(points, (0, 0, 1)).reshape(-1, 3)[used],
            Material((0.064, 0.088, 0.036)),
            reflectance=tone[:, None] * _GRASS,
            instance=Instance.TERRAIN,
        )


def _tone(points: Points) -> NDArray[np.float64]:
    """Meadows differ in tone from field to field and from tuft to tuft, the same wherever and whenever they are."""
    fields = np.sin(0.021 * points[:, 0] + 1.3 * np.sin(0.017 * points[:, 1]))
    tufts = np.modf(43758.5453 * np.sin(12.9898 * points[:, 0] + 78.233 * points[:, 1]))[0]
    return np.asarray(1.0 + 0.09 * fields + 0.09 * tufts)


def _thinned(places: Points, side: float) -> Points:
    """One place for each cube of a side."""
    _, kept = np.unique(np.floor(places / (side, side, 1.0)).astype(np.int64), axis=0, return_index=True)
    return places[np.sort(kept)]


def _spread(
    fallen: NDArray[np.float64],
    risen: NDArray[np.float64],
    place: tuple[float, float, float],
    cell: float,
    plain: float,
) -> None:
    """Let the land around one place on a road neither fall nor rise more steeply than it may."""
    column, row, z = place
    reach = int((_SHELF + max(z - plain, 6.0) / _FALL) / cell) + 1
    window = tuple(
        slice(max(int(middle) - reach, 0), min(int(middle) + reach + 2, size))
        for middle, size in zip((column, row), fallen.shape, strict=True)
    )
    i, j = np.ogrid[window]
    away = np.maximum(np.hypot(i - column, j - row) * cell - _SHELF - cell, 0.0)
    fallen[window] = np.maximum(fallen[window], z - _BELOW - _FALL * away)
    risen[window] = np.minimum(risen[window], z - _BELOW + _RISE * away)


def plain_mesh(lanes: Sequence[Lane], height: float) -> Mesh:
    """Level grassland around all lanes, as two triangles that reach beyond the horizon (`height` [m])."""
    everything = np.concatenate([lane.centreline[:, :2] for lane in lanes])
    low, high = everything.min(axis=0) - 40e3, everything.max(axis=0) + 40e3
    corners = [(low[0], low[1]), (high[0], low[1]), (low[0], high[1]), (high[0], high[1])]
    points = np.array([(x, y, height) for x, y in corners])
    normals = np.broadcast_to((0.0, 0.0, 1.0), (4, 3))
    grass = Material((0.064, 0.088, 0.036), Surface.TERRAIN)
    return mesh(points, [[0, 1, 2], [1, 3, 2]], normals, grass, instance=Instance.TERRAIN)
