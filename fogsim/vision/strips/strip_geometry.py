"""Strips of road along the vehicle's axis: where they lie in the image of a camera on a flat road."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera
from fogsim.vision.strips import strip_kernels

Floats = NDArray[np.float64]

LANES = ((-1.4, 1.4), (-4.9, -2.1), (2.1, 4.9))
"""Sides of the strips to the right of the vehicle's axis [m]: the own lane's middle, and those of its neighbours."""

WHOLE_ROWS = 28.0
"""Rows below the horizon up to which every row is a bin of its own [px]; from there bins grow with the distance."""


@dataclass(frozen=True, slots=True)
class StripGeometry:
    """Where the strips lie in the image of a camera on a flat road, nearest bin of rows first."""

    # first, last (n,) int64: rows of each bin
    first: NDArray[np.int64]
    last: NDArray[np.int64]
    # below, half (n,): middle of each bin below the assumed horizon, and half its height [px]
    below: Floats
    half: Floats
    # distance, extent (n,): depth of each bin along the road, and how much road it covers [m]
    distance: Floats
    extent: Floats
    grazing: Floats  # (n,): Angle between the line of sight and the road [rad]
    # left, right (strips, n): columns between which each strip lies
    left: Floats
    right: Floats
    path: Floats  # (strips, n): λ times the slant: over the rows below the horizon, the length of the ray [px·m]
    # (strips, n): 1 − cos⁴ of the rays' angle to the camera's axis: the share of light that a simple lens takes [-]
    off_axis: Floats

    @property
    def rows(self) -> Floats:
        """(n,) float64: height of each bin [px]."""
        return 2.0 * self.half

    def only(self, strips: list[int]) -> "StripGeometry":
        """Some of the strips."""
        left, right, path, off_axis = (values[strips] for values in (self.left, self.right, self.path, self.off_axis))
        return replace(self, left=left, right=right, path=path, off_axis=off_axis)


def strip_geometry(camera: Camera, nearest: float, lanes: tuple[tuple[float, float], ...] = LANES) -> StripGeometry:
    """Lay strips over the image of a camera (`nearest` [px], `lanes` (float, float) [m])."""
    top = max(math.ceil(camera.horizon_row + nearest), 0)
    first, last = strip_kernels.row_bins(camera.horizon_row, top, camera.height - 1, WHOLE_ROWS)
    below: Floats = 0.5 * (first + last).astype(np.float64) - camera.horizon_row
    u0 = camera.principal_point[0]
    # A lateral offset x at depth z, seen from a camera that looks down, is α x / z columns off the axis.
    across = camera.focal_length / camera.row_distance * below
    sides = np.array(lanes)
    left, right = u0 + sides[:, :1] * across, u0 + sides[:, 1:] * across
    left, right = _inside(left, right, camera.width)
    return _laid(first, last, left, right, camera)


def laid_along(geometry: StripGeometry, left: Floats, right: Floats, camera: Camera) -> StripGeometry:
    """Lay strips between other columns on the same bins of rows (`left`, `right` (strips, n))."""
    return _laid(geometry.first, geometry.last, *_inside(left, right, camera.width), camera)


def _laid(
    first: NDArray[np.int64], last: NDArray[np.int64], left: Floats, right: Floats, camera: Camera
) -> StripGeometry:
    """Strips between columns on bins of rows."""
    below: Floats = 0.5 * (first + last).astype(np.float64) - camera.horizon_row
    half: Floats = 0.5 * (last - first + 1).astype(np.float64)
    square = _squared_tangent(left, right, below, camera)
    return StripGeometry(
        first=first,
        last=last,
        below=below,
        half=half,
        distance=camera.row_distance / below,
        extent=camera.row_distance * 2.0 * half / np.maximum(below**2 - half**2, 1e-9),
        grazing=np.arctan2(camera.mount_height * below, camera.row_distance),
        left=left,
        right=right,
        path=camera.row_distance * _across(np.sqrt(1.0 + square)),
        off_axis=_across(1.0 - (1.0 + square) ** -2),
    )


def _inside(left: Floats, right: Floats, width: int) -> tuple[Floats, Floats]:
    """Cut strips to the image; of what is mostly outside nothing is left."""
    low, high = np.clip(left, -0.5, width - 0.5), np.clip(right, -0.5, width - 0.5)
    return low, np.where(high - low < 0.3 * (right - left), low, high)


def _squared_tangent(left: Floats, right: Floats, below: Floats, camera: Camera) -> Floats:
    """(3, strips, n) float64: squared tangent of the angle to the axis, at the sides and in the middle of strips."""
    y = (below + camera.horizon_row - camera.principal_point[1]) / camera.focal_length
    x = (np.stack([left, 0.5 * (left + right), right]) - camera.principal_point[0]) / camera.focal_length
    return np.asarray(x**2 + y**2)


def _across(values: Floats) -> Floats:
    """Mean across strips by Simpson's rule: near, a lane is wide."""
    return np.asarray((values[0] + 4.0 * values[1] + values[2]) / 6.0)
