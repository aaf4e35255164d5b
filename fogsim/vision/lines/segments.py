"""The vanishing point of the line segments in an image of an unknown camera."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from fogsim.values.camera import Response
from fogsim.vision.light.luminance import linear_luminance
from fogsim.vision.light.pixel_kernels import Pixels
from fogsim.vision.lines.vanishing_point import Lines, VanishingPoint, crossings, nearest_point, residual_scale

Floats = NDArray[np.float64]

_LOWEST_ANGLE, _STEEPEST_ANGLE = math.radians(8.0), math.radians(80.0)
"""Angles to the rows between which a segment can lie along the road: roofs are flatter, posts are steeper [rad]."""

_LEAST_LENGTH = 0.03
"""Share of the image's width below which a segment's direction says too little."""

_SKY = 0.4
"""Share of the image's height above which there is no road."""

LONGEST = 40
"""Segments whose intersections are tried, the longest: 400 pairs at most."""

_FIRST_REACH = 0.02
"""Sine of the angle within which a segment points at an intersection, at first [-]."""

_PLACE_DEVIATION = 0.3
"""Standard deviation of an edge pixel across its segment [px]."""

_STRAIGHTNESS = 0.1
"""Standard deviation of a line of the road from a straight one [px]."""


@dataclass(frozen=True, slots=True)
class _Segments:
    """Straight pieces of edges: lines of unit normals, and each one's middle (n, 2), length, top, and lean (n,)."""

    lines: Lines
    middle: Floats
    length: Floats
    top: Floats
    lean: Floats

    def pointing(self, points: Floats, reach: Floats) -> NDArray[np.bool_]:
        """Which segments point at each point within reach, and lie below it, as all do that lie on the ground."""
        below = self.top > points[..., 1:] - 2.0
        return np.asarray((np.abs(self.lines.misses(points)) < reach) & below)

    def distance(self, points: Floats) -> Floats:
        """Distance of each segment's middle from each point [px]."""
        apart = points[..., None, :] - self.middle
        return np.asarray(np.hypot(apart[..., 0], apart[..., 1]))


@dataclass(frozen=True, slots=True)
class RoadSegments:
    """Segments along the road, and the point where they meet."""

    point: VanishingPoint  # Their vanishing point
    # (n,): Columns per row below that point: lateral offset over the camera's height [-]; negative on the left
    slopes: Floats
    length: Floats  # (n,): Their lengths [px]


def road_segments(image: Pixels, response: Response, bits: int) -> RoadSegments | None:
    """Line segments along the road in an image, and their vanishing point.

    Line segments (von Gioi et al. 2010, in OpenCV) that could lie along a road; the intersection of two that lean to
    either side at which the greatest length of segments points; then least squares over all that point there, each
    weighted by how surely it points.

    Returns None if no two segments that lean to either side meet between the image's top and its lower fifth. Takes
    `image` (rows, cols).
    """
    segments = _segments(linear_luminance(image, response, bits))
    rows, cols = image.shape[:2]
    first = _first_point(segments, rows, cols)
    return None if first is None else _fitted(segments, first)


def _segments(luminance: NDArray[np.float32]) -> _Segments:
    # The detector takes 8 bits; the square root gives dark roads their share of them.
    shown = np.rint(np.sqrt(255.0 * luminance)).astype(np.uint8)
    rows, cols = shown.shape
    detector = cv2.createLineSegmentDetector(cv2.LSD_REFINE_STD, scale=1.0)
    found = detector.detect(shown)[0]
    ends = np.zeros((0, 4)) if found is None else np.asarray(found, np.float64).reshape(-1, 4)
    along = ends[:, 2:] - ends[:, :2]
    length = np.hypot(along[:, 0], along[:, 1])
    angle = np.arctan2(np.abs(along[:, 1]), np.abs(along[:, 0]))
    bottom, top = ends[:, [1, 3]].max(axis=1), ends[:, [1, 3]].min(axis=1)
    kept = (
        (length > _LEAST_LENGTH * cols) & (angle > _LOWEST_ANGLE) & (angle < _STEEPEST_ANGLE) & (bottom > _SKY * rows)
    )
    normal = np.stack((-along[kept, 1], along[kept, 0]), axis=1) / length[kept, None]
    middle = 0.5 * (ends[kept, :2] + ends[kept, 2:])
    lean = np.sign(along[kept, 0] * along[kept, 1])
    return _Segments(Lines(normal, (normal * middle).sum(axis=1)), middle, length[kept], top[kept], lean)


def _first_point(segments: _Segments, rows: int, cols: int) -> Floats | None:
    """Intersection of two segments at which the greatest length of segments points."""
    longest = np.argsort(-segments.length, kind="stable")[:LONGEST]
    lefts, rights = longest[segments.lean[longest] < 0], longest[segments.lean[longest] > 0]
    # Of two that lean to either side by 8° or more, none is parallel to the other.
    points = crossings(segments.lines, np.repeat(lefts, rights.size), np.tile(rights, lefts.size), 0.0)
    column, row = points.T
    points = points[(row >= 0.0) & (row <= 0.8 * rows) & (column >= 0.1 * cols) & (column <= 0.9 * cols)]
    pointing = segments.pointing(points, np.maximum(_FIRST_REACH * segments.distance(points), 1.0))
    length = np.where(_both_ways(segments, pointing), (pointing * segments.length).sum(axis=1), 0.0)
    return points[int(np.argmax(length))] if length.any() else None


def _both_ways(segments: _Segments, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Whether segments that are chosen lean to both sides."""
    left, right = (chosen & (segments.lean < 0)), (chosen & (segments.lean > 0))
    return np.asarray(left.any(axis=-1) & right.any(axis=-1))


def _fitted(segments: _Segments, point: Floats) -> RoadSegments | None:
    for _ in range(6):
        far = segments.distance(point)
        # A straight line through n pixels: 1/n for its place, 12 d²/n³ for its direction.
        by_pixels = _PLACE_DEVIATION**2 * (1.0 / segments.length + 12.0 * far**2 / segments.length**3)
        deviation = np.sqrt(by_pixels) + _STRAIGHTNESS
        pointing = segments.pointing(point, 3.0 * deviation)
        if not _both_ways(segments, pointing):
            return None
        point, covariance = nearest_point(segments.lines, pointing / deviation**2)
    residual = (segments.lines.misses(point) / deviation)[pointing]
    spread = residual_scale(residual) * math.sqrt(float(covariance[1, 1]))
    support = float(segments.length[pointing].sum())
    found = VanishingPoint(float(point[0]), float(point[1]), spread, residual.size, support)
    apart = segments.middle[pointing] - point
    return RoadSegments(found, apart[:, 0] / np.maximum(apart[:, 1], 1.0), segments.length[pointing])
