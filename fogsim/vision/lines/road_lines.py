"""The vanishing point of the lines along a road, near where the calibration expects it."""

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Camera
from fogsim.vision.light.pixel_kernels import LinearPixels
from fogsim.vision.lines import road_line_kernels
from fogsim.vision.lines.horizon import Horizon
from fogsim.vision.lines.uprights import lying

Floats = NDArray[np.float64]

MOST_ROWS = 100
"""Rows that are looked at, evenly from below the horizon to the image's bottom."""

CLEAR_OF_HORIZON = 0.025
"""Angle below the horizon from which lines are looked at: 50 to 60 m ahead [rad]."""

YAW, YAW_STEP = math.radians(4.0), 0.006
"""How far the road may run to either side of the camera's axis, and the step in which that is tried [rad]."""

STEEPEST, SLOPE_STEP = 6.5, 0.035
"""Columns per row of lines that are sought, and the cells of their slopes [-]."""

MOST_LINES = 12
"""Lines that are kept."""

TOLERANCE = 3.0
"""How far a line may pass by the point in which the others meet [px]."""

BEND = 5e-4
"""Standard deviation of a road's bend, half its curvature times the camera's height [-]: a radius of 1500 m."""

FLAT, DRAWN = math.radians(0.012), 0.05
"""Standard deviations of a vanishing point's row by roads that are not quite flat [rad], and by how images are drawn,
scaled and compressed [px]."""

AGREES = 4.0
"""Standard deviations within which a vanishing point belongs to the told horizon [-]."""


@dataclass(frozen=True, slots=True)
class MeetingLines:
    """Where the lines along the road meet.

    Attributes
    ----------
    column, row : float
        In the image [px].
    row_deviation : float
        Standard deviation of the row [px].
    lines : int
        How many they are.
    """

    column: float
    row: float
    row_deviation: float
    lines: int

    @property
    def horizon(self) -> Horizon:
        """The horizon that they show."""
        return Horizon(self.row, self.row_deviation)


def meeting_lines(image: LinearPixels, camera: Camera, horizon: Horizon) -> MeetingLines | None:
    """Find the vanishing point of the road's lines near the one that the calibration tells.

    Edges along single rows, placed within the pixel; Hough's transform of those that can lie on lines toward the
    neighbourhood of the told vanishing point; the point through which most of the lines pass; least squares of all of
    them at once, which lets the road bend.

    Parameters
    ----------
    image : LinearPixels
        A level image.
    camera : Camera
        Its told calibration.
    horizon : Horizon
        What is known of the horizon.

    Returns
    -------
    MeetingLines or None
        None if no two lines meet near the told horizon.
    """
    rows = _rows(camera, horizon)
    if rows.size < road_line_kernels.LEAST_POINTS:
        return None
    place, kind = _points(image, rows, horizon)
    across, below = place[:, 0] - camera.principal_point[0], place[:, 1] - horizon.row
    offsets, slopes = _cells(YAW * camera.focal_length)
    least = max(int(road_line_kernels.LEAST_POINTS), rows.size // 8)
    found, kinds = road_line_kernels.vote(across, below, kind, offsets, slopes, MOST_LINES, least)
    lines = road_line_kernels.straighten(across, below, kind, found, kinds, 0.5 * (offsets[1] - offsets[0]) + 2.0)
    farthest = AGREES * horizon.standard_deviation + 2.0
    offset, row, votes = road_line_kernels.agreeing(lines, TOLERANCE, farthest)
    passing = (lines[:, 2] > 0) & (np.abs(lines[:, 0] + lines[:, 1] * row - offset) <= TOLERANCE)
    if votes == 0.0 or passing.sum() < 2:
        return None
    offset, row, variance, count, span = road_line_kernels.meet(
        across, below, kind, lines[passing, 1], kinds[passing], offset, row, BEND * camera.focal_length**2
    )
    deviation = math.hypot(math.sqrt(variance), FLAT * camera.focal_length, DRAWN)
    apart = AGREES * math.hypot(horizon.standard_deviation, deviation)
    if count < 2 or span < road_line_kernels.LEAST_TURN or not abs(row) <= apart:
        return None
    return MeetingLines(camera.principal_point[0] + offset, horizon.row + row, deviation, count)


def _points(
    image: LinearPixels, rows: NDArray[np.int64], horizon: Horizon
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Edges on rows, without those that stand upright: these are followed up to the horizon."""
    step = int(rows[1] - rows[0])
    above = np.arange(int(rows[0]) - step, max(math.floor(horizon.row), -1), -step, dtype=np.int64)[::-1]
    place, kind = road_line_kernels.row_points(image.pixels, image.tables, np.concatenate((above, rows)))
    lies = lying(place, step) & (place[:, 1] >= rows[0])
    return place[lies], kind[lies]


@functools.lru_cache(maxsize=8)
def _cells(reach: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Offsets [px] and slopes of the lines that are voted for; they belong to all who ask."""
    offsets = np.linspace(-reach, reach, 2 * math.ceil(YAW / YAW_STEP) + 1)
    return offsets, np.linspace(-STEEPEST, STEEPEST, 2 * round(STEEPEST / SLOPE_STEP) + 1)


def _rows(camera: Camera, horizon: Horizon) -> NDArray[np.int64]:
    first = math.ceil(horizon.row + max(CLEAR_OF_HORIZON * camera.focal_length, 8.0))
    step = max(math.ceil((camera.height - first) / MOST_ROWS), 1)
    return np.arange(first, camera.height - 1, step, dtype=np.int64)
