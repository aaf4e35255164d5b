"""Strips of road along the vehicle's axis: where they lie in the image of a camera on a flat road."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.values.camera import Camera

Floats = NDArray[np.float64]

SIDES = np.array([[-1.4, 1.4], [-4.9, -2.1], [2.1, 4.9]])
"""Sides of the strips to the right of the vehicle's axis [m]: the own lane's middle, and those of its neighbours."""

WHOLE_ROWS = 28.0
"""Rows below the horizon up to which every row is a bin of its own [px]; from there bins grow with the distance."""


class StripGeometry(NamedTuple):
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
        """Some of the strips; the first ones are not copied."""
        which = slice(len(strips)) if strips == [*range(len(strips))] else strips
        return StripGeometry(*self[:7], *[values[which] for values in self[7:]])


class RoadView(NamedTuple):
    """What a camera looks at a road with."""

    width: float  # Of the image [px]
    column: float  # Principal point's [px]
    row: float  # Principal point's [px]
    horizon: float  # Its row [px]
    focal: float  # Focal length [px]
    unit: float  # λ [px·m]
    height: float  # Above the road [m]


def view_of(camera: Camera) -> RoadView:
    """RoadView of a camera, for kernels."""
    place = (*camera.principal_point, camera.horizon_row)
    lens = (camera.focal_length, camera.row_distance, camera.mount_height)
    return RoadView(float(camera.width), *map(float, place), *map(float, lens))


def strip_geometry(camera: Camera, nearest: float) -> StripGeometry:
    """Lay strips over the image of a camera (`nearest` [px])."""
    top = max(math.ceil(camera.horizon_row + nearest), 0)
    first, last = _row_bins(camera.horizon_row, top, camera.height - 1, WHOLE_ROWS)
    below: Floats = 0.5 * (first + last).astype(np.float64) - camera.horizon_row
    half: Floats = 0.5 * (last - first + 1).astype(np.float64)
    # A lateral offset x at depth z, seen from a camera that looks down, is α x / z columns off the axis.
    across = camera.focal_length / camera.row_distance * below
    sides = camera.principal_point[0] + SIDES[:, :, None] * across
    return StripGeometry(
        first,
        last,
        below,
        half,
        camera.row_distance / below,
        camera.row_distance * 2.0 * half / np.maximum(below**2 - half**2, 1e-9),
        np.arctan2(camera.mount_height * below, camera.row_distance),
        *lay(np.ascontiguousarray(sides[:, 0]), np.ascontiguousarray(sides[:, 1]), below, view_of(camera)),
    )


@kernel
def lay(left: Floats, right: Floats, below: Floats, view: RoadView) -> tuple[Floats, Floats, Floats, Floats]:
    """Cut strips to the image, which leaves nothing of what is mostly outside: columns, path and what a lens takes.

    Takes `left`, `right` (strips, n) [px], `below` (n,) [px].
    """
    path, off_axis = np.empty(left.shape), np.empty(left.shape)
    for s in range(left.shape[0]):
        for i in range(below.size):
            low = min(max(left[s, i], -0.5), view.width - 0.5)
            high = min(max(right[s, i], -0.5), view.width - 0.5)
            if high - low < 0.3 * (right[s, i] - left[s, i]):
                high = low
            left[s, i], right[s, i] = low, high
            # Mean across the strip by Simpson's rule: near, a lane is wide.
            y, slant, lost = (below[i] + view.horizon - view.row) / view.focal, 0.0, 0.0
            for j in range(3):
                column = low if j == 0 else (0.5 * (low + high) if j == 1 else high)
                x, weight = (column - view.column) / view.focal, 4.0 if j == 1 else 1.0
                square = 1.0 + (x * x + y * y)
                slant += weight * math.sqrt(square)
                lost += weight * (1.0 - 1.0 / (square * square))
            path[s, i], off_axis[s, i] = view.unit * (slant / 6.0), lost / 6.0
    return left, right, path, off_axis


@kernel
def _row_bins(horizon: float, top: int, bottom: int, whole_rows: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First and last row of bins from the bottom up to a top row; their height grows with their rows below the horizon.

    Takes `horizon` [px], `whole_rows` [px].
    """
    first, last = np.empty(max(bottom - top + 1, 0), np.int64), np.empty(max(bottom - top + 1, 0), np.int64)
    row, count = bottom, 0
    while row >= top:
        height = max(int((row - horizon) / whole_rows), 1)
        first[count], last[count] = max(row - height + 1, top), row
        row -= height
        count += 1
    return first[:count].copy(), last[:count].copy()
