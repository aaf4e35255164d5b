"""Strips of road that follow its course, and what the course leaves unsure of the extinction."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fogsim.core.jit import kernel
from fogsim.core.linear_algebra import inverse_of, times
from fogsim.values.camera import Camera
from fogsim.vision.lines.road_course import RoadCourse
from fogsim.vision.lines.road_course_kernels import PIECES, row_on_plane, turned
from fogsim.vision.strips.joint_fit import JointFit
from fogsim.vision.strips.joint_kernels import JointPrior
from fogsim.vision.strips.strip_geometry import SIDES, RoadView, StripGeometry, lay, view_of

Floats = NDArray[np.float64]

_GRAIN, _GRAIN_LENGTH = 0.02, 3.0
"""Deviation of the albedo along a road, relative to it [-], and the length over which it forgets itself [m]."""

_MOST_ASIDE = 0.6
"""Deviation of a bent road's place up to which strips are on the road [m]."""

_ROUNDING = 0.1
"""Deviation of a bin's mean that quantisation leaves [linear grey levels]."""

EXTINCTION, _AIRLIGHT, _SHIFT, _ROAD = range(4)
"""Unknowns of the joint fit, linearised; from the fourth on the road's luminance in each strip."""


class Seen(NamedTuple):
    """What the joint fit has used and found."""

    used: NDArray[np.bool_]  # (strips, n) bool: Bins that took part
    path: Floats  # (strips, n): λ times the slant [px·m]
    # below, half, distance, extent (n,): see `fogsim.vision.strips.strip_geometry.StripGeometry`
    below: Floats
    half: Floats
    distance: Floats
    extent: Floats
    pixels: Floats  # (strips, n): Pixels of each bin
    # extinction, airlight, road, shift, noise: k [1/m], luminances [linear grey levels], rows [px], and deviation of
    # single pixels [linear grey levels]
    extinction: float
    airlight: float
    road: float
    shift: float
    noise: float


@kernel
def _rows_on_plane(below: Floats, sag: Floats, unit: float, height: float) -> Floats:
    """`row_on_plane` for many rows, nearest first: 0 from the first that shows no road on (`below` (n,) [px])."""
    out = np.zeros(below.size)
    start = below[0]
    for i in range(below.size):
        start, _ = row_on_plane(below[i], sag, unit, height, start)
        if start <= 0.0:
            break
        out[i] = start
    return out


@kernel
def sideways(distance: Floats, curvature: Floats, covariance: Floats) -> tuple[Floats, Floats]:
    """How far a curved road has turned aside at distances, and the standard deviation of that [m].

    Takes `distance` (n,) [m], `curvature` (pieces,) [1/m], `covariance` (pieces, pieces) [1/m²].
    """
    aside, deviation = np.zeros(distance.size), np.zeros(distance.size)
    offset = np.empty(PIECES)
    for i in range(distance.size):
        for piece in range(PIECES):
            offset[piece] = turned(distance[i], piece)[0]
        aside[i] = (curvature * offset).sum()
        deviation[i] = math.sqrt(max((offset * times(covariance, offset)).sum(), 0.0))
    return aside, deviation


@kernel
def _extinction_response(seen: Seen, deviations: Floats, height: float) -> Floats:
    """By how much the extinction errs with the row and with the vertical curvatures, least squares all at once.

    Returns error of k by row [1/m per px], and by curvature [-] (1 + pieces,). Takes `deviations` (2 + pieces,) [linear
    grey levels], [px], [1/m], `height` [m].
    """
    strips, count = seen.used.shape
    size = _ROAD + strips
    normal, mixed = np.zeros((size, size)), np.zeros((size, PIECES))
    normal[_AIRLIGHT, _AIRLIGHT], normal[_SHIFT, _SHIFT] = deviations[0] ** -2, deviations[1] ** -2
    column, moved = np.zeros(size), np.zeros(PIECES)
    for strip in range(strips):
        for i in range(count):
            rows = seen.below[i] - seen.shift
            if not seen.used[strip, i] or rows <= seen.half[i]:
                continue
            length = seen.path[strip, i] / rows
            left = math.exp(-seen.extinction * length)
            drop = seen.road - seen.airlight
            by_length = -drop * seen.extinction * left
            column[:] = 0.0
            column[EXTINCTION], column[_AIRLIGHT] = -drop * length * left, 1.0 - left
            column[_SHIFT], column[_ROAD + strip] = by_length * length / rows, left
            for piece in range(PIECES):
                # A secant as long as the deviation: what fog hides of the road can change no more.
                farther = deviations[2 + piece] * turned(seen.distance[i], piece)[0] / height
                moved[piece] = drop * left * -math.expm1(-seen.extinction * length * farther) / deviations[2 + piece]
            grain = (_GRAIN * seen.road * left) ** 2 * max(_GRAIN_LENGTH / seen.extent[i], 1.0)
            weight = 1.0 / (seen.noise**2 / max(seen.pixels[strip, i], 1.0) + _ROUNDING**2 + grain)
            for a in range(size):
                for b in range(size):
                    normal[a, b] += weight * column[a] * column[b]
                for piece in range(PIECES):
                    mixed[a, piece] += weight * column[a] * moved[piece]
    inverse = inverse_of(normal)
    out = np.zeros(1 + PIECES)
    out[0] = -inverse[EXTINCTION, _SHIFT] / deviations[1] ** 2
    for piece in range(PIECES):
        for a in range(size):
            out[1 + piece] += inverse[EXTINCTION, a] * mixed[a, piece]
    return out


def course_geometry(geometry: StripGeometry, camera: Camera, course: RoadCourse) -> StripGeometry:
    """Lay strips along a road that bends, sags or crests.

    Rows are given by where they would be seen were the road the plane that touches it under the camera, about the
    course's horizon; so the joint fit takes them as it takes those of a plane.
    """
    bend = Bend(course.column, course.bend, course.bend_covariance)
    return lay_along(geometry, view_of(camera), course.row - camera.horizon_row, course.sag, bend, SIDES)


class Bend(NamedTuple):
    """Course of a road to the side."""

    column: float  # Where the road's tangent under the camera vanishes [px]
    curvature: Floats  # (pieces,): Positive to the right [1/m]
    covariance: Floats  # (pieces, pieces): Of the curvatures [1/m²]


@kernel
def lay_along(
    straight: StripGeometry, view: RoadView, shift: float, sag: Floats, bend: Bend, sides: Floats
) -> StripGeometry:
    """Strips between sides (strips, 2) [m] of a course whose horizon lies some rows (`shift`) below the calibrated one.

    Takes `sag` (pieces,) [1/m].
    """
    count, strips = straight.below.size, len(sides)
    rows, half = np.empty((3, count)), np.empty(count)
    for j in range(3):
        seen = straight.below - shift + (j - 1) * straight.half
        rows[j] = _rows_on_plane(np.maximum(seen, 1e-3), sag, view.unit, view.height)
    middle, extent = rows[1].copy(), np.ones(count)
    for i in range(count):
        if rows[0, i] <= 0.0:
            middle[i], half[i] = 1.0, 0.5
        else:
            half[i] = 0.5 * (rows[2, i] - rows[0, i])
            extent[i] = view.unit * 2.0 * half[i] / max(middle[i] * middle[i] - half[i] * half[i], 1e-9)
    distance = view.unit / middle
    aside, unsure = sideways(distance, bend.curvature, bend.covariance)
    left, right = np.empty((strips, count)), np.empty((strips, count))
    for s in range(strips):
        for i in range(count):
            across = view.focal / distance[i]
            left[s, i] = bend.column + across * (aside[i] + sides[s, 0])
            right[s, i] = bend.column + across * (aside[i] + sides[s, 1])
            if rows[0, i] <= 0.0 or unsure[i] > _MOST_ASIDE:
                right[s, i] = left[s, i]
    left, right, path, off_axis = lay(left, right, straight.below, view)
    return StripGeometry(
        straight.first,
        straight.last,
        middle + shift,
        half,
        distance,
        extent,
        straight.grazing,
        left,
        right,
        path,
        off_axis,
    )


def course_deviation(
    fit: JointFit, geometry: StripGeometry, camera: Camera, course: RoadCourse, prior: JointPrior, noise: float
) -> float:
    """Standard deviation of the extinction by what is not known of the course, beyond that by its horizon [1/m].

    Takes `noise` [linear grey levels].
    """
    # A fit with one of both neighbours does not say which.
    strips = len(fit.used) if len(fit.used) == len(geometry.path) else 1
    seen = Seen(
        used=fit.used[:strips],
        path=geometry.path[:strips],
        below=geometry.below,
        half=geometry.half,
        distance=geometry.distance,
        extent=geometry.extent,
        pixels=(geometry.right - geometry.left)[:strips] * geometry.rows,
        extinction=max(fit.extinction, 0.0),
        airlight=fit.airlight,
        road=fit.road,
        shift=fit.shift,
        noise=noise,
    )
    deviations = np.array([min(prior.below, prior.above), prior.shift_deviation, *course.sag_deviation])
    return math.sqrt(_course_variance(seen, deviations, course.covariance, float(camera.mount_height)))


@kernel
def _course_variance(seen: Seen, deviations: Floats, covariance: Floats, height: float) -> float:
    """Variance of the extinction by the course, beyond that by its horizon [1/m²] (`covariance` of `RoadCourse`)."""
    response = _extinction_response(seen, deviations, height)
    through, total = times(covariance, response), 0.0
    for a in range(response.size):
        total += response[a] * through[a]
    return float(max(total - response[0] * response[0] * covariance[0, 0], 0.0))
