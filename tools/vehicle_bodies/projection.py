"""What is seen of a shape from one side: how much of it is paint, and its light."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.values.scene import Mesh, Surface

Wide = NDArray[np.float64]
Mask = NDArray[np.bool_]
Size = tuple[float, float, float]

ROWS, COLUMNS = 120, 160
_LEVEL, _UPWARDS = 0.56, 0.44  # light on an upright surface under an overcast sky, and its gain with the normal's z


@dataclass(frozen=True, slots=True)
class Projection:
    """A shape from one side, in a grid of rows (upwards) and columns."""

    depth: Wide  # how far it is inside its box, in units of the box; infinite where nothing is seen
    normal: Wide  # unit normals of the body in its real proportions
    paint: Wide  # 1 where paint is seen, else 0
    own: Wide  # reflectance times share of the sky's light of what is not paint, else 0

    @property
    def covered(self) -> Mask:
        """Where anything is seen."""
        return np.isfinite(self.depth)


def light_of(upwards: Wide | float) -> Wide:
    """Share of the overcast sky's light on surfaces, by the z of their normals."""
    return np.asarray(_LEVEL + _UPWARDS * np.asarray(upwards, np.float64))


def upwards_of(light: Wide) -> Wide:
    """Z of the normal of a surface with that share of light."""
    return np.asarray((light - _LEVEL) / _UPWARDS)


_VIEWS = {"rear": (1, 2, 0, 1.0), "front": (1, 2, 0, -1.0), "left": (0, 2, 1, -1.0), "top": (0, 1, 2, -1.0)}
_LOW, _HIGH = np.array([-1.0, -0.5, 0.0]), np.array([0.0, 0.5, 1.0])
_AWAY, _EYE = 50.0, 1.3  # from how far rear and front are seen, and from what height above the road [m]


def placed(side: str, right: Wide, up: Wide, depth: Wide, size: Size) -> Wide:
    """Points (…, 3) of the box from their places (0 … 1) across, up and into it, as seen from a side."""
    u, v, w, sign = _VIEWS[side]
    points = np.empty((*np.shape(right), 3))
    far, middle, eye = _perspective(side, depth, size)
    points[..., u], points[..., v] = _LOW[u] + middle + (right - middle) * far, _LOW[v] + eye + (up - eye) * far
    points[..., w] = _LOW[w] + depth if sign > 0 else _HIGH[w] - depth
    return np.clip(points, _LOW, _HIGH)


def _perspective(side: str, depth: Wide, size: Size) -> tuple[Wide, float, float]:
    """How many times as far away points are as the side itself, and the place opposite the eye (0 … 1)."""
    if side not in {"rear", "front"}:
        return np.ones_like(depth), 0.0, 0.0
    return 1.0 + depth * size[0] / _AWAY, 0.5, _EYE / size[2]


def project_shape(side: str, shape: Mesh, size: Size, fine: int = 1) -> Projection:
    """View of a shape in a unit box from the rear or front 50 m away, or without perspective from the left or top."""
    u, v, w, sign = _VIEWS[side]
    positions = shape.positions.astype(np.float64)
    deep = positions[:, w] - _LOW[w] if sign > 0 else _HIGH[w] - positions[:, w]
    far, middle, eye = _perspective(side, deep, size)
    right, up = middle + (positions[:, u] - _LOW[u] - middle) / far, eye + (positions[:, v] - _LOW[v] - eye) / far
    rows, columns = fine * ROWS, fine * COLUMNS
    points = np.stack((right * columns, up * rows, deep), axis=1)
    normals = shape.normals / np.array(size)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    paint = shape.surface == Surface.PAINT
    own = np.where(paint[:, None], 0.0, shape.reflectance * light_of(normals[:, 2])[:, None])
    layers = np.concatenate((normals, paint[:, None], own), axis=1)
    depth, layered = np.full((rows, columns), np.inf), np.zeros((rows, columns, layers.shape[1]))
    _draw(points, np.ascontiguousarray(layers), shape.faces.astype(np.int64), depth, layered)
    return Projection(depth, layered[..., :3], layered[..., 3], layered[..., 4:])


def row_sums(seen: Projection) -> Wide:
    """Sums over rows (rows, 5): samples that are covered, light on paint, and light of what is not (three channels)."""
    paint = seen.paint * light_of(seen.normal[..., 2])
    return np.column_stack((seen.covered.sum(axis=1), paint.sum(axis=1), seen.own.sum(axis=1)))


@kernel
def _draw(points: Wide, layers: Wide, faces: NDArray[np.int64], depth: Wide, out: Wide) -> None:
    """Draw triangles into a grid, the nearest where several meet."""
    rows, columns = depth.shape
    nearest = np.full((rows, columns), -1)
    for face in range(len(faces)):
        i, j, k = faces[face]
        ax, ay, bx, by, cx, cy = points[i, 0], points[i, 1], points[j, 0], points[j, 1], points[k, 0], points[k, 1]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if abs(area) < 1e-9:
            continue
        top, bottom = min(ay, by, cy), max(ay, by, cy)
        left, right = min(ax, bx, cx), max(ax, bx, cx)
        for row in range(max(int(np.ceil(top - 0.5)), 0), min(int(np.floor(bottom - 0.5)) + 1, rows)):
            for column in range(max(int(np.ceil(left - 0.5)), 0), min(int(np.floor(right - 0.5)) + 1, columns)):
                b, c = _shares(column + 0.5 - ax, row + 0.5 - ay, bx - ax, by - ay, cx - ax, cy - ay)
                if min(1.0 - b - c, b, c) >= 0.0:
                    deep = (1.0 - b - c) * points[i, 2] + b * points[j, 2] + c * points[k, 2]
                    if deep < depth[row, column]:
                        depth[row, column], nearest[row, column] = deep, face
    _fill(points, layers, faces, nearest, out)


@kernel
def _fill(points: Wide, layers: Wide, faces: NDArray[np.int64], nearest: NDArray[np.int64], out: Wide) -> None:
    """Layers between the corners of the nearest triangle of each place."""
    for row in range(nearest.shape[0]):
        for column in range(nearest.shape[1]):
            if nearest[row, column] < 0:
                continue
            i, j, k = faces[nearest[row, column]]
            ax, ay, bx, by, cx, cy = points[i, 0], points[i, 1], points[j, 0], points[j, 1], points[k, 0], points[k, 1]
            b, c = _shares(column + 0.5 - ax, row + 0.5 - ay, bx - ax, by - ay, cx - ax, cy - ay)
            for layer in range(layers.shape[1]):
                out[row, column, layer] = (1.0 - b - c) * layers[i, layer] + b * layers[j, layer] + c * layers[k, layer]


@kernel
def _shares(x: float, y: float, bx: float, by: float, cx: float, cy: float) -> tuple[float, float]:
    """Shares of the second and third corner in a place in a triangle, all seen from the first."""
    area = bx * cy - by * cx
    return (x * cy - y * cx) / area, (bx * y - by * x) / area
