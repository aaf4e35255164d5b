"""Where a road's lines meet in an image of a camera that nothing is known of."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from fogsim.linear_algebra import inverse_of, matrix_product
from fogsim.offline.image_files import Pixels
from fogsim.values import Response
from fogsim.vision.light.luminance import linear_luminance

Floats = NDArray[np.float64]

LOWEST_ANGLE, STEEPEST_ANGLE = math.radians(8.0), math.radians(80.0)
"""Angles to the rows between which a segment can lie along the road: roofs are flatter, posts are steeper [rad]."""

LEAST_LENGTH = 0.03
"""Share of the image's width below which a segment's direction says too little."""

SKY = 0.4
"""Share of the image's height above which there is no road."""

LONGEST = 40
"""Segments whose intersections are tried, the longest: 400 pairs at most."""

FIRST_REACH = 0.02
"""Sine of the angle within which a segment points at an intersection, at first [-]."""

PLACE_DEVIATION = 0.3
"""Standard deviation of an edge pixel across its segment [px]."""

STRAIGHTNESS = 0.1
"""Standard deviation of a line of the road from a straight one [px]."""


@dataclass(frozen=True, slots=True)
class MeetingPoint:
    """Where the lines of a road meet.

    Attributes
    ----------
    column, row : float
        [px].
    row_deviation : float
        Standard deviation of the row [px].
    segments : int
        How many segments point there.
    """

    column: float
    row: float
    row_deviation: float
    segments: int


@dataclass(frozen=True, slots=True)
class _Segments:
    """Straight pieces of edges: middle (n, 2), normal (n, 2), its product with the middle, length, top, lean."""

    middle: Floats
    normal: Floats
    offset: Floats
    length: Floats
    top: Floats
    lean: Floats

    def miss(self, point: Floats) -> Floats:
        """By how much each one's line passes a point [px]."""
        return matrix_product(self.normal, point) - self.offset

    def leans_both_ways(self, chosen: NDArray[np.bool_]) -> bool:
        return bool((self.lean[chosen] < 0).any() and (self.lean[chosen] > 0).any())


def meeting_point(image: Pixels, response: Response, bits: int) -> MeetingPoint | None:
    """Vanishing point of the road in an image.

    Line segments (von Gioi et al. 2010, in OpenCV) that could lie along a road; the intersection of two that lean to
    either side at which the greatest length of segments points; then least squares over all that point there, each
    weighted by how surely it points.

    Parameters
    ----------
    image : (rows, cols) or (rows, cols, 3) uint8 or uint16
        Pixel values, red first.
    response : Response
        Curve of the camera.
    bits : int
        Bit depth of the pixel values.

    Returns
    -------
    MeetingPoint or None
        None if no two segments that lean to either side meet between the image's top and its lower fifth.
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
    kept = (length > LEAST_LENGTH * cols) & (angle > LOWEST_ANGLE) & (angle < STEEPEST_ANGLE) & (bottom > SKY * rows)
    normal = np.stack((-along[kept, 1], along[kept, 0]), axis=1) / length[kept, None]
    middle = 0.5 * (ends[kept, :2] + ends[kept, 2:])
    lean = np.sign(along[kept, 0] * along[kept, 1])
    return _Segments(middle, normal, (normal * middle).sum(axis=1), length[kept], top[kept], lean)


def _first_point(segments: _Segments, rows: int, cols: int) -> Floats | None:
    """Intersection of two segments at which the greatest length of segments points."""
    longest = np.argsort(-segments.length, kind="stable")[:LONGEST]
    best, most = None, 0.0
    for i in longest[segments.lean[longest] < 0]:
        for j in longest[segments.lean[longest] > 0]:
            (a, b), (c, d) = segments.normal[[i, j]].tolist()
            e, f = segments.offset[[i, j]].tolist()
            # Of two that lean to either side by 8° or more, none is parallel to the other.
            point = np.array([d * e - b * f, a * f - c * e]) / (a * d - b * c)
            if not (0.0 <= point[1] <= 0.8 * rows and 0.1 * cols <= point[0] <= 0.9 * cols):
                continue
            reach = np.maximum(FIRST_REACH * np.hypot(*(point - segments.middle).T), 1.0)
            pointing = (np.abs(segments.miss(point)) < reach) & _below(segments, point)
            length = float(segments.length[pointing].sum())
            if segments.leans_both_ways(pointing) and length > most:
                best, most = point, length
    return best


def _below(segments: _Segments, point: Floats) -> NDArray[np.bool_]:
    """Which segments lie below a point, as all do that lie on the ground."""
    return np.asarray(segments.top > point[1] - 2.0)


def _fitted(segments: _Segments, point: Floats) -> MeetingPoint | None:
    for _ in range(6):
        far = np.hypot(*(point - segments.middle).T)
        # A straight line through n pixels: 1/n for its place, 12 d²/n³ for its direction.
        by_pixels = PLACE_DEVIATION**2 * (1.0 / segments.length + 12.0 * far**2 / segments.length**3)
        deviation = np.sqrt(by_pixels) + STRAIGHTNESS
        pointing = (np.abs(segments.miss(point)) < 3.0 * deviation) & _below(segments, point)
        if not segments.leans_both_ways(pointing):
            return None
        weight = pointing / deviation**2
        inverse = inverse_of(matrix_product((segments.normal * weight[:, None]).T, segments.normal))
        point = matrix_product(inverse, matrix_product((segments.normal * weight[:, None]).T, segments.offset))
    count = int(pointing.sum())
    scale = float(matrix_product(weight, segments.miss(point) ** 2)) / max(count - 2, 1)
    spread = math.sqrt(max(scale, 1.0) * float(inverse[1, 1]))
    return MeetingPoint(float(point[0]), float(point[1]), spread, count)
