"""Lane lines by a Hough transform of limited angle, and their vanishing point (zhu2015, huang2015)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from fogsim.vision.lines.vanishing_point import VanishingPoint, crossings, sloped_lines

_HALVES = (1.0, -1.0)
"""Sign of du/dv of the lines left and right of the vanishing point turned by: lines are sought in each half alone."""

_LEAST_PIXELS = 12
"""Fewest edge pixels that make a line."""


@dataclass(frozen=True, slots=True)
class LaneLine:
    """A straight line u = offset + slope · v in the image."""

    slope: float  # du/dv [-]
    offset: float  # Its column at row 0 [px]
    votes: int  # Edge pixels on it

    def column(self, row: float) -> float:
        """Column of the line.

        Returns [px]. Takes `row` [px].
        """
        return self.offset + self.slope * row


def hough_lines(edges: NDArray[np.uint8], first_row: int, lowest_angle: float) -> list[LaneLine]:
    """Longest line of an edge image in either half of the angles (zhu2015 section 3.2, huang2015 section 4.2.3).

    Cells are 1 px by 1°, as published, so slope and offset are those of a cell's middle.

    Takes `edges` (rows, cols) uint8, `lowest_angle` [rad].
    """
    lower = np.ascontiguousarray(edges[first_row:])
    threshold = max(_LEAST_PIXELS, lower.shape[0] // 12)
    found = []
    # OpenCV's angle is that of the normal: 0 for an upright line, π/2 for one along the rows.
    most = 0.5 * math.pi - lowest_angle
    for side in _HALVES:
        # Its cells are not the same to both sides: the lines of the other half are sought in the mirrored image.
        half = lower if side > 0 else np.ascontiguousarray(lower[:, ::-1])
        peaks: NDArray[Any] | None = cv2.HoughLinesWithAccumulator(
            half, 1.0, math.radians(1.0), threshold, min_theta=0.0, max_theta=most
        )
        for radius, angle, votes in [] if peaks is None else peaks.reshape(-1, 3)[:1]:
            cosine, sine = math.cos(float(angle)), math.sin(float(angle))
            if abs(cosine) < 1e-3:
                continue
            slope = -sine / cosine
            offset = float(radius) / cosine - slope * first_row
            if side < 0:
                slope, offset = -slope, edges.shape[1] - 1 - offset
            found.append(LaneLine(slope, offset, int(votes)))
    return found


def longest_pair(lines: Sequence[LaneLine]) -> tuple[LaneLine, LaneLine] | None:
    """Longest line left and right of the vanishing point, of lines in order of length; None if a side has none."""
    left, right = (next((line for line in lines if side * line.slope < 0), None) for side in _HALVES)
    return None if left is None or right is None else (left, right)


def published_vanishing_point(lines: list[LaneLine], first_row: int) -> VanishingPoint | None:
    """Intersection of the longest line of either half, as published, of an image that begins at a row of another.

    Returns None if a half has no line; its deviation is that of 1° and 1 px at either line.
    """
    pair = longest_pair(lines)
    if pair is None:
        return None
    first, second = pair
    both = sloped_lines([first.offset, second.offset], [first.slope, second.slope])
    row = float(crossings(both, np.zeros(1, np.int64), np.ones(1, np.int64), 0.0)[0, 1])
    return VanishingPoint(first.column(row), row + first_row, 15.0, 2, first.votes + second.votes)
